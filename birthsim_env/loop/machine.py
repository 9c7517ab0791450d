"""Addresses as machine code knows them: what a compiled loop and its stages read, call and put on their stacks."""

from functools import partial
from typing import TYPE_CHECKING, Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array
from numpy.typing import NDArray

from birthsim_env.loop.stage import ARGUMENTS
from birthsim_env.physics.compiled.blocks import BLOCK
from birthsim_env.physics.compiled.lanes import Array

__all__ = ["call", "carray", "pointer", "scratch"]

if TYPE_CHECKING:

    def carray(place: Any, shape: tuple[int, ...]) -> NDArray[Any]:
        """The array of a shape at a place in memory."""

    def pointer(address: int, kind: type) -> Any:
        """Pointer to numbers of ``kind`` at an address."""

    def call(address: int, *arguments: int) -> int:
        """Call the stage at an address."""

    def scratch(rows: int) -> Array:
        """A block of ``rows`` rows, a constant, on the stack of the stage that asks for it."""

else:
    from numba import carray

    @intrinsic
    def pointer(context, address, kind):
        """Pointer to numbers of ``kind`` at an address."""
        target = types.CPointer(kind.dtype)

        def generate(context, builder, signature, arguments):
            return builder.inttoptr(arguments[0], context.get_value_type(target))

        return target(address, kind), generate

    @intrinsic
    def call(context, address, *arguments):
        """Call the stage at an address."""
        signature = types.int64(types.int64, types.StarArgTuple.from_types(arguments))

        def generate(context, builder, signature, given):
            number = ir.IntType(64)
            function = builder.inttoptr(given[0], ir.FunctionType(number, [number] * ARGUMENTS).as_pointer())
            return builder.call(function, [builder.extract_value(given[1], k) for k in range(ARGUMENTS)])

        return signature, generate

    @intrinsic(prefer_literal=True)
    def scratch(context, rows):
        """A block of ``rows`` rows, a constant, on the stack of the stage that asks for it."""
        array = types.Array(types.float64, 2, "C")

        def generate(context, builder, signature, arguments):
            shape = (rows.literal_value, BLOCK)
            data = cgutils.alloca_once(builder, ir.DoubleType(), size=shape[0] * BLOCK)
            number = partial(context.get_constant, types.intp)
            made = make_array(array)(context, builder)
            strides = [number(8 * BLOCK), number(8)]
            populate_array(made, data, [number(size) for size in shape], strides, number(8), None)
            return made._getvalue()

        return array(rows), generate
