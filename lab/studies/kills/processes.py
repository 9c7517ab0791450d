"""Commands in sessions of their own: begun, watched, ended by signals, and who of a session still lives."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from lab.studies.kills.targets import ROOT, program

PATIENCE = 300.0
"""s, assumed: nothing here takes so long; what does hangs."""

GONE = 30.0
"""s, assumed: a session that still lives so long after its leader has left processes behind."""

LOOK = 0.002
"""s between two looks at a folder or a session."""


class HangError(Exception):
    """A command has not ended in ``PATIENCE``."""


def hear_signals() -> None:
    """Children hear Ctrl-C and a closed terminal even where this process was begun in the background or by nohup.

    Whatever ends this process is raised, so that nothing is left running or mounted.
    """
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.default_int_handler)


class Running:
    """A command in a session of its own; what it says goes to files in ``work``, as do its temporary files."""

    def __init__(self, command: str, words: Sequence[str], work: Path, label: str = "run") -> None:
        self._said = work / f"{label}.stdout", work / f"{label}.stderr"
        self.temporary = work / f"{label}.tmp"
        self.temporary.mkdir(exist_ok=True)
        path = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path), "TMPDIR": str(self.temporary)}
        line = [sys.executable, "-c", program(command), *words]
        with self._said[0].open("wb") as out, self._said[1].open("wb") as complaints:
            self.process = subprocess.Popen(
                line, cwd=ROOT, env=environment, stdin=subprocess.DEVNULL, stdout=out, stderr=complaints, start_new_session=True
            )
        self.begun = time.monotonic()
        _begun.append(self)

    def ended(self) -> bool:
        """Whether the command itself has ended."""
        return self.process.poll() is not None

    def signal(self, number: int, group: bool) -> None:
        """Send a signal to the command, or to its whole group as a terminal does."""
        if not self.ended():
            (os.killpg if group else os.kill)(self.process.pid, number)

    def wait(self) -> int:
        """Its status, once it has ended; whatever hangs is killed and raises ``HangError``."""
        try:
            return self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self.sweep()
            raise HangError(f"no end within {PATIENCE:g} s: {self.stderr()[-300:]}") from None

    def sweep(self) -> None:
        """Kill what is left of the session."""
        for process in [self.process.pid, *members(self.process.pid)]:
            try:
                os.kill(process, signal.SIGKILL)
            except ProcessLookupError:
                continue
        self.process.wait()

    def alone_after(self) -> float | None:
        """s until nobody of the session lived any more; None where somebody still does, and is killed."""
        begun = time.monotonic()
        while members(self.process.pid):
            if time.monotonic() - begun > GONE:
                self.sweep()
                return None
            time.sleep(LOOK)
        return time.monotonic() - begun

    def stdout(self) -> str:
        """What it has printed."""
        return self._said[0].read_text(encoding="utf-8", errors="replace")

    def stderr(self) -> str:
        """What it has complained about."""
        return self._said[1].read_text(encoding="utf-8", errors="replace")


def end_all() -> None:
    """Kill what this process has begun and what still runs."""
    for running in _begun:
        if not running.ended():
            running.sweep()


_begun: list[Running] = []


def members(session: int) -> list[int]:
    """The living processes of a session; a zombie waits for somebody to ask and does nothing."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdecimal():
            try:
                state, _, _, of = (entry / "stat").read_text().rpartition(")")[2].split()[:4]
            except (FileNotFoundError, ProcessLookupError):
                continue
            if int(of) == session and state not in "ZX":
                found.append(int(entry.name))
    return found
