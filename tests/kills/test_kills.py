"""Commands that are killed at random moments, meet a full disk or a twin: run again, they end as if nothing had been.

``KILLS`` says how many scenarios of each command are tried, else one, so that three commands or so meet each; ``make kills``
tries all of them several times.
"""

import os
import shutil
import signal
import subprocess
import time
from contextlib import contextmanager, nullcontext
from functools import cached_property
from importlib.util import find_spec

import numpy as np
import pytest

from tests.evaluated import evaluation_in
from tests.kills.left import assert_whole, leftovers, pieces, results, wholes
from tests.kills.running import LOOK, Looks, Running
from tests.kills.targets import SEARCH, SWEEP, TARGETS

KILLS = int(os.environ.get("KILLS", "1"))
ENDINGS = {
    "SIGKILL": (signal.SIGKILL, False, 1), "SIGTERM": (signal.SIGTERM, False, 1),
    "SIGHUP": (signal.SIGHUP, True, 1), "Ctrl-C twice": (signal.SIGINT, True, 2),
}  # fmt: skip
"""Signal, whether the whole group gets it as from a terminal, and how often."""
SCENARIOS = (*ENDINGS, "disk full", "two at once")
EACH = ("evaluate", "onnx", "fmu", "tune", "parquet", "mcap")
"""Commands that a commit disturbs, so that each scenario and each kind of result is met; the others weekly."""
BETWEEN = 0.3
"""s at most between the two of Ctrl-C twice."""
MOST = 3
"""Kills of one folder at most, one after another."""


class Course:
    """A target's undisturbed run, with which others are compared, and one with older words; ``work`` is a folder of its own."""

    def __init__(self, target, work, files):
        self.target, self.work, self.files = target, work, files
        looks, self.changes = Looks(self.folder("whole")), 0
        with self.begin(work / "whole", work, "whole-run") as running:
            while not running.ended():
                self.changes += looks.changed()
                time.sleep(LOOK)
            self.seconds = time.monotonic() - running.begun
            assert running.status() == 0, running.stderr()
        self.whole = results(work / "whole")
        assert self.whole

    def folder(self, label):
        (self.work / label).mkdir(parents=True)
        return self.work / label

    def begin(self, folder, place, label="run", older=False):
        line = self.target.line.format(**self.files).split()
        if older and self.target.older.startswith("{"):
            line = [line[0], self.target.older.format(**self.files)]
        elif older:
            line += self.target.older.split()
        return Running([*line, "--out", str(folder / self.target.file)], place, label)

    @cached_property
    def older(self):
        """A folder of the earlier run; None of a target that has none."""
        if not self.target.older:
            return None
        folder = self.folder("older")
        with self.begin(folder, self.work, "older-run", older=True) as running:
            assert running.status() == 0, running.stderr()
        return folder

    def bytes(self):
        return sum(path.stat().st_size for path in (self.work / "whole").rglob("*") if path.is_file())


