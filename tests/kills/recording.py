"""The target that does not end by itself: a recording of ``birthsim live`` that a program makes as the page does."""

from __future__ import annotations

import json
import shutil
import signal
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from websockets.sync.client import ClientConnection, connect

from birthsim_live.rig.recording import load_recording
from tests.kills import checks
from tests.kills.processes import LOOK, PATIENCE, Hangs, Running
from tests.kills.tries import BETWEEN, DISK, ENDINGS, TWO, Outcome, small_disk

RECORD = "record"

LONGEST = 4.0
"""s that a recording lasts at most before it is disturbed."""

LOST = 1.5
"""s of wall time that a kill may cost: a chunk's, and what a busy machine is late by."""

CHUNK = 16_000
"""Bytes of half a second, about: a disk is full after some of them."""


class RecordingCourse:
    """An undisturbed recording, and disturbed ones, each of which must be its beginning; ``work`` is a folder of its own."""

    def __init__(self, work: Path, rng: np.random.Generator) -> None:
        self._work, self._rng = work, rng
        outcome = Outcome(RECORD, "undisturbed", "")
        self._whole = np.empty((0, 0))
        rows = self._record(outcome, work, work / "whole", 2 * LONGEST)
        if rows is None or outcome.trouble:
            raise RuntimeError(f"{RECORD}: {outcome.trouble}")
        self._whole = rows

    def attempt(self, scenario: str) -> Outcome:
        """One try."""
        place = Path(tempfile.mkdtemp(prefix="try-", dir=self._work))
        try:
            kind: Callable[[str, Path], Outcome] = {DISK: self._full_disk, TWO: self._two}.get(scenario, self._killed)
            return kind(scenario, place)
        finally:
            shutil.rmtree(place, ignore_errors=True)

    def _killed(self, scenario: str, place: Path) -> Outcome:
        number, group, times = ENDINGS[scenario]
        moment, folder = float(self._rng.uniform(0, LONGEST)), place / "out"
        outcome = Outcome(RECORD, scenario, f"{moment:.2f} s")
        live = _Live(folder, place)
        seen = live.record(moment)
        for k in range(times):
            time.sleep(self._rng.uniform(0, BETWEEN) if k else 0.0)
            live.running.signal(number, group)
        self._end(outcome, live, (-number, 128 + number, 0))
        self._judge(outcome, folder, seen - LOST)
        self._record(outcome, place, folder, 0.2)
        outcome.leftovers += checks.leftovers(folder)
        return outcome

    def _full_disk(self, scenario: str, place: Path) -> Outcome:
        with small_disk(place / "disk") as (disk, resize):
            room = 8192 + int(self._rng.uniform(0, 6 * CHUNK))
            resize(room)
            outcome = Outcome(RECORD, scenario, f"{room} bytes")
            live = _Live(disk / "out", place)
            live.begin()
            said = live.until(lambda message: message["type"] == "error")["message"]
            if "No space left" not in said:
                outcome.trouble.append(f"a full disk is not named: {said}")
            live.running.signal(signal.SIGINT, True)
            self._end(outcome, live, (0,))
            outcome.leftovers += checks.leftovers(disk)
            if files := list((disk / "out").glob("*")):
                self._judge(outcome, disk / "out", 0.0)
            outcome.equal |= not files
            resize(1 << 28)
            self._record(outcome, place, disk / "out", 0.2)
            outcome.leftovers += checks.leftovers(disk)
            return outcome

    def _two(self, scenario: str, place: Path) -> Outcome:
        outcome = Outcome(RECORD, scenario, "together")
        both = [_Live(place / "out", place, label) for label in ("first", "second")]
        for live in both:
            live.begin()
        time.sleep(self._rng.uniform(0, LONGEST / 2))
        for live in both:
            live.running.signal(signal.SIGINT, True)
            self._end(outcome, live, (0,))
        self._judge(outcome, place / "out", 0.0, files=2)
        outcome.leftovers += checks.leftovers(place / "out")
        return outcome

    def _record(self, outcome: Outcome, place: Path, folder: Path, seconds: float) -> Any:
        """A recording that is ended as on the page, in the same folder; its rows."""
        before = set(folder.glob("*"))
        live = _Live(folder, place, "again")
        live.record(seconds)
        live.say("record", on=False)
        live.until(lambda message: message["type"] == "state" and message["recording"] is None)
        live.running.signal(signal.SIGINT, True)
        self._end(outcome, live, (0,))
        for path in set(folder.glob("*")) - before:
            return load_recording(path).rows
        outcome.trouble.append("no new recording")
        return None

    def _end(self, outcome: Outcome, live: _Live, allowed: tuple[int, ...]) -> None:
        try:
            outcome.statuses.append(live.running.wait())
        except Hangs as error:
            outcome.trouble.append(str(error))
        live.socket.close()
        outcome.hear(live.running, allowed)
        if outcome.statuses[-1:] != [-signal.SIGKILL]:
            outcome.leftovers += checks.remains(live.running)

    def _judge(self, outcome: Outcome, folder: Path, least: float, files: int = 1) -> None:
        """Every file is the beginning of the undisturbed recording, at least ``least`` s of it."""
        found = [path for path in checks.files_in(folder) if not checks.is_leftover(path, folder)]
        if len(found) != files:
            outcome.trouble.append(f"{[path.name for path in found]}; allowed: {files} recordings")
        outcome.equal = len(found) == files
        for path in found:
            try:
                recording = load_recording(path)
            except ValueError as error:
                outcome.broken.append(str(error)[:200])
                outcome.equal = False
                continue
            rows = min(len(recording.rows), len(self._whole))
            same = np.array_equal(recording.rows[:rows], self._whole[:rows], equal_nan=True)
            outcome.equal &= same and recording.duration >= least
            if not same or recording.duration < least:
                outcome.trouble.append(f"{recording.duration:.2f} s recorded, of {least:.2f} s at least; same: {same}")


class _Live:
    """A server, and a program in front of it that acts as the page."""

    def __init__(self, folder: Path, place: Path, label: str = "run") -> None:
        self.running = Running("birthsim live", ["--port", "0", "--record-dir", str(folder)], place, label)
        until = time.monotonic() + PATIENCE
        while "http://" not in (said := self.running.stdout()):
            if self.running.ended() or time.monotonic() > until:
                raise RuntimeError(self.running.stderr()[-500:])
            time.sleep(LOOK)
        address = next(word for word in said.split() if word.startswith("http://"))
        self.socket: ClientConnection = connect(address.replace("http", "ws") + "/ws", open_timeout=PATIENCE)

    def say(self, kind: str, **fields: Any) -> None:
        """Send a message."""
        self.socket.send(json.dumps({"type": kind, **fields}))

    def until(self, wanted: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """The first message that is wanted."""
        while True:
            message: dict[str, Any] = json.loads(self.socket.recv(PATIENCE))
            if wanted(message):
                return message

    def begin(self) -> None:
        """Begin a recording at time zero, so that all are alike."""
        self.say("pause", paused=True)
        self.until(lambda message: message["type"] == "state" and message["paused"])
        self.say("reset")
        self.until(lambda message: message["type"] == "frame" and message["time"] == 0.0)
        self.say("record", on=True)
        self.say("pause", paused=False)

    def record(self, seconds: float) -> float:
        """Record for so long, and the s of simulated time that a window has seen since."""
        self.begin()
        self.until(lambda message: message["type"] == "state" and message["recording"] is not None)
        end, seen = time.monotonic() + seconds, 0.0
        while time.monotonic() < end:
            seen = max(seen, self.until(lambda message: message["type"] == "frame")["time"])
        return seen
