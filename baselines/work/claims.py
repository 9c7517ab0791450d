"""Who computes a piece: claims by exclusive creation of a file, which other processes and hosts on a shared disk respect.

The holder touches its claims every ``HEARTBEAT``. A claim whose process has died on this host, or that nobody has touched for
``PATIENCE``, is void. Two holders of one piece would only compute it twice: results are deterministic and written whole.
"""

from __future__ import annotations

import contextlib
import os
import threading
import time
from pathlib import Path
from types import TracebackType

from baselines.work.files import is_alive, later_signals, this_process

HEARTBEAT, PATIENCE = 5.0, 60.0
"""s, assumed: a dozen touches, so that a slow disk voids no claim."""


class Claims:
    """The claims of this process, as a context that touches them and gives them up at its end."""

    def __init__(self) -> None:
        self._held: set[Path] = set()
        self._seen: dict[Path, tuple[int, float]] = {}
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._touch, name="claims", daemon=True)

    def __enter__(self) -> Claims:
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None) -> None:
        self._over.set()
        self._thread.join()
        for path in list(self._held):
            self.give_up(path)

    def take(self, path: Path) -> bool:
        """Claim what will be written to ``path``; False where another process has."""
        claim = _claim(path)
        claim.parent.mkdir(parents=True, exist_ok=True)
        self.tidy(path)
        try:
            with later_signals(), claim.open("x", encoding="ascii") as file:
                self._held.add(path)
                file.write("{} {}".format(*this_process()))
        except FileExistsError:
            return False
        return True

    def give_up(self, path: Path) -> None:
        """End a claim of this process."""
        with later_signals():
            self._held.discard(path)
            _claim(path).unlink(missing_ok=True)

    def tidy(self, path: Path) -> None:
        """Remove a void claim of another process, if there is one."""
        claim = _claim(path)
        with contextlib.suppress(FileNotFoundError):
            touched, (host, _, process) = claim.stat().st_mtime_ns, claim.read_text(encoding="ascii").partition(" ")
            # Clocks of hosts differ: what counts is how long this process has seen no change.
            before, since = self._seen.setdefault(claim, (touched, time.monotonic()))
            if before != touched:
                self._seen[claim] = touched, time.monotonic()
            elif (process.isdecimal() and not is_alive(host, int(process))) or time.monotonic() - since > PATIENCE:
                self._seen.pop(claim)
                claim.unlink()

    def _touch(self) -> None:
        while not self._over.wait(HEARTBEAT):
            for path in list(self._held):
                with contextlib.suppress(OSError):
                    os.utime(_claim(path))


def _claim(path: Path) -> Path:
    return path.with_suffix(".claim")
