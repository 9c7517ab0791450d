"""One try: a command is killed at random moments, meets a full disk or another process, and is then run again to its end."""

import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path

import numpy as np

from lab.studies.kills import checks
from lab.studies.kills.processes import LOOK, HangError, Running
from lab.studies.kills.targets import Target

ENDINGS: dict[str, tuple[signal.Signals, bool, int]] = {
    "SIGKILL": (signal.SIGKILL, False, 1),
    "SIGTERM": (signal.SIGTERM, False, 1),
    "SIGHUP": (signal.SIGHUP, True, 1),
    "Ctrl-C twice": (signal.SIGINT, True, 2),
}
"""Scenario -> signal, whether the whole group gets it as from a terminal, and how often."""

ROOM = 1 << 28
"""Bytes of a disk that is not full."""

DISK, TWO = "disk full", "two at once"
SCENARIOS = {**dict.fromkeys(ENDINGS, 2), DISK: 1, TWO: 1}
"""Scenario -> how often it comes, beside the others."""

BETWEEN = 0.3
"""s at most between the two of Ctrl-C twice."""

MOST = 5
"""Kills of a try at most, one after another in one folder, before the command may run to its end."""

ATTEMPTS = 20
"""Tries that may miss, since the command had ended or the disk had room, for each that hits."""

Results = dict[str, str]


@dataclass
class Outcome:
    """What a try has shown: ``count`` kills and what came of them, full disks or pairs of processes.

    A try that went as it should has ``equal`` and nothing in the lists.
    """

    target: str
    scenario: str
    moment: str
    count: int = 1
    statuses: list[int] = field(default_factory=list)
    seconds: float = 0.0
    equal: bool = False
    mixed: bool = False
    broken: list[str] = field(default_factory=list)
    leftovers: list[str] = field(default_factory=list)
    tracebacks: int = 0
    talk: list[str] = field(default_factory=list)
    alive: bool = False
    trouble: list[str] = field(default_factory=list)

    def hear(self, running: Running, allowed: tuple[int, ...]) -> None:
        """Wait until all that a command has begun is gone, and take note of its status and of what it has said."""
        took = running.alone_after()
        self.alive |= took is None
        self.seconds = max(self.seconds, took or 0.0)
        lines = checks.said(running.stderr())
        self.tracebacks += "Traceback" in running.stderr() + running.stdout()
        self.talk += lines[:40] if len(lines) > 1 else []
        if running.process.returncode not in allowed:
            self.trouble.append(f"status {running.process.returncode}, {lines[-2:]}; allowed: {allowed}")


