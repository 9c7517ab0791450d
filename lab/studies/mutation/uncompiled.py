"""Kernels as plain Python: what mutants and coverage need, since machine code neither changes nor counts its lines.

``switch_off`` comes before anything of the project is imported. Stages of a closed loop, which the machine calls by their
address, are then looked up in a table.
"""

import ctypes
import importlib
import os
import sys
from collections.abc import Callable
from typing import Any

SETTINGS = {"NUMBA_DISABLE_JIT": "1", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}

_stages: list[Callable[..., int]] = []


def interpreted(function: Any = None, **_options: object) -> Any:
    """Stands in for ``numba.njit``: the function as it is, also under the name ``py_func``."""
    if function is None:
        return interpreted
    function.py_func = function
    return function


def pointer(address: int, kind: type) -> Any:
    """Stands in for the loop's own."""
    numbers: dict[str, Any] = {"float64": ctypes.c_double, "float32": ctypes.c_float, "int64": ctypes.c_int64}
    return ctypes.cast(int(address), ctypes.POINTER(numbers[kind.__name__]))


def address_of(stage: Callable[..., int]) -> int:
    """Stands in for the loop's own: the place of a stage in the table."""
    if stage not in _stages:
        _stages.append(stage)
    return _stages.index(stage)


def call(address: int, *arguments: int) -> int:
    """Stands in for the loop's own."""
    stage = importlib.import_module("birthsim_env.loop.stage")
    function = _stages[int(address)]
    return function(*map(_named, stage.layouts_of(function), map(int, arguments)))


def _named(layout: Any, address: int) -> Any:
    """What a stage is handed: a whole number, or the rows at an address by name."""
    if layout is None or not address:
        return address
    stage = importlib.import_module("birthsim_env.loop.stage")
    shape = (layout.size, stage.BLOCK) if layout.per_lane else (layout.size,)
    return layout(stage.carray(pointer(address, stage.np.float64), shape))


def switch_off() -> None:
    """Let every kernel of this process be plain Python."""
    os.environ |= SETTINGS
    vars(importlib.import_module("numba"))["njit"] = interpreted
    numpy = importlib.import_module("numpy")
    stage = importlib.import_module("birthsim_env.loop.stage")
    block = importlib.import_module("birthsim_env.physics.compiled.compilation").BLOCK

    def scratch(rows: int) -> Any:
        return numpy.empty((rows, block))

    others = [("pointer", pointer), ("call", call), ("scratch", scratch), ("address_of", address_of)]
    before = {id(getattr(stage, name)): new for name, new in others}
    for module in [one for name, one in sys.modules.items() if name.startswith(("birthsim_env", "baselines", "agents"))]:
        for name, value in list(vars(module).items()):
            if id(value) in before:
                setattr(module, name, before[id(value)])
