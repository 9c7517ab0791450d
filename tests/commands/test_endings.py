"""How commands answer signals: in one line, from the first moment to the last."""

import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from birthsim_env.endings import ENDINGS, one_signal_later
from birthsim_env.files import own_folder, whole_results
from tests.console import PATIENCE, ROOT, call

LOADING = """
import sys, time
sys.argv = ["birthsim", "tune"]
from birthsim import main as door
def load(*_):
    print("loading tune", flush=True)
    time.sleep(600)
door.load = load
door.main()
"""

LEAVING = """
import atexit, signal, sys, time
from birthsim.command_line.command import act
def leave():
    print("leaving", flush=True)
    time.sleep(600)
atexit.register(leave)
act("birthsim-x", lambda: signal.raise_signal(signal.SIGTERM))
"""

SWALLOWED = """
import signal
from birthsim.command_line.command import act
def swallow():
    try:
        signal.raise_signal(signal.SIGTERM)
    except BaseException:
        raise TypeError("what compiled code may make of it") from None
act("birthsim-x", swallow)
"""

UNRAISABLE = """
import signal, time
from birthsim.command_line.command import act
class Dying:
    def __del__(self):
        signal.raise_signal(signal.SIGTERM)
def die():
    Dying()
    time.sleep(600)
act("birthsim-x", die)
"""

UNRAISABLE_AT_THE_END = """
import signal
from birthsim.command_line.command import act
class Dying:
    def __del__(self):
        signal.raise_signal(signal.SIGTERM)
before = signal.getsignal(signal.SIGTERM)
act("birthsim-x", lambda: Dying() and None)
assert signal.getsignal(signal.SIGTERM) is before
"""

READING = """
import signal, sys
from dataclasses import dataclass
from typing import Annotated
from cyclopts import Parameter
from birthsim.command_line.command import perform_with
@dataclass
class Settings:
    lanes: Annotated[int, Parameter(converter=lambda *_: signal.raise_signal(signal.SIGTERM))]
sys.argv = ["birthsim-x", "--lanes", "1"]
perform_with("birthsim-x", Settings, print, "")
"""


@pytest.mark.parametrize(
    ("ending", "said"), [("SIGINT", "interrupted"), ("SIGTERM", "terminated"), ("SIGHUP", "the terminal is gone")]
)
@pytest.mark.parametrize("program", [LOADING, LEAVING], ids=["while it is loaded", "while it leaves"])
def test_a_signal_ends_a_command_in_one_line(program, ending, said):
    number = signal.Signals[ending]
    with subprocess.Popen(
        [sys.executable, "-c", program], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() in ("loading tune\n", "leaving\n")
            process.send_signal(number)
            complained = process.communicate(timeout=PATIENCE)[1]
        finally:
            process.kill()
    expected = f"birthsim tune: {said}\n" if program == LOADING else "birthsim-x: terminated\n"
    assert (process.returncode, complained) == (128 + number, expected)


BUSY = {
    "evaluate --env BirthSIM/Probe-v3 --out out": "birthsim.evaluation.run_tasks",
    "animate --out out.webp": "birthsim.commands.animate.take",
    "identify log.csv --out rig.toml": "birthsim.commands.identify.read_trial",
    "compare log.csv --out out": "birthsim.commands.compare.compare_log",
    "tune --controller pid --out out": "birthsim.commands.tune.costs",
}
"""A command, and what it is doing when Ctrl-C comes."""


@pytest.mark.parametrize("line", BUSY)
def test_ctrl_c_before_anything_is_complete_leaves_no_results(line, tmp_path, monkeypatch, capsys):
    def interrupt(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(BUSY[line], interrupt)
    command, *options = line.split()
    status, _, complained = call(command, monkeypatch, capsys, *options)
    assert status == 130
    assert complained.endswith(f"birthsim {command}: interrupted\n")
    assert {path.name for path in tmp_path.rglob("*") if path.is_file()} <= {".lock", "trials.journal"}


@pytest.mark.parametrize(("line", "folder"), [("evaluate --env BirthSIM/Probe-v3 --out .", ""), ("train --out .", "seed_0")])
def test_a_folder_has_one_process_at_a_time(line, folder, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    command, *options = line.split()
    with own_folder(tmp_path / folder):
        status, _, complained = call(command, monkeypatch, capsys, *options)
    assert status == 2
    assert complained.endswith("is in use by another process; allowed: to wait for it, or another folder\n")
    assert {path.name for path in tmp_path.rglob("*") if path.is_file()} == {".lock"}


PLACES = {"swallowed": SWALLOWED, "while options are read": READING, "in a destructor": UNRAISABLE}


@pytest.mark.parametrize("program", PLACES.values(), ids=PLACES)
def test_a_signal_is_a_signal_wherever_it_comes(program):
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (143, "birthsim-x: terminated\n")


def test_a_signal_that_comes_too_late_changes_nothing():
    """It comes in a destructor, and what the command does is complete before it can come again, or it counts."""
    done = subprocess.run([sys.executable, "-c", UNRAISABLE_AT_THE_END], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) in [(0, ""), (143, "birthsim-x: terminated\n")]


def test_the_first_signal_comes_later_unless_it_is_ignored_or_swallowed_and_the_second_at_once(capfd):
    came, own = [], {number: signal.signal(number, lambda number, _: came.append(number)) for number in ENDINGS}
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with one_signal_later("wait", lambda: came.append("then")) as later:
            signal.raise_signal(signal.SIGHUP)
            assert came == later == []
            signal.raise_signal(signal.SIGTERM)
            assert (came, later) == (["then"], [signal.SIGTERM])
        assert came == ["then", signal.SIGTERM]
        assert capfd.readouterr().out == "\nwait\n"
        came.clear()
        with one_signal_later("") as later:
            signal.raise_signal(signal.SIGTERM)
            signal.raise_signal(signal.SIGINT)
            assert (came, later) == ([signal.SIGINT], [])
        assert came == [signal.SIGINT], "once"
        with one_signal_later("") as later:
            signal.raise_signal(signal.SIGTERM)
            later.clear()
        assert came == [signal.SIGINT]
    finally:
        for number, handler in own.items():
            signal.signal(number, handler)
    assert capfd.readouterr().out == ""


def test_outside_the_main_thread_no_signal_is_put_off():
    before, seen = signal.getsignal(signal.SIGINT), []

    def elsewhere():
        with one_signal_later("wait") as later:
            seen.append((later, signal.getsignal(signal.SIGINT)))

    thread = threading.Thread(target=elsewhere)
    thread.start()
    thread.join()
    assert seen == [([], before)]


def test_signals_wait_while_results_replace_others(tmp_path, monkeypatch):
    """The signal comes with the first rename; all files are there before it counts."""
    # A command that another test ran in this process may have left its own handler.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    for name in "abc":
        (tmp_path / name).write_text("old")
    replace = Path.replace

    def renamed(self, target):
        signal.raise_signal(signal.SIGINT)
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", renamed)

    def write():
        with whole_results(tmp_path) as place:
            for name in "abc":
                (place / name).write_text("new")

    try:
        with pytest.raises(KeyboardInterrupt):
            write()
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == dict.fromkeys("abc", "new")
