"""Work in several processes at once: on this machine by joblib's processes, on several by Ray."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager
from multiprocessing import resource_tracker as pythons_tracker
from typing import Any, Protocol, TypeVar

from joblib.externals.loky.backend import resource_tracker as joblibs_tracker
from joblib.externals.loky.process_executor import BrokenProcessPool, ProcessPoolExecutor
from tqdm import tqdm

T = TypeVar("T")

ONE_THREAD = {
    f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "BLIS", "VECLIB_MAXIMUM", "NUMBA", "NUMEXPR")
}
"""Environment variables of a process that works beside others."""

LISTENING = 0.5
"""s between two looks at what is complete: a signal waits no longer."""


_PARENTS = (signal.SIGINT, signal.SIGHUP)
"""Signals that reach a whole process group, and that the parent answers for its workers."""

_END: tuple[Any, ...] = ("no more pieces",)


class Pool(Protocol):
    """Where pieces of work run: ``width`` at once. ``submit`` begins one, ``done`` returns those that are complete after
    ``LISTENING`` at most, ``result`` gives what one returned or raises what it raised, ``close`` ends all at once."""

    width: int

    def submit(self, work: Callable[..., Any], piece: tuple[Any, ...]) -> Any: ...
    def done(self, begun: list[Any]) -> list[Any]: ...
    def result(self, begun: Any) -> Any: ...
    def close(self) -> None: ...


def side_by_side(
    work: Callable[..., T], pieces: Iterable[tuple[Any, ...] | None], jobs: int, take: Callable[[int, T], None],
    cluster: str | None = None,
) -> None:  # fmt: skip
    """Call ``take(k, work(*piece))`` for every piece, the k-th drawn from ``pieces``, in the order in which they end.

    ``jobs`` processes work side by side, each with one thread; with one job, this process works itself. With a ``cluster``,
    "ray" or "ray:ADDRESS", Ray's workers do, as many as have a processor. A piece is drawn when there is room for it; None says
    that there is none at present, and another is drawn later. What is raised, by a piece, by ``take`` or by Ctrl-C, ends all
    processes at once and is raised here; ``OSError`` where a process dies.
    """
    pool = _pool(jobs, cluster)
    source, drawn, more = iter(pieces), 0, True
    begun: dict[Any, int] = {}
    try:
        while more or begun:
            nothing_now = False
            while more and len(begun) < pool.width and not nothing_now:
                piece = next(source, _END)
                more, nothing_now = piece is not _END, piece is None
                if more and piece is not None:
                    begun[pool.submit(work, piece)] = drawn
                    drawn += 1
            if not begun and more:
                time.sleep(LISTENING)
            for one in pool.done(list(begun)) if begun else ():
                take(begun.pop(one), pool.result(one))
    except BrokenProcessPool as error:
        raise OSError("a process that computed has died, of lack of memory perhaps; what is complete is kept") from error
    finally:
        pool.close()


def _pool(jobs: int, cluster: str | None) -> Pool:
    if cluster is not None:
        from baselines.work.cluster import RayPool

        return RayPool(cluster)
    return ThisProcess() if jobs <= 1 else Processes(jobs)


class ThisProcess:
    """Each piece is computed where it is submitted."""

    width = 1

    def submit(self, work: Callable[..., Any], piece: tuple[Any, ...]) -> Any:
        future: Future[Any] = Future()
        future.set_result(work(*piece))
        return future

    def done(self, begun: list[Any]) -> list[Any]:
        return begun

    def result(self, begun: Any) -> Any:
        return begun.result()

    def close(self) -> None:
        pass


class Processes:
    """joblib's processes."""

    def __init__(self, jobs: int) -> None:
        self.width = jobs
        _begin_trackers()
        with _masked():
            self._executor = ProcessPoolExecutor(jobs, env=ONE_THREAD, initializer=_begin_worker, initargs=(os.getpid(),))
        self._begun: list[Any] = []

    def submit(self, work: Callable[..., Any], piece: tuple[Any, ...]) -> Any:
        with _masked():
            self._begun.append(self._executor.submit(work, *piece))
        return self._begun[-1]

    def done(self, begun: list[Any]) -> list[Any]:
        return list(wait(begun, LISTENING, FIRST_COMPLETED).done)

    def result(self, begun: Any) -> Any:
        self._begun.remove(begun)
        return begun.result()

    def close(self) -> None:
        # joblib's thread looks up what has been submitted, and a shutdown takes that away: first it must have looked.
        while any(not one.running() and not one.done() for one in self._begun):
            time.sleep(0.01)
        self._executor.shutdown(wait=True, kill_workers=bool(self._begun))


def _begin_trackers() -> None:
    """Begin joblib's and Python's tracker of semaphores, before any worker: beginning Python's takes the mask away.

    They remove what a killed parent has left, and say nothing of it.
    """
    before = os.environ.get("PYTHONWARNINGS")
    os.environ["PYTHONWARNINGS"] = "ignore"
    try:
        for tracker in (joblibs_tracker, pythons_tracker):
            with _masked():
                tracker.ensure_running()
    finally:
        if before is None:
            del os.environ["PYTHONWARNINGS"]
        else:
            os.environ["PYTHONWARNINGS"] = before


@contextmanager
def _masked() -> Iterator[None]:
    """Processes that begin here begin without hearing ``_PARENTS``.

    A worker imports for seconds, in which Ctrl-C would make it complain; joblib's tracker of semaphores would die of SIGHUP.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _PARENTS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin_worker(parent: int) -> None:
    """Ctrl-C reaches the whole process group: the parent ends its workers, and a worker ends itself once the parent is gone."""
    for ending in _PARENTS:
        signal.signal(ending, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    tqdm.set_lock(threading.RLock())  # instead of a semaphore of the system's

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(LISTENING)
        os._exit(1)

    threading.Thread(target=watch, name="parent watch", daemon=True).start()
