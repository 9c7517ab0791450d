"""Compiles all stages and the plant, once, on all processors: ``python -m tests.warming``.

Without it every worker of pytest compiles for itself what it meets first. Stages are compiled by their address, without a
simulation; other kernels are left to whoever calls them.
"""

import os
import pkgutil
from concurrent.futures import ProcessPoolExecutor
from importlib import import_module
from multiprocessing import get_context

import numpy as np

from birthsim_env.loop.stage import ARGUMENTS, address_of
from birthsim_env.physics.compiled.compilation import Kernel
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from lab.studies.processors import ROOT

PACKAGES = ("birthsim_env", "baselines", "agents")


def stages() -> list[str]:
    """All kernels with the arguments of a stage, as ``module:name``, the longest first."""
    found = {}
    for package in PACKAGES:
        for module in pkgutil.walk_packages([str(ROOT / package)], f"{package}."):
            if any(part in module.name for part in (".figures.", "jax_rollouts")):  # without kernels
                continue
            for name, value in vars(import_module(module.name)).items():
                # A helper is compiled in the kernels that call it.
                if (
                    isinstance(value, Kernel)
                    and not value.inlined
                    and value.py_func.__code__.co_varnames[:2] == ("world", "seen")
                ):
                    assert value.py_func.__code__.co_argcount == ARGUMENTS
                    found[f"{value.py_func.__module__}:{name}"] = value.py_func.__code__
    return sorted(found, key=lambda name: -len(found[name].co_code))


def warm(name: str) -> None:
    module, _, function = name.partition(":")
    address_of(getattr(import_module(module), function))


def plant() -> None:
    Plant(Parameters(), 1).advance(np.zeros((4, 1)), np.zeros((2, 1)), 0.001)


def main() -> None:
    found = stages()
    with ProcessPoolExecutor(len(os.sched_getaffinity(0)), get_context("fork")) as pool:
        alone = pool.submit(plant)
        list(pool.map(warm, found))
        alone.result()


if __name__ == "__main__":
    main()
