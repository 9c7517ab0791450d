"""Long work in pieces: what is kept, what is computed anew, and that an interrupted run ends as if nothing had happened."""

import json
import math
import os
import signal
import threading
import time
from pathlib import Path

import pytest

from baselines.bench.pieces import evaluate_piece
from baselines.work import asked, tasks
from baselines.work.calls import called_by
from baselines.work.tasks import Task, code_stamp, run_tasks
from birthsim_env.registry import entry, register
from tests.console import PATIENCE


def square(log, number):
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


@pytest.fixture
def log(tmp_path):
    return tmp_path / "log"


def made(log, work=square, numbers=range(5)):
    return [Task(f"deep/{k}", work, {"log": str(log), "number": k}) for k in numbers]


def ran(log):
    return [int(line) for line in log.read_text().split()] if log.exists() else []


def test_results_are_written_piece_by_piece_and_come_back_as_written(log, tmp_path):
    results, failures = run_tasks(made(log), tmp_path / "out", 1, "work")
    assert failures == {}
    assert results == {f"deep/{k}": {"square": k * k, "nothing": None} for k in range(5)}
    task = made(log)[3]
    content = json.loads((tmp_path / "out" / task.file()).read_text())
    assert content["result"] == {"square": 9, "nothing": None}
    assert content["code"] == code_stamp(task.work, content["used"])
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
    assert "work: 3 of 5 are there with these settings, rig and code, and are kept" in capsys.readouterr().out
    assert run_tasks(made(log), tmp_path / "out", 1, "work")[0] == whole
    assert len(ran(log)) == 5


def test_pieces_of_other_settings_or_other_code_are_computed_anew(log, tmp_path, capsys, monkeypatch):
    run_tasks(made(log), tmp_path / "out", 1, "work")
    moved = [Task(task.name, square, {**task.settings, "number": 7}) for task in made(log, numbers=[2])]
    results, _ = run_tasks([*made(log, numbers=[0, 1]), *moved], tmp_path / "out", 1, "work")
    assert ran(log)[5:] == [7]
    assert results["deep/2"]["square"] == 49
    assert "work: 2 of 3 are there with these settings, rig and code, and are kept" in capsys.readouterr().out
    monkeypatch.setattr(tasks, "code_stamp", lambda work, used: {"version": "other"})
    run_tasks(made(log, numbers=[0, 1]), tmp_path / "out", 1, "work")
    assert ran(log)[6:] == [0, 1]


@pytest.mark.parametrize("damaged", ["", "{", "[]", '{"code": 1}', "[" * 100_000, None])
def test_a_damaged_piece_is_computed_anew(log, tmp_path, damaged):
    """The last says another result than the one that its checksum belongs to."""
    run_tasks(made(log, numbers=[1]), tmp_path / "out", 1, "work")
    path = tmp_path / "out" / made(log)[1].file()
    path.write_text(path.read_text().replace('"square": 1', '"square": 3') if damaged is None else damaged)
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


def test_the_stamp_follows_what_a_piece_calls_and_nothing_else():
    stamp = code_stamp(evaluate_piece)
    assert {"version", "called", "python", "numpy", "numba", "scipy"} == set(stamp)
    called = called_by([evaluate_piece])
    assert {"baselines/bench/evaluation.py:evaluate", "birthsim_env/physics/plant.py:Plant"} <= set(called)
    assert "baselines/bench/pieces.py:gathered" not in called
    assert [name for name in called if name.startswith(("baselines/figures", "birthsim/", "lab/"))] == []
    assert code_stamp(math.sqrt) != stamp


def made_by_name(name):
    register(hand=name, about="Of this test.")(made_by_name)
    return {"made": entry("hand", name).name}


def test_a_piece_keeps_which_entries_it_asked_for_and_is_computed_anew_where_one_changed(tmp_path, monkeypatch):
    """In another process, which tells this one of it."""
    one, two = (Task(name, made_by_name, {"name": f"hand {name}"}) for name in ("one", "two"))
    monkeypatch.setattr(asked, "_ELSEWHERE", {})
    run_tasks([one, two], tmp_path, 2, "work")
    content = json.loads((tmp_path / one.file()).read_text())
    assert content["used"]["hand=hand one"] == asked.asked()["hand=hand one"] == __name__
    assert tasks.is_kept(one, tmp_path)
    monkeypatch.setattr(tasks, "called_by", lambda work, used: {"hand": "changed"} if "hand=hand one" in used else {})
    assert not tasks.is_kept(one, tmp_path)


def keep(log, number, place, ending):
    """Works until it is asked to end, and keeps how far it has come."""
    Path(f"{log}-{number}").touch()
    until = time.monotonic() + PATIENCE
    while not ending.exists():
        assert time.monotonic() < until
        time.sleep(0.01)
    Path(place).mkdir(parents=True)
    (Path(place) / "kept").write_text(str(number))
    raise RuntimeError(f"piece {number} keeps what it has")


def signal_once(there):
    """Ctrl-C for this process as soon as what is looked for is there."""

    def look():
        until = time.monotonic() + PATIENCE
        while not there() and time.monotonic() < until:
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=look, daemon=True).start()


def test_pieces_that_keep_more_end_by_themselves_after_ctrl_c_and_no_other_begins(log, tmp_path, capfd):
    pieces = [Task(f"deep/{k}", keep, {"log": str(log), "number": k}, keeps=True) for k in range(4)]

    def begun():
        return [k for k in range(4) if Path(f"{log}-{k}").exists()]

    signal_once(lambda: len(begun()) == 2)
    with pytest.raises(KeyboardInterrupt):
        run_tasks(pieces, tmp_path / "out", 2, "work")
    assert len(begun()) == 2
    assert sorted(int(path.read_text()) for path in (tmp_path / "out").rglob("kept")) == begun()
    assert list((tmp_path / "out").rglob("*.json")) == []
    said = capfd.readouterr().out
    assert tasks.WORDS in said
    assert all(f"piece {k} keeps what it has" in said for k in begun())
    assert "work: 0 of 4 are complete and kept; the same command goes on" in said
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
