"""The engine of studies: pieces that are kept, times that are measured anew, options of the kinds of their defaults."""

import json

import pytest

from baselines.work.tasks import Task
from birthsim.command_line.command import program
from lab.engine.study import Options, Study
from lab.studies import pools


def square(number, log):
    with open(log, "a", encoding="utf-8") as file:
        file.write(f"{number} ")
    return {"square": number**2}


def study(log, **more):
    return Study(
        {"numbers": (1, 2), "scale": 2.0, "name": "", "quiet": False},
        lambda options: {k: Task(f"{k}", square, {"number": k, "log": str(log)}) for k in options.numbers},
        lambda options, found: {str(k): options.scale * one["square"] for k, one in found.items()},
        {"square": "m2"},
        lambda content: {"one.md": json.dumps(content["figures"])},
        **more,
    )


def measured(one, out, *line):
    one.measure("one", program("birthsim study one", one.settings("squares"))([*line, "--jobs", "1", "--out", str(out)]))
    return json.loads((out / "one.json").read_text())


def test_pieces_are_kept_and_only_what_is_missing_is_computed(tmp_path):
    log, out = tmp_path / "log", tmp_path / "out"
    first = measured(study(log), out)
    assert (first["figures"], first["pieces"], first["pieces_kept"]) == ({"1": 2.0, "2": 8.0}, 2, 0)
    assert first["settings"] == {"numbers": [1, 2], "scale": 2.0, "name": "", "quiet": False}
    more = measured(study(log), out, "--numbers", "2", "3", "--scale", "0.5", "--quiet")
    assert (more["figures"], more["pieces_kept"]) == ({"2": 2.0, "3": 4.5}, 1)
    assert log.read_text().split() == ["1", "2", "3"]
    assert (out / "one.md").read_text() == json.dumps(more["figures"])


def test_times_are_measured_anew(tmp_path):
    log, out = tmp_path / "log", tmp_path / "out"
    for _ in range(2):
        assert measured(study(log, timed=True), out)["pieces_kept"] == 0
    assert log.read_text().split() == ["1", "2"] * 2


def test_what_is_not_allowed_is_refused(tmp_path):
    read = program("birthsim study one", study(tmp_path, allowed={"name": ("a", "b")}).settings("squares"))
    for line in (["--numbers", "0"], ["--scale", "nan"], ["--name", "c"]):
        with pytest.raises(Exception, match=line[0]):
            read(line)
    assert read(["--name", "b"]).name == "b"


def test_pools_cost_less_than_their_pieces_last(monkeypatch):
    monkeypatch.setattr(pools, "PIECES", 8)
    (task,) = pools.STUDY.tasks(Options(beside="")).values()
    found = task.work(**task.settings)
    assert found["lasting"] > pools.LASTS / 4
    assert found["start"] > found["empty"] > 0.0
