"""Takes a session down into a file that can be played whatever ends the process: ``recording`` has the format."""

from __future__ import annotations

import contextlib
import json
import os
import threading
from io import FileIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import birthsim_env
from baselines.work.files import whole_file
from birthsim_env.physics.compiled.lanes import Array
from birthsim_live.rig.frames import COLUMNS, FIELDS
from birthsim_live.rig.recording import FORMAT, WORDS, packed

if TYPE_CHECKING:
    from birthsim_live.rig.session import Session

NO_SECOND = np.full(COLUMNS, np.nan)
"""Columns of a second rig that is not there."""

EVERY = 4
"""Control periods between rows."""

LONGEST = 600.0
"""s, assumed: a recording ends by itself."""

MOST_WORDS = WORDS // 2
"""Bytes of JSON, without rows' numbers, after which a recording ends by itself: a chunk more can still be read back."""

BETWEEN = 0.5
"""s of wall time between two chunks: what a kill costs at most."""


class Recorder:
    """Takes a session down, from now on, into the file ``path``, which ``open`` makes and ``finish`` completes.

    The session's thread only takes notes; a thread of the recorder's own writes them every ``BETWEEN``.
    """

    def __init__(self, session: Session, path: Path) -> None:
        self.path = path
        self.problem: OSError | None = None
        self._rig, self._interval = session.rig, EVERY * session.period
        self._rows: list[Array] = []
        self._events: list[dict[str, Any]] = []
        self._known: dict[str, Any] = {"second_lost": None}
        self._paths, self._periods, self._count, self._length, self._words = -1, 0, 0, 0, 0
        self._notes, self._disk = threading.Lock(), threading.Lock()
        self._file: FileIO | None = None
        self._first = b""
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._write_on, name="birthsim live recorder", daemon=True)
        self.take(session)

    @property
    def seconds(self) -> float:
        """s recorded."""
        return self._count * self._interval

    @property
    def full(self) -> bool:
        """True at ``LONGEST``, at ``MOST_WORDS``, and where the disk takes no more: ``problem`` says why."""
        return self.seconds >= LONGEST or self._words >= MOST_WORDS or self.problem is not None

    def take(self, session: Session) -> None:
        """Take note of the present control period."""
        if self._periods % EVERY == 0 and not self.full:
            with self._notes:
                self._note("settings", session.shown_settings())
                if self._paths != session.paths:
                    self._paths = session.paths
                    self._note("path", session.path())
                second = session.second
                self._note("lost", session.lost)
                self._note("second_lost", None if second is None else second.lost)
                self._rows.append(np.concatenate([session.row(), NO_SECOND if second is None else second.row()]))
                self._count += 1
        self._periods += 1

    def _note(self, kind: str, value: Any) -> None:
        if kind not in self._known or self._known[kind] != value:
            self._known[kind] = value
            self._words += len(json.dumps(value))
            self._events.append({"row": self._count, kind: value})

    def open(self) -> None:
        """Make the file, with the first rows in it, and go on writing; ``OSError`` where that fails.

        ``FileExistsError`` says that the name is taken; with another ``path`` it may be tried again.
        """
        with self._disk:
            if self._file is not None:
                return
            header = {
                "format": FORMAT,
                "birthsim": birthsim_env.__version__,
                "rig": self._rig.to_dict(),
                "columns": list(FIELDS),
                "interval": self._interval,
            }
            self._first = self._first or packed(header) + self._chunk()
            with whole_file(self.path, new=True) as file:
                file.write(self._first)
            self._length = len(self._first)
            self._file = FileIO(self.path, "ab")
            self._thread.start()

    def finish(self) -> None:
        """Write what is left; ``OSError`` where the disk has not taken it all, and the file ends before that."""
        self.open()
        self._over.set()
        self._thread.join()
        with self._disk:
            if self._file is not None and not self._file.closed:
                self._file.close()
        if self.problem is not None:
            raise self.problem

    def _write_on(self) -> None:
        over = False
        while not over and self.problem is None:
            over = self._over.wait(BETWEEN)
            with self._disk:
                self._append(over)

    def _append(self, last: bool) -> None:
        assert self._file is not None
        content = self._chunk()
        try:
            if content:
                done = 0
                while done < len(content):
                    done += self._file.write(content[done:])
                self._length += len(content)
            if last:
                os.fsync(self._file.fileno())
        except OSError as error:
            self.problem = error
            with contextlib.suppress(OSError):
                self._file.truncate(self._length)
            self._file.close()

    def _chunk(self) -> bytes:
        """What was taken down since the last chunk, as one; nothing where that is no row."""
        with self._notes:
            rows, self._rows = self._rows, []
            events, self._events = self._events, []
        return packed({"events": events}, np.array(rows)) if rows else b""
