"""Long work in pieces: what is kept, what is computed anew, and that an interrupted run ends as if nothing had happened."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from baselines.work import claims, tasks
from baselines.work.claims import Claims
from baselines.work.files import this_process
from baselines.work.tasks import Task, code_stamp, run_tasks
from tests.work.test_side_by_side import waited_for


def square(log, number):
    """Writes down that it ran, and squares."""
    with open(log, "a", encoding="utf-8") as file:
        file.write(f"{number}\n")
    return {"square": number**2, "nothing": math.nan}


def interrupt(log, number):
    if number == 3 and not Path(log).with_suffix(".again").exists():
        raise KeyboardInterrupt
    return square(log, number)


def fail(log, number):
    if number == 3:
        raise RuntimeError("three is not for me")
    return square(log, number)


def die(log, number):
    os._exit(1)


@pytest.fixture
def log(tmp_path):
    return tmp_path / "log"


def made(log, work=square, numbers=range(5)):
    return [Task(f"deep/{k}", f"group {k % 2}", work, {"log": str(log), "number": k}) for k in numbers]


def ran(log):
    return [int(line) for line in log.read_text().split()] if log.exists() else []


def test_results_are_written_piece_by_piece_and_come_back_as_written(log, tmp_path):
    results, failures = run_tasks(made(log), tmp_path / "out", 1, "work")
    assert failures == {}
    assert results == {f"deep/{k}": {"square": k * k, "nothing": None} for k in range(5)}
    task = made(log)[3]
    content = json.loads((tmp_path / "out" / task.file()).read_text())
    assert content["result"] == {"square": 9, "nothing": None}
    assert content["code"] == task.code() == code_stamp()
    assert content["settings"] == task.settings


def test_an_interrupted_run_goes_on_where_it_stopped_and_ends_like_an_uninterrupted_one(log, tmp_path, capsys):
    whole, _ = run_tasks(made(tmp_path / "other"), tmp_path / "whole", 1, "work")
    with pytest.raises(KeyboardInterrupt):
        run_tasks(made(log, interrupt), tmp_path / "out", 1, "work")
    assert ran(log) == [0, 1, 2]
    assert "are kept" not in capsys.readouterr().out
    log.with_suffix(".again").touch()
    results, _ = run_tasks(made(log, interrupt), tmp_path / "out", 1, "work")
    assert ran(log) == [0, 1, 2, 3, 4]
    assert results == whole
    assert (
        "work: 3 of 5 are there with these settings, rig and code, and are kept: group 0 2, group 1 1"
        in capsys.readouterr().out
    )
    assert run_tasks(made(log), tmp_path / "out", 1, "work")[0] == whole
    assert len(ran(log)) == 5


def test_pieces_of_other_settings_or_other_code_are_computed_anew(log, tmp_path, capsys, monkeypatch):
    run_tasks(made(log), tmp_path / "out", 1, "work")
    moved = [Task(task.name, task.group, square, {**task.settings, "number": 7}) for task in made(log, numbers=[2])]
    results, _ = run_tasks([*made(log, numbers=[0, 1]), *moved], tmp_path / "out", 1, "work")
    assert ran(log)[5:] == [7]
    assert results["deep/2"]["square"] == 49
    assert "work: 1 are there with other settings, rig or code, and are computed anew" in capsys.readouterr().out
    monkeypatch.setattr(tasks, "code_stamp", lambda package: {"version": "other"})
    run_tasks(made(log, numbers=[0, 1]), tmp_path / "out", 1, "work")
    assert ran(log)[6:] == [0, 1]


@pytest.mark.parametrize(
    "damage",
    [
        lambda text: "",
        lambda text: "{",
        lambda text: "[]",
        lambda text: '{"code": 1}',
        lambda text: "[" * 100_000,
        lambda text: text.replace('"square": 1', '"square": 3'),
    ],
)
def test_a_damaged_piece_is_computed_anew(log, tmp_path, damage):
    run_tasks(made(log, numbers=[1]), tmp_path / "out", 1, "work")
    path = tmp_path / "out" / made(log)[1].file()
    path.write_text(damage(path.read_text()))
    results, _ = run_tasks(made(log, numbers=[1]), tmp_path / "out", 1, "work")
    assert ran(log) == [1, 1]
    assert results["deep/1"]["square"] == 1


def test_a_piece_that_fails_costs_no_other_and_is_tried_again(log, tmp_path):
    results, failures = run_tasks(made(log, fail), tmp_path / "out", 1, "work")
    assert failures == {"deep/3": "RuntimeError: three is not for me"}
    assert sorted(results) == ["deep/0", "deep/1", "deep/2", "deep/4"]
    run_tasks(made(log, square), tmp_path / "out", 1, "work")
    assert ran(log) == [0, 1, 2, 4, 3]


def test_two_processes_give_what_one_gives(log, tmp_path):
    alone = run_tasks(made(log, fail), tmp_path / "one", 1, "work")
    assert run_tasks(made(tmp_path / "second", fail), tmp_path / "two", 2, "work") == alone
    assert sorted(ran(tmp_path / "second")) == [0, 1, 2, 4]


def others_claim(log, folder, text, number=1):
    path = folder / made(log)[number].file()
    path.parent.mkdir(parents=True)
    path.with_suffix(".claim").write_text(text)


def test_the_claim_of_a_process_that_died_is_void(log, tmp_path):
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    others_claim(log, tmp_path / "out", f"{this_process()[0]} {dead.pid}")
    assert run_tasks(made(log), tmp_path / "out", 1, "work")[0]["deep/1"]["square"] == 1
    assert not list(tmp_path.rglob("*.claim"))


@pytest.mark.slow
def test_the_claim_of_another_host_is_void_once_nobody_touches_it(log, tmp_path, monkeypatch):
    monkeypatch.setattr(claims, "PATIENCE", 1.5)
    others_claim(log, tmp_path / "out", "elsewhere 1")
    run_tasks(made(log), tmp_path / "out", 1, "work")
    assert ran(log) == [0, 2, 3, 4, 1], "what others have claimed comes last"
    assert not list(tmp_path.rglob("*.claim"))


def test_ctrl_c_while_a_claim_is_made_leaves_none(monkeypatch, tmp_path):
    """It comes when the file is there and nobody knows yet whose it is."""
    opened = Path.open

    def now(path, mode, **options):
        file = opened(path, mode, **options)
        signal.raise_signal(signal.SIGINT)
        return file

    monkeypatch.setattr(Path, "open", now)
    with pytest.raises(KeyboardInterrupt), Claims() as mine:
        mine.take(tmp_path / "piece.json")
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_right_after_a_piece_is_written_counts_it(log, tmp_path, monkeypatch, capsys):
    """Between the file and the count of what is kept."""
    written = tasks._write

    def now(*piece):
        written(*piece)
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(tasks, "_write", now)
    with pytest.raises(KeyboardInterrupt):
        run_tasks(made(log, square, range(3)), tmp_path / "out", 1, "work")
    assert len(list(tmp_path.rglob("*.json"))) == 1
    assert "work: 1 of 3 are complete and kept; the same command goes on" in capsys.readouterr().out


def test_a_claim_is_touched_and_respected_until_it_is_given_up(tmp_path, monkeypatch):
    monkeypatch.setattr(claims, "HEARTBEAT", 0.02)
    monkeypatch.setattr(claims, "PATIENCE", 0.0)
    path = tmp_path / "piece.json"
    with Claims() as mine, Claims() as others:
        assert mine.take(path)
        before = path.with_suffix(".claim").stat().st_mtime_ns
        waited_for(lambda: path.with_suffix(".claim").stat().st_mtime_ns != before)
        monkeypatch.setattr(claims, "PATIENCE", 60.0)
        assert not others.take(path)
        mine.give_up(path)
        assert others.take(path)
    assert list(tmp_path.iterdir()) == []


PROCESS = """
import sys
from pathlib import Path
from baselines.work.tasks import run_tasks
from tests.work.test_tasks import made, slowly
if __name__ == "__main__":
    log, out = map(Path, sys.argv[1:])
    results, failures = run_tasks(made(log, slowly, range(12)), out, 1, "work")
    assert not failures and [results[f"deep/{k}"]["square"] for k in range(12)] == [k * k for k in range(12)]
