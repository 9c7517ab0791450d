"""Signals that ask a process to end, and work that they do not tear."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

ENDINGS = [signal.Signals[name] for name in ("SIGINT", "SIGTERM", "SIGHUP") if name in signal.Signals.__members__]
"""Signals that ask a process to end; Windows has two of them."""


@contextmanager
def later_signals() -> Iterator[None]:
    """What happens here is not torn by a signal that asks the process to end: that comes after it."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    before = {ending: signal.signal(ending, lambda number, _: came.append(number)) for ending in ENDINGS}
    try:
        yield
    finally:
        for ending, handler in before.items():
            signal.signal(ending, handler)
        for one in came:
            signal.raise_signal(one)
