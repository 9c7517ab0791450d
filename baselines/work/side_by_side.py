"""Work in several processes at once: on this machine by joblib's, on several by Ray's."""

import os
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, closing, contextmanager
from functools import partial
from multiprocessing import resource_tracker
from typing import Any, TypeVar

from joblib import Parallel, delayed, parallel_config
from tqdm import tqdm

T = TypeVar("T")

LOOKING = 0.5
"""s between two looks of a worker at whether its parent is still there."""

_PARENTS = (signal.SIGINT, signal.SIGHUP)
"""Signals that reach a whole process group, and that the parent answers for its workers."""


def side_by_side(
    work: Callable[..., T], pieces: Sequence[tuple[Any, ...]], jobs: int, take: Callable[[int, T], None],
    cluster: str | None = None,
) -> None:  # fmt: skip
    """Call ``take(k, work(*pieces[k]))`` for every piece, in the order in which they end.

    ``jobs`` processes work side by side, each with one thread; with one job, this process works itself. With a ``cluster``,
    "ray" or "ray:ADDRESS", Ray's workers do, as many as have a processor. What is raised, by a piece, by ``take`` or by Ctrl-C,
    ends all processes at once and is raised here; ``OSError`` where a process dies.
    """
    if cluster is not None:
        from baselines.work.cluster import on_cluster

        outcomes: Iterator[tuple[int, T]] = on_cluster(_numbered, work, pieces, cluster)
    elif min(jobs, len(pieces)) <= 1:
        outcomes = (_numbered(work, k, piece) for k, piece in enumerate(pieces))
    else:
        outcomes = _in_processes(work, pieces, jobs)
    with closing(outcomes):  # type: ignore[type-var]  # all three are generators
        for number, result in outcomes:
            take(number, result)


def _numbered(work: Callable[..., T], number: int, piece: tuple[Any, ...]) -> tuple[int, T]:
    return number, work(*piece)


def _in_processes(work: Callable[..., T], pieces: Sequence[tuple[Any, ...]], jobs: int) -> Iterator[tuple[int, T]]:
    calls = (delayed(_numbered)(work, k, piece) for k, piece in enumerate(pieces))
    own = {"initializer": _begin_worker, "initargs": (os.getpid(),)}
    with ExitStack() as stack:
        # joblib says how many pieces an early end cancels.
        stack.enter_context(warnings.catch_warnings(action="ignore", category=UserWarning))
        stack.callback(setattr, threading, "excepthook", threading.excepthook)
        threading.excepthook = partial(_hear, threading.excepthook)
        stack.enter_context(parallel_config("loky", n_jobs=jobs, inner_max_num_threads=1, **own))
        with _unheard(quiet=True):
            resource_tracker.ensure_running()  # before any worker: to begin one takes the mask away
        with _unheard(quiet=True):
            parallel = stack.enter_context(Parallel(return_as="generator_unordered", batch_size=1))
        with _unheard():
            outcomes = stack.enter_context(closing(parallel(calls)))
        try:
            yield from outcomes
        except BrokenProcessPool as error:
            raise OSError("a process that computed has died, of lack of memory perhaps; what is complete is kept") from error


def _hear(before: Callable[[threading.ExceptHookArgs], object], about: threading.ExceptHookArgs) -> None:
    """joblib's manager of processes looks up pieces that it has just cancelled, which now and then ends it with a ``KeyError``;
    its processes have ended by then."""
    if not (about.exc_type is KeyError and about.thread is not None and about.thread.name == "ExecutorManagerThread"):
        before(about)


@contextmanager
def _unheard(quiet: bool = False) -> Iterator[None]:
    """Processes that begin here begin without hearing ``_PARENTS``; ``quiet`` ones do not warn of a killed parent's traces.

    A worker imports for seconds, in which Ctrl-C would make it complain; joblib's tracker of semaphores would die of SIGHUP.
    """
    mask, warned = signal.pthread_sigmask(signal.SIG_BLOCK, _PARENTS), os.environ.get("PYTHONWARNINGS")
    os.environ |= {"PYTHONWARNINGS": "ignore"} if quiet else {}
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        os.environ.pop("PYTHONWARNINGS", None)
        os.environ |= {} if warned is None else {"PYTHONWARNINGS": warned}


def _begin_worker(parent: int) -> None:
    """Ctrl-C reaches the whole process group: the parent ends its workers, and a worker ends itself once the parent is gone."""
    for ending in _PARENTS:
        signal.signal(ending, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    tqdm.set_lock(threading.RLock())  # instead of a semaphore of the system's

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(LOOKING)
        os._exit(1)

    threading.Thread(target=watch, name="parent watch", daemon=True).start()
