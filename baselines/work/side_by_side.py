"""Work in several processes at once: on this machine by joblib's, on several by Ray's."""

import os
import signal
import socket
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, closing, contextmanager
from functools import partial
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed, parallel_config
from tqdm import tqdm

from birthsim_env.endings import ENDINGS
from birthsim_env.extras import installation

Work = Callable[..., Any]
Pieces = Sequence[tuple[Any, ...]]
Outcomes = Generator[tuple[int, Any], None, None]

_PARENTS = [ending for ending in ENDINGS if ending != signal.SIGTERM]
"""Signals that reach a whole process group, and that the parent answers for its workers."""

CONNECTING = 10.0
"""s until an address is taken for one where nobody answers, assumed."""

ONE_THREAD = {
    f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "BLIS", "VECLIB_MAXIMUM", "NUMBA", "NUMEXPR")
}
"""Environment variables of a process that works beside others."""


def side_by_side(work: Work, pieces: Pieces, jobs: int, take: Callable[[int, Any], None], cluster: str | None = None) -> None:
    """Call ``take(k, work(*pieces[k]))`` for every piece, in the order in which they end.

    ``jobs`` processes work side by side, each with one thread; with one job, this process works itself. With a ``cluster``,
    "ray" for this machine's own or "ray:ADDRESS", Ray's workers do, as many as have a processor; each host needs the same
    version of this package, and what a piece names by path, such as a controller's file. What is raised, by a piece, by
    ``take`` or by Ctrl-C, ends all processes at once and is raised here; ``OSError`` where a process dies.
    """
    if cluster is not None:
        outcomes = _on_cluster(work, pieces, cluster)
    elif min(jobs, len(pieces)) <= 1:
        outcomes = (_numbered(work, k, piece) for k, piece in enumerate(pieces))
    else:
        outcomes = _in_processes(work, pieces, jobs)
    with closing(outcomes):
        for number, result in outcomes:
            take(number, result)


def _numbered(work: Work, number: int, piece: tuple[Any, ...]) -> tuple[int, Any]:
    return number, work(*piece)


def _in_processes(work: Work, pieces: Pieces, jobs: int) -> Outcomes:
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


def _hear(before: Callable[[threading.ExceptHookArgs], object], constants: threading.ExceptHookArgs) -> None:
    """joblib's manager of processes looks up pieces that it has just cancelled, which now and then ends it with a ``KeyError``;
    its processes have ended by then."""
    if not (
        constants.exc_type is KeyError and constants.thread is not None and constants.thread.name == "ExecutorManagerThread"
    ):
        before(constants)


@contextmanager
def _unheard(quiet: bool = False) -> Iterator[None]:
    """Processes that begin here begin without hearing ``_PARENTS``; ``quiet`` ones do not warn of a killed parent's traces.

    A worker imports for seconds, in which Ctrl-C would make it complain; joblib's tracker of semaphores would die of SIGHUP.
    """
    masks, warned = getattr(signal, "pthread_sigmask", None), os.environ.get("PYTHONWARNINGS")  # Windows has no masks
    mask = masks and masks(signal.SIG_BLOCK, _PARENTS)
    os.environ |= {"PYTHONWARNINGS": "ignore"} if quiet else {}
    try:
        yield
    finally:
        if masks:
            masks(signal.SIG_SETMASK, mask)
        os.environ.pop("PYTHONWARNINGS", None)
        os.environ |= {} if warned is None else {"PYTHONWARNINGS": warned}


def _begin_worker(parent: int) -> None:
    """Ctrl-C reaches the whole process group: the parent ends its workers, and a worker ends itself once the parent is gone."""
    for ending in _PARENTS:
        signal.signal(ending, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    warnings.simplefilter("ignore", UserWarning)  # the parent has warned of the user's files, once
    tqdm.set_lock(threading.RLock())  # instead of a semaphore of the system's

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)  # s between two looks at whether the parent is still there
        os._exit(1)

    threading.Thread(target=watch, name="parent watch", daemon=True).start()


def _on_cluster(work: Work, pieces: Pieces, cluster: str) -> Outcomes:
    if any("RAY_AUTH_TOKEN" in name for name in os.environ) or (Path.home() / ".ray" / "auth_token").exists():
        # Ray's own command starts clusters with this token, and its library shows it only when told so.
        os.environ.setdefault("RAY_AUTH_MODE", "token")
    try:
        import ray
    except ImportError as error:
        raise ValueError(f"{error}; --cluster needs the extra: {installation('cluster')}") from error
    address = cluster.partition(":")[2]
    host, _, port = address.rpartition(":")
    try:
        if address:  # Ray itself would try for minutes
            socket.create_connection((host, int(port)), CONNECTING).close()
        ray.init(
            address=address or "local",
            log_to_driver=False,
            include_dashboard=None if address else False,
            runtime_env={"env_vars": ONE_THREAD},
            configure_logging=False,
        )
    except (OSError, ValueError) as error:
        said = f"--cluster {cluster!r}: no cluster answers there ({error}); allowed: ray, or ray:HOST:PORT of one"
        raise ValueError(said) from error
    try:
        remote = ray.remote(num_cpus=1)(_numbered)
        waiting = [remote.remote(work, k, piece) for k, piece in enumerate(pieces)]
        while waiting:
            ready, waiting = ray.wait(waiting, timeout=0.5)  # s, since a signal waits no longer
            yield from map(ray.get, ready)
    except ray.exceptions.RayTaskError as error:
        raise error.cause from None
    except ray.exceptions.RayError as error:
        raise OSError(f"a worker of the cluster has died ({type(error).__name__}); what is complete is kept") from error
    finally:
        ray.shutdown()  # which ends what is not ready
