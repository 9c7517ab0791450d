"""What generated kernels call that Numba does not know."""

from typing import TYPE_CHECKING

from numba import types
from numba.extending import intrinsic

if TYPE_CHECKING:

    def choose(condition: bool, yes: float, no: float) -> float:
        """``yes if condition else no`` of numbers that are at hand, without a branch that LLVM could move loads into."""

else:

    @intrinsic
    def choose(context, condition, yes, no):
        """``yes if condition else no`` of numbers that are at hand, without a branch that LLVM could move loads into."""
        number = types.float64

        def generate(context, builder, signature, arguments):
            pairs = zip(arguments[1:], signature.args[1:], strict=True)
            return builder.select(arguments[0], *(context.cast(builder, value, kind, number) for value, kind in pairs))

        return number(types.boolean, yes, no), generate
