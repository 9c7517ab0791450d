"""Memory that the threads of a graphics processor's block share, and rows that are read anew.

A thread runs one lane there, and has registers for the state of its plant but not for the parameters beside it. Compiled for
threads, kernels call two functions that ``birthsim_build.code.blocks`` defines for the processor on which they run.
"""

from typing import TYPE_CHECKING

from birthsim_env.physics.compiled.blocks import WARP
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array

if TYPE_CHECKING:

    def shared(rows: int) -> Array:
        """``rows`` rows, a constant, of the calling thread: a column of an array (``rows``, WARP) of its block."""


if TYPE_CHECKING or not WARP:

    @helper
    def anew(rows: Array) -> Array:
        """The same rows, of which a thread keeps nothing in registers that it has read before.

        Otherwise a compiler reads parameters once, ahead of a loop, and then keeps in slower memory what does not fit."""
        return rows

else:
    from functools import partial

    from llvmlite import ir
    from llvmlite.binding import add_symbol
    from numba import types
    from numba.core import cgutils
    from numba.extending import intrinsic
    from numba.np.arrayobj import make_array, populate_array

    NUMBERS, WORD = ir.DoubleType().as_pointer(), ir.IntType(64)
    COLUMN, NOTHING = "thread_column", "thread_nothing"

    for _name in (COLUMN, NOTHING):
        add_symbol(_name, 1)  # Numba asks where they are, and nothing is run in this process.

    @intrinsic(prefer_literal=True)
    def shared(context, rows):
        """The column: where threads have no memory in common, in an array of the thread's own."""
        array = types.Array(types.float64, 2, "C")

        def generate(context, builder, signature, arguments):
            count, number = rows.literal_value, partial(context.get_constant, types.intp)
            room = cgutils.alloca_once(builder, ir.DoubleType(), size=count * WARP)
            column = cgutils.get_or_insert_function(builder.module, ir.FunctionType(NUMBERS, [NUMBERS]), COLUMN)
            made = make_array(array)(context, builder)
            shape, strides = [number(count), number(WARP)], [number(8 * WARP), number(8)]
            populate_array(made, builder.call(column, [room]), shape, strides, number(8), None)
            return made._getvalue()

        return array(rows), generate

    @intrinsic
    def anew(context, rows):
        """The rows, at an address of which a compiler does not know that it is the same."""

        def generate(context, builder, signature, arguments):
            nothing = cgutils.get_or_insert_function(builder.module, ir.FunctionType(WORD, []), NOTHING)
            made = make_array(rows)(context, builder, arguments[0])
            made.data = builder.gep(made.data, [builder.call(nothing, [])])
            return made._getvalue()

        return rows(rows), generate
