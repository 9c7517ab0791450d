"""Types resolved first are those that Numba comes to without."""

import operator
from typing import Any

import pytest
from numba import types
from numba.core.registry import cpu_target

from birthsim_env.physics.compiled.resolution import FIRST

NUMBERS = (types.float64, types.int64, types.boolean, types.float32)
ROWS, ROW = types.Array(types.float64, 2, "C"), types.Array(types.float64, 1, "A")
INDICES = (types.int64, types.uint64, types.slice2_type, types.UniTuple(types.int64, 2), types.UniTuple(types.uint64, 1))
ARITHMETIC = (operator.add, operator.sub, operator.mul, operator.truediv)
COMPARISONS = (operator.lt, operator.le, operator.gt, operator.ge, operator.eq, operator.ne)
CASES = [
    *((operation, (a, b)) for operation in (*ARITHMETIC, *COMPARISONS) for a in NUMBERS for b in NUMBERS),
    *((operator.getitem, (array, index)) for array in (ROWS, ROW) for index in INDICES),
    *((operator.setitem, (array, index, value)) for array in (ROWS, ROW) for index in INDICES for value in NUMBERS),
]


def resolved(function: Any, types_given: tuple[Any, ...]) -> str:
    context = cpu_target.typing_context
    try:
        return str(function.get_call_type(context, types_given, {}))
    except Exception as refused:
        return type(refused).__name__


@pytest.mark.parametrize("operation", [*ARITHMETIC, *COMPARISONS, operator.getitem, operator.setitem], ids=lambda o: o.__name__)
def test_an_operation_has_the_type_that_numba_gives_it(operation: Any) -> None:
    cpu_target.typing_context.refresh()
    function = cpu_target.typing_context.resolve_value_type(operation)
    ours = [template for template in function.templates if getattr(template, "metadata", {}) is FIRST]
    numbas = types.Function([template for template in function.templates if template not in ours])
    assert len(ours) == 1
    for asked, arguments in CASES:
        if asked is operation:
            assert resolved(function, arguments) == resolved(numbas, arguments), arguments
