"""Commands in sessions of their own: begun, watched, ended by signals, and who of a session still lives."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

from tests.console import PATIENCE, ROOT, words

GONE = 30.0
"""s, assumed: a session that still lives so long after its leader has left processes behind."""

LOOK = 0.002
"""s between two looks at a folder or a session."""

_BAR = re.compile(r"\d+%\||\[\d\d:\d\d[<,]|BirthSIM: compiling")
"""Progress bars, and the word while kernels compile."""

_KEPT = re.compile(r"\.ses|torchinductor_")
"""What onnxruntime and PyTorch keep among temporary files, under names that stay the same."""


class Running:
    """A command in a session of its own; what it says goes to files in ``work``, as do its temporary files."""

    def __init__(self, line, work, label="run"):
        command, *rest = line
        self._said = work / f"{label}.stdout", work / f"{label}.stderr"
        self.temporary = work / f"{label}.tmp"
        self.temporary.mkdir(exist_ok=True)
        environment = {**os.environ, "TMPDIR": str(self.temporary)}
        with self._said[0].open("wb") as out, self._said[1].open("wb") as complaints:
            self.process = subprocess.Popen(
                [sys.executable, "-m", *words(command), *rest],
                **{"cwd": ROOT, "env": environment, "start_new_session": True},
                **{"stdin": subprocess.DEVNULL, "stdout": out, "stderr": complaints},
            )
        self.begun = time.monotonic()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.sweep()

    def ended(self):
        return self.process.poll() is not None

    def signal(self, number, group):
        """To the command, or to its whole group as a terminal does."""
        if not self.ended():
            (os.killpg if group else os.kill)(self.process.pid, number)

    def status(self):
        """Of the command once it has ended."""
        return self.process.wait(PATIENCE)

    def sweep(self):
        """Kill what is left of the session."""
        for process in [*([] if self.ended() else [self.process.pid]), *members(self.process.pid)]:
            try:
                os.kill(process, signal.SIGKILL)
            except ProcessLookupError:
                continue
        self.process.wait()

    def assert_nobody_lives(self):
        begun = time.monotonic()
        while members(self.process.pid) and time.monotonic() < begun + GONE:
            time.sleep(LOOK)
        assert members(self.process.pid) == []

    def stderr(self):
        return self._said[1].read_text(encoding="utf-8", errors="replace")

    def complaints(self):
        """The lines that it has complained in."""
        lines = [line.strip() for line in re.split(r"[\r\n]+", self.stderr())]
        return [line for line in lines if line and not _BAR.search(line)]

    def remains(self):
        """Temporary files and semaphores that the processes of the ended session have left."""
        files = (str(path.relative_to(self.temporary)) for path in self.temporary.rglob("*"))
        semaphores = (path.name for path in Path("/dev/shm").glob(f"sem.loky-{self.process.pid}-*"))
        return [*(name for name in files if not _KEPT.match(name)), *semaphores]


def members(session):
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


class Looks:
    """How often a folder has changed."""

    def __init__(self, folder):
        self._folder, self._seen = folder, None
        self.changed()

    def changed(self):
        """Whether it has since the last look."""
        seen = []
        # Unlike ``rglob`` it goes on where a folder is gone before it is read.
        for where, folders, files in os.walk(self._folder):
            for name in (*folders, *files):
                try:
                    status = os.lstat(os.path.join(where, name))
                except FileNotFoundError:
                    continue
                seen.append((where, name, status.st_size, status.st_ino))
        before, self._seen = self._seen, sorted(seen)
        return before != self._seen