class Course:
    """A target's undisturbed run, and tries that are compared with it; ``work`` is a folder of its own."""

    def __init__(self, target: Target, work: Path, rng: np.random.Generator) -> None:
        self.target, self.work, self._rng = target, work, rng
        self._older = self._undisturbed("older", older=True) if target.older else None
        whole = self._undisturbed("whole")
        self.results = checks.results(target, whole)
        self._bytes = sum(path.stat().st_size for path in checks.files_in(whole))
        (work / "watched").mkdir()
        looks, self._changes = _Looks(work / "watched"), 0
        running = self._begin(work / "watched", work, "watched")
        while not running.ended():
            self._changes += looks.changed()
            time.sleep(LOOK)
        self._durations = [time.monotonic() - running.begun]
        if checks.results(target, work / "watched") != self.results:
            raise RuntimeError(f"{target.name}: two undisturbed runs differ")

    def attempt(self, scenario: str) -> Outcome:
        """A try that hits; ``RuntimeError`` where none does."""
        kinds = {DISK: self._full_disk, TWO: self._two}
        for _ in range(ATTEMPTS):
            place = Path(tempfile.mkdtemp(prefix="try-", dir=self.work))
            try:
                if (outcome := kinds.get(scenario, self._killed)(scenario, place)) is not None:
                    return outcome
            finally:
                shutil.rmtree(place, ignore_errors=True)
        raise RuntimeError(f"{self.target.name}, {scenario}: none of {ATTEMPTS} tries met the command at work")

    def _killed(self, scenario: str, place: Path) -> Outcome | None:
        folder, before = self._start(place / "out")
        outcome = Outcome(self.target.name, scenario, "", count=0)
        for _ in range(int(self._rng.integers(1, MOST + 1))):
            running = self._begin(folder, place)
            moment = self._strike(running, folder)
            if running.ended():
                break
            self._kill(scenario, running, outcome, folder)
            outcome.moment += f"{', ' if outcome.count else ''}{moment}"
            outcome.count += 1
            self._look(outcome, folder, before)
        return self._again(outcome, folder, before, place) if outcome.count else None

    def _kill(self, scenario: str, running: Running, outcome: Outcome, folder: Path) -> None:
        number, group, times = ENDINGS[scenario]
        for k in range(times):
            time.sleep(self._rng.uniform(0, BETWEEN) if k else 0.0)
            running.signal(number, group)
        self._end(outcome, running, (-number, 128 + number, 0))
        # What is killed, or hears a second Ctrl-C, cannot tidy up: hidden files are the next run's to remove.
        if outcome.statuses[-1:] == [128 + number] and times == 1:
            outcome.leftovers += [*checks.leftovers(folder), *checks.remains(running)]

    def _full_disk(self, scenario: str, place: Path) -> Outcome | None:
        with small_disk(place / "disk") as (disk, resize):
            folder, before = self._start(disk / "out")
            taken = sum(4096 * (path.stat().st_size // 4096 + 2) for path in disk.rglob("*"))
            room = int(taken + 4096 + self._rng.uniform(0, 1) * self._bytes)
            resize(room)
            running = self._begin(folder, place)
            if running.wait() == 0:
                return None
            outcome = Outcome(self.target.name, scenario, f"{room - taken} bytes")
            self._end(outcome, running, (2,))
            lines = checks.said(running.stderr())
            if not any("No space left" in line for line in lines):
                outcome.trouble.append(f"a full disk is not named: {lines[-3:]}")
            outcome.leftovers += [*checks.leftovers(folder), *checks.remains(running)]
            self._look(outcome, folder, before)
            resize(ROOM)
            return self._again(outcome, folder, before, place)

    def _two(self, scenario: str, place: Path) -> Outcome | None:
        folder, before = self._start(place / "out")
        first = self._begin(folder, place, "first")
        lag = float(self._rng.choice([0.0, self._rng.uniform(0, self._duration())]))
        time.sleep(lag)
        if first.ended():
            return None
        second = self._begin(folder, place, "second")
        outcome = Outcome(self.target.name, scenario, f"{lag:.2f} s apart")
        statuses = first.wait() + second.wait()
        for running in (first, second):
            refusal = 2 if self.target.alone and statuses == 2 else 0
            in_use = "in use by another process" in running.stderr()
            self._end(outcome, running, (refusal if in_use else self._status(running),))
            outcome.leftovers += checks.remains(running)
        return self._compare(outcome, folder, before)

    def _end(self, outcome: Outcome, running: Running, allowed: tuple[int, ...]) -> None:
        """Wait until a command and all that it has begun are gone, and hear what it has said."""
        try:
            outcome.statuses.append(running.wait())
        except HangError as error:
            outcome.trouble.append(str(error))
        outcome.hear(running, allowed)

    def _again(self, outcome: Outcome, folder: Path, before: Results, place: Path) -> Outcome:
        """The same command once more, undisturbed, and what has come of it."""
        running = self._begin(folder, place, "again")
        running.wait()
        self._end(outcome, running, (self._status(running),))
        self._durations.append(time.monotonic() - running.begun)
        outcome.leftovers += checks.remains(running)
        return self._compare(outcome, folder, before)

    def _status(self, running: Running) -> int:
        """The status of a command that nothing disturbs."""
        there = any(words in running.stderr() for words in (" already; allowed: ", "File exists"))
        return 2 if self.target.once and there else 0

    def _compare(self, outcome: Outcome, folder: Path, before: Results) -> Outcome:
        """Results are those of the undisturbed run; pieces of an earlier one, with other arguments, stay beside them."""
        found, expected = checks.results(self.target, folder), {**checks.pieces(before), **self.results}
        outcome.equal = found == expected
        if not outcome.equal:
            names = sorted(name for name in {*found, *expected} if found.get(name) != expected.get(name))
            outcome.trouble.append(f"differs: {', '.join(names)}"[:300])
        outcome.broken += checks.broken(folder)
        outcome.leftovers += checks.leftovers(folder)
        return outcome

    def _look(self, outcome: Outcome, folder: Path, before: Results) -> None:
        """What lies there before the command is run again: all results of the earlier run, or all of this one."""
        outcome.broken += checks.broken(folder)
        now, whole = (checks.merged(found) for found in (checks.results(self.target, folder), self.results))
        if self.target.partway:
            outcome.mixed |= bool(now) and now.keys() != whole.keys()
        else:
            outcome.mixed |= now not in (checks.merged(before), whole)

    def _start(self, folder: Path) -> tuple[Path, Results]:
        """The folder to write to, in every other try with the results of an earlier run, and these."""
        if self._older is None or self._rng.uniform() < 0.5:
            folder.mkdir()
            return folder, {}
        shutil.copytree(self._older, folder)
        return folder, checks.results(self.target, folder)

    def _begin(self, folder: Path, place: Path, label: str = "run", older: bool = False) -> Running:
        return Running(self.target.command, self.target.line(folder, older), place, label)

    def _strike(self, running: Running, folder: Path) -> str:
        """Wait for a random moment: a time of the run's, or a change of its folder and a little later; which it was."""
        if self._rng.uniform() < 0.5:
            moment = self._rng.uniform(0, self._duration())
            while not running.ended() and time.monotonic() < running.begun + moment:
                time.sleep(LOOK)
            return f"{moment:.2f} s"
        count, looks, seen = int(self._rng.integers(1, max(2, self._changes + 1))), _Looks(folder), 0
        while not running.ended() and seen < count:
            seen += looks.changed()
            time.sleep(LOOK)
        time.sleep(self._rng.choice([0.0, self._rng.uniform(0, 0.05)]))
        return f"change {count}"

    def _duration(self) -> float:
        return float(np.median(self._durations[-9:]))

    def _undisturbed(self, label: str, older: bool = False) -> Path:
        folder = self.work / label
        folder.mkdir()
        running = self._begin(folder, self.work, f"{label}-run", older)
        if running.wait():
            raise RuntimeError(f"{self.target.name}: {running.stderr()[-500:]}")
        running.alone_after()
        return folder


class _Looks:
    """How often a folder has changed."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._seen = folder, ""
        self.changed()

    def changed(self) -> bool:
        """Whether it has since the last look."""
        seen = []
        # Unlike ``rglob`` it goes on where a folder is gone before it is read.
        for path in sorted(Path(where, name) for where, *inside in os.walk(self._folder) for name in chain(*inside)):
            try:
                status = path.lstat()
            except FileNotFoundError:
                continue
            seen.append(f"{path} {status.st_size} {status.st_ino}")
        before, self._seen = self._seen, "\n".join(seen)
        return before != self._seen


@contextmanager
def small_disk(place: Path) -> Iterator[tuple[Path, Callable[[int], None]]]:
    """A disk of its own in memory, and what sets its size in bytes; it needs root."""
    place.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={ROOM}", "tmpfs", str(place)], check=True)

    def resize(size: int) -> None:
        subprocess.run(["mount", "-o", f"remount,size={size}", str(place)], check=True)

    try:
        yield place, resize
    finally:
        subprocess.run(["umount", "--lazy", str(place)], check=True)
