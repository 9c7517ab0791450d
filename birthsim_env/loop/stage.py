"""Stages: what happens in a control period, each compiled by itself and called by its address.

A stage is a kernel over one block of lanes. Its seven arguments are whole numbers: the addresses of the world and of what is
seen (``loop.rows``), of its own memory, constants and tables, the first lane of the block and the number of lanes. It returns
how many lanes it could not serve. An argument that is annotated with a layout (``records.Rows``, ``Numbers``) names the rows at
its address; ``block``, ``numbers`` and ``table`` make arrays of other addresses. A block's shape is constant, so that LLVM
vectorises loops over it. A law is called with zero for the world.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import TYPE_CHECKING, Any, get_type_hints

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop import plain
from birthsim_env.physics.compiled import prebuilt
from birthsim_env.physics.compiled.blocks import BLOCK
from birthsim_env.physics.compiled.compilation import Late, helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.plain import DEBUG
from birthsim_env.physics.compiled.records import Rows
from birthsim_env.physics.compiled.stack import scratch

if TYPE_CHECKING:
    from birthsim_env.loop.machine import call, carray, pointer
elif DEBUG:
    from birthsim_env.loop.plain import call, carray, pointer
else:
    call, carray, pointer = (Late("birthsim_env.loop.machine", name) for name in ("call", "carray", "pointer"))

__all__ = ["call", "carray", "pointer", "scratch"]

ARGUMENTS = 7
"""Of a stage."""

TABLE = 5
"""Whole numbers that describe a table: its address and up to four dimensions."""


@helper
def block(address: int, rows: int) -> Array:
    """The block (``rows``, BLOCK) at an address; with a constant number of rows, a constant shape."""
    return carray(pointer(address, np.float64), (rows, BLOCK))


@helper
def numbers(address: int, count: int) -> Array:
    """``count`` numbers at an address."""
    return carray(pointer(address, np.float64), (count,))


@helper
def _described(tables: int, k: int) -> tuple[int, int, int, int, int]:
    """Address and dimensions of table ``k``."""
    about = carray(pointer(tables, np.int64), (k + 1, TABLE))
    return about[k, 0], about[k, 1], about[k, 2], about[k, 3], about[k, 4]


@helper
def table1(tables: int, k: int) -> Array:
    """Table ``k`` of one dimension."""
    place, first, _, _, _ = _described(tables, k)
    return carray(pointer(place, np.float64), (first,))


@helper
def table2(tables: int, k: int) -> Array:
    """Table ``k`` of two dimensions."""
    place, first, second, _, _ = _described(tables, k)
    return carray(pointer(place, np.float64), (first, second))


@helper
def singles(tables: int, k: int) -> NDArray[np.float32]:
    """Table ``k`` of two dimensions and single precision."""
    place, first, second, _, _ = _described(tables, k)
    return carray(pointer(place, np.float32), (first, second))


@helper
def singles1(tables: int, k: int) -> NDArray[np.float32]:
    """Table ``k`` of one dimension and single precision."""
    place, first, _, _, _ = _described(tables, k)
    return carray(pointer(place, np.float32), (first,))


@helper
def table3(tables: int, k: int) -> Array:
    """Table ``k`` of three dimensions."""
    place, first, second, third, _ = _described(tables, k)
    return carray(pointer(place, np.float64), (first, second, third))


@helper
def table4(tables: int, k: int) -> Array:
    """Table ``k`` of four dimensions."""
    place, first, second, third, fourth = _described(tables, k)
    return carray(pointer(place, np.float64), (first, second, third, fourth))


def described(tables: Sequence[NDArray[Any]]) -> NDArray[np.int64]:
    """What ``table1`` to ``table4``, ``singles1`` and ``singles`` need of tables: addresses and shapes, (T, TABLE)."""
    about = np.zeros((max(1, len(tables)), TABLE), dtype=np.int64)
    for entry, table in zip(about, tables, strict=False):
        entry[: 1 + table.ndim] = table.ctypes.data, *table.shape
    return about


def layouts_of(stage: Any) -> list[type[Rows] | None]:
    """The layout with which each argument of a stage is annotated; None for a whole number."""
    function = getattr(stage, "py_func", stage)
    hints = get_type_hints(function)
    named = [hints.get(name) for name in function.__code__.co_varnames[: function.__code__.co_argcount]]
    return [one if isinstance(one, type) and issubclass(one, Rows) else None for one in named]


def compiled(stage: Any) -> Any:
    """What Numba made of a stage; compiled when it is first asked for. ``RuntimeError`` where kernels are plain Python."""
    if DEBUG:
        raise RuntimeError("BIRTHSIM_DEBUG = 1: nothing is compiled; allowed: to build, and to use a device, without it")
    from birthsim_env.physics.compiled.with_numba import compiled_stage  # late: prebuilt code needs none of it

    return compiled_stage(stage, layouts_of(stage))


@cache
def address_of(stage: Any) -> int:
    """Where the machine code of a stage begins; where kernels are plain Python, a number that stands for it."""
    if DEBUG:
        return plain.address_of(stage, layouts_of(stage))
    if place := prebuilt.address(stage, ARGUMENTS):
        return place
    made = compiled(stage)
    return int(made.library.get_pointer_to_function(made.fndesc.llvm_cfunc_wrapper_name))


@dataclass(eq=False)
class Stage:
    """A compiled stage with what is its own.

    ``memory`` (M, N) is carried from period to period; ``constants`` (C,) are the same for all lanes; ``tables``, with lanes as
    their last axis, are too large to be carried along. ``sees_world`` is False for whatever controls the rig. Raises
    ``ValueError`` for arrays that are not C-contiguous, constants other than float64 and tables of more than four dimensions:
    a stage is handed no more than their address.
    """

    function: Callable[..., int]
    constants: Array = field(default_factory=lambda: np.zeros(1))
    memory: Array | None = None
    tables: tuple[NDArray[Any], ...] = ()
    sees_world: bool = True

    def __post_init__(self) -> None:
        for name, array in (("constants", self.constants), *((f"tables[{k}]", table) for k, table in enumerate(self.tables))):
            if not array.flags.c_contiguous or array.ndim >= TABLE or (name == "constants" and array.dtype != np.float64):
                raise ValueError(
                    f"{name} of a stage is {array.dtype} {array.shape}, strides {array.strides}; allowed: C-contiguous, "
                    f"at most {TABLE - 1} dimensions, constants float64"
                )

    def key(self) -> tuple[Any, ...]:
        """Equal for stages that run the same code on the same arrays."""
        arrays = (*self.tables, *(() if self.memory is None else (self.memory,)))
        places = tuple((array.__array_interface__["data"][0], array.shape) for array in arrays)
        return self.function, self.constants.tobytes(), places


Part = Stage | Callable[[int], None]
"""A stage, or what a loop calls back with the number of the period: a user's own Python."""


class Staged:
    """What has one method that runs in every control period, and may have it compiled."""

    def stage(self) -> Stage | None:
        """That method, compiled into the closed loop; None where it is Python."""
        return None


def stage_of(part: Staged, method: str, stage: str = "stage") -> Stage | None:
    """What a part's ``stage()`` returns, which is its ``method`` compiled; None where the method is Python.

    It is Python where there is no stage, and for a class that derives from a compiled one and overrides ``method`` alone.
    """
    for kind in type(part).__mro__:
        if stage in vars(kind):
            found: Stage | None = getattr(part, stage)()
            return found
        if method in vars(kind):
            break
    return None
