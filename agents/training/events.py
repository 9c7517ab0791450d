"""TensorBoard's events of a training: what goes wrong with their file is said once, and names their folder."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

EVENTS = "tensorboard"
"""Their folder, in that of the training."""


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
