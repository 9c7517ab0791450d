"""Work in several processes at once."""

from __future__ import annotations

import signal
import threading
import warnings
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from joblib import Parallel, delayed
from joblib.externals.loky.process_executor import BrokenProcessPool
from tqdm import tqdm

T = TypeVar("T")


def side_by_side(
    work: Callable[..., T], pieces: Sequence[tuple[Any, ...]], jobs: int, take: Callable[[int, T], None]
) -> None:  # fmt: skip
    """Call ``take(k, work(*pieces[k]))`` for every piece, in the order in which they end.

    ``jobs`` processes work side by side, each with one thread; with one job, this process works itself. What is raised, by a
    piece, by ``take`` or by Ctrl-C, ends all processes at once and is raised here; ``OSError`` where a process dies.
    """
    if min(jobs, len(pieces)) <= 1:
        for k, piece in enumerate(pieces):
            take(k, work(*piece))
        return
    pool = Parallel(
        min(jobs, len(pieces)), "loky", return_as="generator_unordered", pre_dispatch="all", batch_size=1, max_nbytes=None,
        inner_max_num_threads=1, initializer=_begin_worker,
    )  # fmt: skip
    results = pool(delayed(_numbered)(k, work, piece) for k, piece in enumerate(pieces))
    try:
        for k, result in results:
            take(k, result)
    except BrokenProcessPool as error:
        raise OSError("a process that computed has died, of lack of memory perhaps; what is complete is kept") from error
    finally:
        # joblib warns of what it ends.
        with warnings.catch_warnings(action="ignore", category=UserWarning):
            results.close()


def _numbered(number: int, work: Callable[..., T], piece: tuple[Any, ...]) -> tuple[int, T]:
    return number, work(*piece)


def _begin_worker() -> None:
    """Ctrl-C reaches the whole process group: the parent ends its workers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    tqdm.set_lock(threading.RLock())  # instead of a semaphore of the system's
