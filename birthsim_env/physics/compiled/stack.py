"""Arrays on the stack of the kernel that asks for them. LLVM sees all that happens to them: nothing else points into them, so
loops over lanes vectorise without a check, and what is read where it was written stays in registers.
"""

import math
from typing import TYPE_CHECKING

import numpy as np

from birthsim_env.physics.compiled.compilation import BLOCK
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.plain import DEBUG

if TYPE_CHECKING or DEBUG:

    def scratch(rows: int) -> Array:
        """A block of ``rows`` rows, a constant; NaN in plain Python until something is written."""
        return np.full((rows, BLOCK), np.nan)

    def column(rows: int) -> Array:
        """``rows`` numbers of one lane, a constant; NaN in plain Python until something is written."""
        return np.full(rows, np.nan)

else:
    from llvmlite import ir
    from numba import types
    from numba.core import cgutils
    from numba.extending import intrinsic
    from numba.np.arrayobj import make_array, populate_array

    def _on_stack(rows, *shape):
        array = types.Array(types.float64, len(shape), "C")

        def generate(context, builder, signature, arguments):
            data = cgutils.alloca_once(builder, ir.DoubleType(), size=math.prod(shape))
            data.align = 8 * min(shape[-1], 8)  # no vector crosses a line of the cache
            strides = [8 * math.prod(shape[axis + 1 :]) for axis in range(len(shape))]
            sizes = ([context.get_constant(types.intp, size) for size in own] for own in (shape, strides, (8,)))
            made = make_array(array)(context, builder)
            lengths, steps, (item,) = sizes
            populate_array(made, data, lengths, steps, item, None)
            return made._getvalue()

        return array(rows), generate

    @intrinsic(prefer_literal=True)
    def scratch(context, rows):
        """A block of ``rows`` rows, a constant."""
        return _on_stack(rows, rows.literal_value, BLOCK)

    @intrinsic(prefer_literal=True)
    def column(context, rows):
        """``rows`` numbers of one lane, a constant."""
        return _on_stack(rows, rows.literal_value)
