"""Kinds of arguments, as keys of ``compiled.prebuilt`` write them, as types of Numba."""

from collections.abc import Sequence
from functools import reduce
from importlib import import_module
from typing import Any

import numpy as np
from numba import from_dtype, types

from birthsim_env.loop.stage import layouts_of
from birthsim_env.physics.compiled.record_types import Record, block_type

_NUMBERS = {"i": types.int64, "d": types.float64, "b": types.boolean, "u": types.uint64}
_RESULTS: dict[Any, str] = {**{kind: code for code, kind in _NUMBERS.items()}, types.none: "n"}


def types_of(kernel: Any, kinds: Sequence[str]) -> tuple[Any, ...]:
    """Types of arguments; what a stage is handed of a layout is its address, a whole number."""
    if set(kinds) == {"i"}:
        return tuple(block_type(layout) if layout else types.int64 for layout in layouts_of(kernel))
    return tuple(map(_type_of, kinds))


def result_of(returned: Any) -> str:
    """The kind of what is returned; ``ValueError`` for what prebuilt code does not hand on."""
    kind: Any = types.unliteral(returned)  # type: ignore[no-untyped-call]
    if kind not in _RESULTS:
        raise ValueError(f"a kernel returns {returned}; allowed: {', '.join(map(str, _RESULTS))}")
    return _RESULTS[kind]


def _type_of(kind: str) -> Any:
    if kind in _NUMBERS:
        return _NUMBERS[kind]
    layout, _, array = kind.rpartition(":")
    if layout:
        return Record(_named(layout), _type_of(array))
    axes = array[1:].rstrip("CFAr")
    order = array[1 + len(axes)]
    return types.Array(from_dtype(np.dtype(array[0])), int(axes), order, readonly=array.endswith("r"))  # type: ignore[call-overload]


def _named(layout: str) -> Any:
    """The class that ``module.qualname`` names."""
    parts = layout.split(".")
    for count in range(len(parts) - 1, 0, -1):
        try:
            return reduce(getattr, parts[count:], import_module(".".join(parts[:count])))
        except ModuleNotFoundError:
            continue
    raise ValueError(f"a layout {layout!r}; allowed: module.name")
