"""Addresses as machine code knows them: what a compiled loop and its stages read and call."""

from typing import TYPE_CHECKING, Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray

from birthsim_env.loop.stage import ARGUMENTS

__all__ = ["call", "carray", "pointer"]

if TYPE_CHECKING:

    def carray(place: Any, shape: tuple[int, ...]) -> NDArray[Any]:
        """The array of a shape at a place in memory."""

    def pointer(address: int, kind: type) -> Any:
        """Pointer to numbers of ``kind`` at an address."""

    def call(address: int, *arguments: int) -> int:
        """Call the stage at an address."""
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
