"""A graph in numbers: NumPy computes its operations, at many points at once."""

import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from birthsim_env.gradients.graph import Graph, Scalar, Value
from birthsim_env.physics.compiled.lanes import Array

OPERATIONS: dict[str, Callable[..., Any]] = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv, "neg": operator.neg, "abs": np.abs,
    "<": operator.lt, ">": operator.gt, "<=": operator.le, ">=": operator.ge, "==": operator.eq, "!=": operator.ne,
    "and": np.logical_and, "or": np.logical_or, "not": np.logical_not, "max": np.maximum, "min": np.minimum, "where": np.where,
    "sqrt": np.sqrt, "copysign": np.copysign,
}  # fmt: skip
"""Those of the plant."""


def carried_out(graph: Graph, inputs: Mapping[str, Any], operations: Mapping[str, Callable[..., Any]]) -> list[Any]:
    """What each node of a graph is by these ``operations``, which may be another algebra's; ``inputs`` has rows by block."""
    found: list[Any] = []
    for operation, *arguments in graph.nodes:
        if operation == "input":
            found.append(inputs[arguments[0]][arguments[1]])
        else:
            found.append(operations[operation](*(found[a.at] if isinstance(a, Value) else a for a in arguments)))
    return found


def evaluated(graph: Graph, inputs: Mapping[str, Array], wanted: Sequence[Scalar]) -> Array:
    """The ``wanted`` scalars (R,) at T points, (R, T); ``inputs`` are the blocks that the graph reads, (rows, T)."""
    # Both sides of a selection are computed, of which the other one may be no number.
    with np.errstate(all="ignore"):
        numbers = carried_out(graph, inputs, OPERATIONS)
    points = next(iter(inputs.values())).shape[1]
    return np.stack([np.broadcast_to(numbers[v.at] if isinstance(v, Value) else v, points) for v in wanted])
