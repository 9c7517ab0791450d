"""Ray's workers, on this machine or on many."""

import os
import socket
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

CONNECTING = 10.0
"""s until an address is taken for one where nobody answers, assumed."""

ONE_THREAD = {
    f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "BLIS", "VECLIB_MAXIMUM", "NUMBA", "NUMEXPR")
}
"""Environment variables of a process that works beside others."""


def on_cluster(
    call: Callable[..., Any], work: Callable[..., Any], pieces: Sequence[tuple[Any, ...]], cluster: str
) -> Iterator[Any]:
    """``call(work, k, pieces[k])`` in the order in which they end; each takes a processor of the cluster.

    ``cluster`` is "ray:ADDRESS", or "ray" for this machine's own. Every host needs the same version of this package, and what
    a piece names by path, such as a controller's file.
    """
    if any("RAY_AUTH_TOKEN" in name for name in os.environ) or (Path.home() / ".ray" / "auth_token").exists():
        # Ray's own command starts clusters with this token, and its library shows it only when told so.
        os.environ.setdefault("RAY_AUTH_MODE", "token")
    try:
        import ray
    except ImportError as error:
        raise ValueError(f"{error}; --cluster needs the extra: pip install 'birthsim[cluster]'") from error
    address = cluster.partition(":")[2]
    host, _, port = address.rpartition(":")
    try:
        if address:  # Ray itself would try for minutes
            socket.create_connection((host, int(port)), CONNECTING).close()
        ray.init(
            address=address or "local", log_to_driver=False, include_dashboard=None if address else False,
            runtime_env={"env_vars": ONE_THREAD}, configure_logging=False,
        )  # fmt: skip
    except (OSError, ValueError) as error:
        said = f"--cluster {cluster!r}: no cluster answers there ({error}); allowed: ray, or ray:HOST:PORT of one"
        raise ValueError(said) from error
    remote, waiting = ray.remote(num_cpus=1)(call), list[Any]()
    try:
        waiting = [remote.remote(work, k, piece) for k, piece in enumerate(pieces)]
        while waiting:
            ready, waiting = ray.wait(waiting, timeout=0.5)  # s, since a signal waits no longer
            yield from map(ray.get, ready)
    except ray.exceptions.RayTaskError as error:
        raise error.cause from None
    except ray.exceptions.RayError as error:
        raise OSError(f"a worker of the cluster has died ({type(error).__name__}); what is complete is kept") from error
    finally:
        for one in waiting:
            ray.cancel(one, force=True)
        ray.shutdown()
