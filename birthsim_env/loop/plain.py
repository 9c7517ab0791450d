"""Addresses as plain Python knows them, where ``BIRTHSIM_DEBUG=1`` is set: what ``loop.machine`` has for machine code."""

import ctypes
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.physics.compiled.blocks import BLOCK
from birthsim_env.physics.compiled.records import Rows

_STAGES: list[tuple[Callable[..., int], Sequence[type[Rows] | None]]] = []
"""Stages by their addresses, which begin with 1, and the layouts of their arguments."""


def pointer(address: int, kind: type) -> tuple[int, type]:
    """Numbers of ``kind`` at an address."""
    return int(address), kind


def carray(place: tuple[int, type], shape: Sequence[int]) -> NDArray[Any]:
    """The array of a shape at a place in memory."""
    address, kind = place
    sizes = tuple(map(int, shape))
    count = int(np.prod(sizes)) * np.dtype(kind).itemsize
    memory: Any = (ctypes.c_char * count).from_address(address)
    return np.frombuffer(memory, dtype=kind).reshape(sizes)


def address_of(stage: Callable[..., int], layouts: Sequence[type[Rows] | None]) -> int:
    """The number of a stage, which stands for where its machine code begins."""
    if (stage, layouts) not in _STAGES:
        _STAGES.append((stage, layouts))
    return _STAGES.index((stage, layouts)) + 1


def call(address: int, *arguments: int) -> int:
    """Call the stage at an address; where it names a layout it gets the rows of the block."""
    stage, layouts = _STAGES[int(address) - 1]
    return int(stage(*map(_named, layouts, map(int, arguments))))


def _named(layout: type[Rows] | None, address: int) -> Any:
    if layout is None or address == 0:
        return address
    shape = (layout.size, BLOCK) if layout.per_lane else (layout.size,)
    return layout(carray((address, np.float64), shape))
