"""What ``stack`` is in machine code."""

import math
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils as _cgutils
from numba.extending import intrinsic
from numba.np import arrayobj as _arrayobj

from birthsim_env.physics.compiled.blocks import BLOCK

cgutils: Any = _cgutils
arrayobj: Any = _arrayobj


def _on_stack(rows: Any, *shape: int) -> Any:
    array = types.Array(types.float64, len(shape), "C")

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = cgutils.alloca_once(builder, ir.DoubleType(), size=math.prod(shape))
        data.align = 8 * min(1 << (shape[-1].bit_length() - 1), 8)  # no vector crosses a line of the cache
        strides = [8 * math.prod(shape[axis + 1 :]) for axis in range(len(shape))]
        sizes = ([context.get_constant(types.intp, size) for size in own] for own in (shape, strides, (8,)))
        made = arrayobj.make_array(array)(context, builder)
        lengths, steps, (item,) = sizes
        arrayobj.populate_array(made, data, lengths, steps, item, None)
        return made._getvalue()

    return array(rows), generate


@intrinsic(prefer_literal=True)
def scratch(context: Any, rows: Any) -> Any:
    """A block of ``rows`` rows, a constant."""
    return _on_stack(rows, rows.literal_value, BLOCK)


@intrinsic(prefer_literal=True)
def column(context: Any, rows: Any) -> Any:
    """``rows`` numbers of one lane, a constant."""
    return _on_stack(rows, rows.literal_value)
