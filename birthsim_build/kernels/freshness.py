"""Which prebuilt kernels are those of the sources that are here."""

import json
from collections.abc import Iterable, Iterator
from importlib import import_module
from importlib.util import find_spec

from birthsim_build.kernels.wanted import declared
from birthsim_env.physics.compiled import prebuilt
from birthsim_env.physics.compiled.compilation import Kernel
from birthsim_env.physics.compiled.sources import is_ours, stamp_of


def stale() -> list[str]:
    """Keys of kernels that the package has in another version, or not at all: Numba compiles these.

    Generated kernels are not looked at: what a loop differentiates says which there are.
    """
    place = prebuilt.FOLDER / "index.json"
    kernels = json.loads(place.read_bytes())["kernels"] if place.is_file() else {}
    here = {one.key: one.kernel for one in declared()} | dict(_named(kernels))
    old = {key for key in kernels if is_ours(key) and key not in here}
    return sorted(old | {key for key, one in here.items() if kernels.get(key, [""])[0] != stamp_of(one.py_func)})


def _named(keys: Iterable[str]) -> Iterator[tuple[str, Kernel]]:
    """Keys of kernels that are here."""
    for key in keys:
        module, _, name = key.partition(" ")[0].rpartition(".")
        if is_ours(module) and find_spec(module) is not None:
            found = getattr(import_module(module), name, None)
            if isinstance(found, Kernel):
                yield key, found
