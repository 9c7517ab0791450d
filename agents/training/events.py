"""TensorBoard's events of a training: they go on where its checkpoint was written, as if nothing had come after it.

A checkpoint has the size that each of their files had (``Events.sizes``); what was written later is cut off. So a point is
there once, for every program that reads such files. What goes wrong with them is said once, and names their folder.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from torch.utils.tensorboard import SummaryWriter

EVENTS = "tensorboard"
"""Their folder, in that of the training."""

RUN = "run"
"""The only run in it."""

FILES = "events.out.tfevents.*"
"""What TensorBoard calls a file: the second at which it was begun follows. Files are read in the order of their names."""


class Events:
    """Events of the training in ``folder``, whose files have had the ``sizes`` of its checkpoint; {} where it has none."""

    def __init__(self, folder: Path, sizes: Mapping[str, Any]) -> None:
        self._run = folder / EVENTS / RUN
        kept = 0
        for path in self._files():
            size = sizes.get(_begun(path))
            if type(size) is not int or size <= 0:
                path.unlink()
                continue
            if path.stat().st_size > size:
                os.truncate(path, size)
            # Another begins now, maybe in the same second, or by a clock that was set back: a number goes before its name.
            path.rename(path.with_name(f"{kept:04d}.{_begun(path)}"))
            kept += 1
        self.writer = SummaryWriter(str(self._run))

    def add(self, values: Mapping[str, float], steps: int) -> None:
        """Write a point of each name, after this many steps."""
        for name, value in values.items():
            self.writer.add_scalar(name, value, steps)

    def sizes(self) -> dict[str, int]:
        """What each file was called when it was begun -> its size in bytes, with all that was added so far."""
        self.writer.flush()
        return {_begun(path): path.stat().st_size for path in self._files()}

    def _files(self) -> list[Path]:
        """In the order in which they were written."""
        return sorted(self._run.glob(f"*{FILES}"))

    def close(self) -> None:
        """Write what is left."""
        self.writer.close()


def _begun(path: Path) -> str:
    """What a file was called before a number went before it: a checkpoint knows it by that name, whenever the number came."""
    return FILES[:-1] + path.name.partition(FILES[:-1])[2]


@contextmanager
def events_in(folder: Path) -> Iterator[None]:
    """While events are written to a folder: an ``OSError`` that names no file, as that of a full disk, names the folder.

    TensorBoard writes in a thread, hands what it raises to whoever writes next, and would print it with a traceback besides.
    """
    before = threading.excepthook

    def noted(raised: threading.ExceptHookArgs) -> None:
        if not (isinstance(raised.exc_value, OSError) and type(raised.thread).__module__.startswith("tensorboard.")):
            before(raised)

    threading.excepthook = noted
    try:
        yield
    except OSError as error:
        error.filename = error.filename or str(folder)
        raise
    finally:
        threading.excepthook = before
