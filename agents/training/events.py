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
"""What TensorBoard calls its files."""


class Events:
    """Events of the training in ``folder``, whose files have had the ``sizes`` of its checkpoint; {} where it has none."""

    def __init__(self, folder: Path, sizes: Mapping[str, Any]) -> None:
        self._run = folder / EVENTS / RUN
        for path in self._run.glob(FILES):
            size = sizes.get(path.name)
            if type(size) is not int or size <= 0:
                path.unlink()
            elif path.stat().st_size > size:
                os.truncate(path, size)
        self.writer = SummaryWriter(str(self._run))

    def add(self, values: Mapping[str, float], steps: int) -> None:
        """Write a point of each name, after this many steps."""
        for name, value in values.items():
            self.writer.add_scalar(name, value, steps)

    def sizes(self) -> dict[str, int]:
        """Name of each file -> its size in bytes, with all that was added so far."""
        self.writer.flush()
        return {path.name: path.stat().st_size for path in self._run.glob(FILES)}

    def close(self) -> None:
        """Write what is left."""
        self.writer.close()


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