"""


def slowly(log, number):
    time.sleep(0.2)
    return square(log, number)


@pytest.mark.slow
def test_processes_on_one_folder_divide_the_work_and_all_have_the_results(log, tmp_path):
    line = [sys.executable, "-c", PROCESS, str(log), str(tmp_path / "out")]
    processes = [subprocess.Popen(line, stderr=subprocess.DEVNULL) for _ in range(3)]
    assert [process.wait(120) for process in processes] == [0, 0, 0]
    assert sorted(ran(log)) == list(range(12)), "each piece once"
    assert not list(tmp_path.rglob("*.claim"))


def test_a_process_that_dies_is_reported(log, tmp_path):
    with pytest.raises(OSError, match="a process that computed has died"):
        run_tasks(made(log, die, [0, 1]), tmp_path / "out", 2, "work")


def test_the_stamp_follows_what_computes_and_not_what_shows(tmp_path, monkeypatch):
    for name in (
        "birthsim_env/physics/plant.py",
        "birthsim_env/drawing/rendering.py",
        "baselines/gains.json",
        "baselines/figures/runs.py",
    ):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("1")
    monkeypatch.setattr(tasks, "_ROOT", tmp_path)
    anew = code_stamp.__wrapped__
    stamp = anew()
    assert {"version", "sources", "numpy", "numba"} <= set(stamp)
    for name, counts in (("physics/plant.py", True), ("drawing/rendering.py", False)):
        (tmp_path / "birthsim_env" / name).write_text("2")
        assert (anew() != stamp) == counts, name
        stamp = anew()
    for name, counts in (("gains.json", True), ("figures/runs.py", False), ("new.py", True)):
        (tmp_path / "baselines" / name).write_text("2")
        assert (anew() != stamp) == counts, name
        stamp = anew()


def test_every_source_that_is_left_out_of_the_stamp_exists():
    assert [name for name in tasks._SHOWN_ONLY if not (tasks._ROOT / name).exists()] == []
