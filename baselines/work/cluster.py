"""Ray's workers, on this machine or on many, behind the face of ``side_by_side``'s pools."""

from __future__ import annotations

import contextlib
import os
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

from baselines.work.side_by_side import LISTENING, ONE_THREAD

CONNECTING = 10.0
"""s until an address is taken for one where nobody answers, assumed."""


class RayPool:
    """As many pieces at once as the cluster ``ray[:ADDRESS]`` has processors; without an address it is this machine's own.

    Every host needs the same version of this package, and what a piece names by path, such as a controller's file.
    """

    def __init__(self, cluster: str) -> None:
        if any("RAY_AUTH_TOKEN" in name for name in os.environ) or (Path.home() / ".ray" / "auth_token").exists():
            # Ray's own command starts clusters with this token, and its library shows it only when told so.
            os.environ.setdefault("RAY_AUTH_MODE", "token")
        try:
            import ray
        except ImportError as error:
            raise ValueError(f"{error}; --cluster needs the extra: pip install 'birthsim[cluster]'") from error
        self._ray: Any = ray
        address = cluster.partition(":")[2]
        if address:
            _check_that_it_answers(cluster, address)
        try:
            self._ray.init(
                address=address or "local", log_to_driver=False, include_dashboard=False if not address else None,
                runtime_env={"env_vars": ONE_THREAD}, configure_logging=False,
            )  # fmt: skip
        except ConnectionError as error:
            raise ValueError(f"--cluster {cluster!r}: no cluster answers there; allowed: ray, or the address of one") from error
        self.width = max(1, int(self._ray.cluster_resources().get("CPU", 1)))
        self._begun: set[Any] = set()

    def submit(self, work: Callable[..., Any], piece: tuple[Any, ...]) -> Any:
        begun = self._ray.remote(num_cpus=1)(_call).remote(work, piece)
        self._begun.add(begun)
        return begun

    def done(self, begun: list[Any]) -> list[Any]:
        return list(self._ray.wait(begun, num_returns=1, timeout=LISTENING)[0])

    def result(self, begun: Any) -> Any:
        self._begun.discard(begun)
        try:
            return self._ray.get(begun)
        except self._ray.exceptions.RayTaskError as error:
            raise error.cause from None
        except self._ray.exceptions.RayError as error:
            raise OSError(f"a worker of the cluster has died ({type(error).__name__}); what is complete is kept") from error

    def close(self) -> None:
        for begun in self._begun:
            with contextlib.suppress(self._ray.exceptions.RayError):
                self._ray.cancel(begun, force=True)
        self._ray.shutdown()


def _check_that_it_answers(cluster: str, address: str) -> None:
    """Ray itself would try for minutes."""
    host, _, port = address.rpartition(":")
    try:
        with socket.create_connection((host, int(port)), CONNECTING):
            pass
    except (OSError, ValueError) as error:
        raise ValueError(
            f"--cluster {cluster!r}: no cluster answers there ({error}); allowed: ray, or ray:HOST:PORT of one"
        ) from error


def _call(work: Callable[..., Any], piece: tuple[Any, ...]) -> Any:
    return work(*piece)