class Try:
    """One scenario in one folder, every other time with results of an earlier run in it."""

    def __init__(self, course, rng, place, folder):
        self.course, self.target, self.rng, self.place, self.folder = course, course.target, rng, place, folder
        if rng.random() < 0.5 or course.older is None:
            folder.mkdir()
        else:
            shutil.copytree(course.older, folder)
        self.before = results(folder)

    def begin(self, label="run"):
        return self.course.begin(self.folder, self.place, label)

    def ended(self, running, *allowed):
        """It is gone with all that it began, with an allowed status and at most a line."""
        status = running.status()
        running.assert_nobody_lives()
        said = running.complaints()
        assert status in allowed, said
        assert "Traceback" not in running.stderr(), running.stderr()
        assert len(said) <= 1, said
        return status

    def whole_or_refused(self, running, refusal):
        """It has ended well, or refuses what is there as a whole already, or the folder that another process has."""
        running.status()
        there = any(words in running.stderr() for words in (" already; allowed: ", "File exists"))
        taken = "in use by another process" in running.stderr()
        refused = (self.target.once and there) or (self.target.alone and refusal and taken)
        return self.ended(running, 2 if refused else 0)

    def assert_tidy(self, running):
        assert [*leftovers(self.folder), *running.remains()] == []

    def look(self):
        """Before the command is run again, all results of the earlier run lie there, or all of this one."""
        assert_whole(self.folder)
        now, whole, before = (wholes(found) for found in (results(self.folder), self.course.whole, self.before))
        if self.target.partway:
            assert not now or now.keys() == whole.keys()
        else:
            assert now in (before, whole)

    def compare(self, *ran):
        """Results are those of the undisturbed run; pieces of an earlier one stay beside them."""
        for running in ran:
            assert running.remains() == []
        assert leftovers(self.folder) == []
        assert_whole(self.folder)
        assert results(self.folder) == {**pieces(self.before), **self.course.whole}

    def again(self):
        with self.begin("again") as running:
            self.whole_or_refused(running, refusal=False)
            self.compare(running)

    def strike(self, running):
        """Wait for a random moment: a time of the run's, or a change of its folder and a little later."""
        if self.rng.random() < 0.5:
            until = running.begun + self.rng.uniform(0, self.course.seconds)
            while not running.ended() and time.monotonic() < until:
                time.sleep(LOOK)
            return
        looks, seen, count = Looks(self.folder), 0, self.rng.integers(1, max(2, self.course.changes + 1))
        while not running.ended() and seen < count:
            seen += looks.changed()
            time.sleep(LOOK)
        time.sleep(self.rng.choice([0.0, self.rng.uniform(0, 0.05)]))

    def killed(self, ending):
        """One to ``MOST`` times; whether any met the command at work."""
        number, group, times = ENDINGS[ending]
        count = 0
        for _ in range(self.rng.integers(1, MOST + 1)):
            with self.begin() as running:
                self.strike(running)
                if running.ended():
                    break
                count += 1
                for k in range(times):
                    time.sleep(self.rng.uniform(0, BETWEEN) if k else 0.0)
                    running.signal(number, group)
                status = self.ended(running, -number, 128 + number, 0)
                # What is killed, or hears a second Ctrl-C, cannot tidy up: hidden files are the next run's to remove.
                if status == 128 + number and times == 1:
                    self.assert_tidy(running)
            self.look()
        self.again()
        return count > 0

    def full_disk(self, resize):
        """A random number of bytes fits on the disk; whether that was too little."""
        taken = sum(4096 * (path.stat().st_size // 4096 + 2) for path in self.folder.rglob("*"))
        resize(int(taken + 8192 + self.rng.random() * self.course.bytes()))
        with self.begin() as running:
            full = running.status() != 0
            if full:
                self.ended(running, 2)
                assert "No space left" in running.stderr()
                self.assert_tidy(running)
                self.look()
        resize(ROOM)
        self.again()
        return full

    def two(self):
        """Two of the same command a random time apart; whether they met."""
        with self.begin("first") as first:
            time.sleep(self.rng.choice([0.0, self.rng.uniform(0, self.course.seconds)]))
            met = not first.ended()
            with self.begin("second") as second:
                statuses = first.status(), second.status()
                for running in (first, second):
                    self.whole_or_refused(running, refusal=0 in statuses)
                self.compare(first, second)
        return met


ROOM = 1 << 28
"""Bytes of a disk that is not full."""


@contextmanager
def small_disk(place):
    """A disk of its own in memory, and what sets its size in bytes; it needs root."""
    place.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={ROOM}", "tmpfs", place], check=True)
    try:
        yield lambda size: subprocess.run(["mount", "-o", f"remount,size={size}", place], check=True)
    finally:
        subprocess.run(["umount", "--lazy", place], check=True)


def attempt(course, scenario, rng, place):
    """Whether the scenario met the command at work."""
    with small_disk(place / "disk") if scenario == "disk full" else nullcontext() as resize:
        one = Try(course, rng, place, place / "disk" / "out" if resize else place / "out")
        if scenario in ENDINGS:
            return one.killed(scenario)
        return one.full_disk(resize) if resize else one.two()


@pytest.mark.slow
@pytest.mark.parametrize("name", [pytest.param(name, marks=() if name in EACH else pytest.mark.weekly) for name in TARGETS])
def test_a_command_that_is_disturbed_ends_as_one_that_was_not(name, small, tmp_path):
    if missing := [module for module in TARGETS[name].needs if find_spec(module) is None]:
        pytest.skip(f"{' and '.join(missing)} is not installed")
    texts = {"sweep": SWEEP.format(seed=0), "older": SWEEP.format(seed=7), "search": SEARCH}
    for file, text in texts.items():
        (tmp_path / f"{file}.toml").write_text(text)
    files = {"small": small, **{file: tmp_path / f"{file}.toml" for file in texts}}
    if "{evaluation}" in TARGETS[name].line:
        files["evaluation"] = evaluation_in(tmp_path / "evaluated")
    course, rng = Course(TARGETS[name], tmp_path, files), np.random.default_rng([KILLS, list(TARGETS).index(name)])
    scenarios = [one for one in SCENARIOS if one != "disk full" or os.geteuid() == 0]
    first, met = list(TARGETS).index(name) % len(scenarios), 0
    for k in range(KILLS):
        met += attempt(course, scenarios[(first + k) % len(scenarios)], rng, course.folder(f"try {k}"))
    assert met > 0 or KILLS < 4, "none met the command at work"


def test_what_is_torn_left_or_different_is_seen(tmp_path):
    files = {"whole.json": "{}", "trials.journal": '{"a": 1}\n{"a"', ".birthsim/0-1/whole.json": "{"}
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    assert_whole(tmp_path)
    assert leftovers(tmp_path) == [".birthsim/0-1/whole.json"]
    before = results(tmp_path)
    (tmp_path / "whole.json").write_text('{"seconds": 1}')
    assert results(tmp_path) == before
    (tmp_path / "whole.json").write_text('{"cost": 1}')
    assert results(tmp_path) != before
    for name, text in {"a.json": '{"a": 1', "a.md": "| a |", "a.png": "PNG", "a.svg": "<svg><g>"}.items():
        (tmp_path / name).write_text(text)
        with pytest.raises((ValueError, AssertionError, OSError, SyntaxError)):
            assert_whole(tmp_path)
        (tmp_path / name).unlink()
