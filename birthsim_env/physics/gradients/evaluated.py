"""A graph in numbers: NumPy computes its operations, at many points at once."""

import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.gradients.graph import Graph, Scalar, Value

OPERATIONS: dict[str, Callable[..., Any]] = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv, "neg": operator.neg, "abs": np.abs,
    "<": operator.lt, ">": operator.gt, "<=": operator.le, ">=": operator.ge, "==": operator.eq, "!=": operator.ne,
    "and": np.logical_and, "or": np.logical_or, "not": np.logical_not, "max": np.maximum, "min": np.minimum, "where": np.where,
    "sqrt": np.sqrt, "copysign": np.copysign,
}  # fmt: skip
"""Those of the plant."""


def evaluated(graph: Graph, inputs: Mapping[str, Array], wanted: Sequence[Scalar]) -> Array:
    """The ``wanted`` scalars (R,) at T points, (R, T); ``inputs`` are the blocks that the graph reads, (rows, T)."""
    numbers: list[Any] = []
    # Both sides of a selection are computed, of which the other one may be no number.
    with np.errstate(all="ignore"):
        for operation, *arguments in graph.nodes:
            if operation == "input":
                numbers.append(inputs[arguments[0]][arguments[1]])
            else:
                given = (numbers[a.at] if isinstance(a, Value) else a for a in arguments)
                numbers.append(OPERATIONS[operation](*given))
    points = next(iter(inputs.values())).shape[1]
    return np.stack([np.broadcast_to(numbers[v.at] if isinstance(v, Value) else v, points) for v in wanted])
