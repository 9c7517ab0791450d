"""Signals that ask a process to end, and work that they do not tear."""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

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


@contextmanager
def one_signal_later(words: str, then: Callable[[], object] = lambda: None) -> Iterator[list[int]]:
    """The first signal that asks the process to end comes after what happens here, which the list that is yielded tells of it.

    It prints ``words`` and calls ``then``; a second signal comes at once, instead of the first. Who empties the list swallows
    the signal. Those that the process ignores stay ignored. Outside the main thread, where no signal comes, it does nothing.
    """
    came: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield came
        return
    handlers = {ending: signal.getsignal(ending) for ending in ENDINGS}
    before = {ending: handler for ending, handler in handlers.items() if handler not in (None, signal.SIG_IGN)}

    def restored() -> None:
        for ending, handler in before.items():
            signal.signal(ending, handler)

    def answer(number: int, _: object) -> None:
        if came:
            came.clear()
            restored()
            signal.raise_signal(number)
            return
        came.append(number)
        then()
        with suppress(OSError):  # the terminal may be what is gone; ``print`` may not run within itself
            os.write(1, f"\n{words}\n".encode() * bool(words))

    for ending in before:
        signal.signal(ending, answer)
    try:
        yield came
    finally:
        restored()
        for one in came:
            signal.raise_signal(one)
