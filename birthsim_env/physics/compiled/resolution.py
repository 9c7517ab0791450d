"""The types of operations on numbers and on elements of arrays, resolved before Numba asks what else they could be.

Numba finds the type of an operation by asking some twenty templates in turn, twice each: for integers, complex numbers,
universal functions, typed lists and dictionaries. It asks again while it writes code. That was a quarter of the time to
compile a kernel. Templates of the processor's own target are asked first. Those below give the answers that Numba comes to,
so the machine code stays the same.
"""

import operator
from collections.abc import Callable
from typing import Any

from numba.core import types
from numba.core.typing.arraydecl import GetItemBuffer, SetItemBuffer
from numba.core.typing.templates import AbstractTemplate, infer_global, signature

FIRST = {"target": "cpu"}
"""What Numba orders templates by: those for every target have none."""


def _first(template: type, operation: Callable[..., Any], **members: Any) -> None:
    infer_global(operation)(type("First", (template,), {"metadata": FIRST, **members}))  # type: ignore[no-untyped-call]


class _OfTwoNumbers(AbstractTemplate):
    result: types.Type

    def generic(self, args: tuple[types.Type, ...], kws: dict[str, types.Type]) -> Any:
        return signature(self.result, *args) if args == (types.float64, types.float64) else None  # type: ignore[no-untyped-call]


for _operation in (operator.add, operator.sub, operator.mul, operator.truediv):
    _first(_OfTwoNumbers, _operation, result=types.float64)
for _operation in (operator.lt, operator.le, operator.gt, operator.ge, operator.eq, operator.ne):
    _first(_OfTwoNumbers, _operation, result=types.boolean)
_first(GetItemBuffer, operator.getitem)
_first(SetItemBuffer, operator.setitem)
