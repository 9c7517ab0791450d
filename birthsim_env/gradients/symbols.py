"""Arrays of what helpers are traced on: symbols instead of numbers, for one lane, whose rows may be computed."""

import math
import operator
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from birthsim_env.gradients.graph import MASKS, Graph, Value


class Symbols(np.ndarray[Any, Any]):
    """An array of ``Value``, numbers and, where nothing is written yet, None. Writes obey the conditions of the moment.

    A computed index reads one of all rows, and writes to those under the condition that it is theirs.
    """

    def __getitem__(self, where: Any) -> Any:
        rows = _rows(self.shape, where)
        return super().__getitem__(where) if rows is None else _one_of([(mask, self[row]) for mask, row in rows])

    def __setitem__(self, where: Any, value: Any) -> None:
        rows = _rows(self.shape, where)
        if rows is not None:
            _write([(mask, self, row) for mask, row in rows], value)
            return
        for mask in reversed(MASKS):
            before = self[where]
            value = value if before is None else mask.graph.select(mask, value, before)
        super().__setitem__(where, value)

    def view(self, kind: Any) -> Any:  # type: ignore[override]
        """Numbers as the whole numbers that their bits are."""
        bits = np.empty(self.shape, dtype=object)
        for where, value in np.ndenumerate(self):
            bits[where] = value.graph.node("bits", value)
        return np.ndarray.view(bits, Symbols)


def _of_graph(operation: str) -> Callable[..., Any]:
    def made(*arguments: Any) -> Any:
        known = [one for one in arguments if isinstance(one, Value)]
        return known[0].graph.node(operation, *arguments) if known else getattr(np, _NUMPY[operation])(*arguments)

    return made


_NUMPY = {"max": "maximum", "min": "minimum", "sqrt": "sqrt", "floor": "floor"}

_UFUNCS: dict[Any, Callable[..., Any]] = {
    np.add: operator.add, np.subtract: operator.sub, np.multiply: operator.mul, np.divide: operator.truediv,
    np.less: operator.lt, np.greater: operator.gt,
    **{getattr(np, own): _of_graph(name) for name, own in _NUMPY.items()},
}  # fmt: skip
"""NumPy's operations, of one entry."""


class Unknown(Symbols):
    """``Symbols`` that NumPy's functions take as they take numbers: for code over lanes that is no kernel."""

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        if method != "__call__" or options or ufunc not in _UFUNCS:
            return NotImplemented
        entries = [np.asarray(one, dtype=object).view(np.ndarray) for one in inputs]
        return np.asarray(np.frompyfunc(_UFUNCS[ufunc], ufunc.nin, 1)(*entries), dtype=object).view(Unknown)

    def __array_function__(self, function: Any, types: Any, arguments: Any, options: Any) -> Any:
        if function is np.where:
            bare = [np.asarray(one, dtype=object).view(np.ndarray) for one in arguments]
            return np.asarray(np.frompyfunc(_either, 3, 1)(*bare), dtype=object).view(Unknown)
        return super().__array_function__(function, types, arguments, options)

    def trace_kernel(self, kernel: Any, *arguments: Any) -> None:
        """Run a kernel on symbols, which writes to these."""
        from birthsim_env.gradients.tracing import rewritten  # late: that module is made of this one

        rewritten(kernel.py_func)(*arguments)


def _either(condition: Any, yes: Any, no: Any) -> Any:
    return condition.graph.select(condition, yes, no) if isinstance(condition, Value) else yes if condition else no


class Picked:
    """The one of several views, each with its condition, that a computed index means."""

    def __init__(self, ways: list[tuple[Value, Any]]) -> None:
        self._ways, self.shape = ways, ways[0][1].shape

    def __getitem__(self, where: Any) -> Any:
        return _one_of([(mask, view[where]) for mask, view in self._ways])

    def __setitem__(self, where: Any, value: Any) -> None:
        _write([(mask, view, where) for mask, view in self._ways], value)


def _one_of(ways: list[tuple[Value, Any]]) -> Any:
    """A view or a number, of those whose condition holds."""
    if isinstance(ways[0][1], (Symbols, Picked)):
        return Picked(ways)
    (_, found), *others = reversed(ways)
    for mask, value in others:
        found = mask.graph.select(mask, value, found)
    return found


def _write(ways: list[tuple[Value, Any, Any]], value: Any) -> None:
    """Write to each of several views under its condition."""
    for mask, view, where in ways:
        with under(mask):
            view[where] = value


def _rows(shape: tuple[int, ...], where: Any) -> list[tuple[Value, Any]] | None:
    """The rows that an index can mean, with their conditions; None for one that Python knows."""
    index = where if isinstance(where, tuple) else (where,)
    axis = next((k for k, one in enumerate(index) if isinstance(one, Value)), None)
    if axis is None:
        return None
    root, stride, offset = _affine(index[axis])
    low, high = bounds(root)
    rows = ((row, (row - offset) // stride) for row in range(shape[axis]) if (row - offset) % stride == 0)
    return [(root == whole, (*index[:axis], row, *index[axis + 1 :])) for row, whole in rows if low <= whole <= high]


def _affine(index: Value) -> tuple[Value, int, int]:
    """A value, and whole numbers by which it is multiplied and to which it is added to give ``index``."""
    operation, a, b = (*index.graph.nodes[index.at], None)[:3]
    if operation in ("+", "*") and isinstance(a, int):
        a, b = b, a
    if operation not in ("+", "-", "*") or not isinstance(b, int):
        return index, 1, 0
    root, stride, offset = _affine(a)
    if operation == "*":
        return root, stride * b, offset * b
    return root, stride, offset + b if operation == "+" else offset - b


def bounds(value: Any) -> tuple[float, float]:
    """The least and the most that a whole number can be, as far as its own operation says so."""
    if not isinstance(value, Value):
        return value, value
    operation, *arguments = value.graph.nodes[value.at]
    if operation == "int":
        return bounds(arguments[0])
    if operation == "%" and isinstance(arguments[1], int):
        return 0, arguments[1] - 1
    if operation not in ("where", "max", "min"):
        return -math.inf, math.inf
    (low, high), (lower, higher) = map(bounds, arguments[-2:])
    if operation == "where":
        return min(low, lower), max(high, higher)
    choose = max if operation == "max" else min
    return choose(low, lower), choose(high, higher)


@contextmanager
def under(mask: Value) -> Iterator[None]:
    """What is written meanwhile is written where ``mask`` holds."""
    MASKS.append(mask)
    try:
        yield
    finally:
        MASKS.pop()


def inputs(graph: Graph, name: str, rows: int) -> Any:
    """The block ``name`` (rows, 1), of which all is read."""
    block = np.empty((rows, 1), dtype=object)
    for row in range(rows):
        block[row, 0] = graph.input(name, row)
    return block.view(Symbols)


def empty(rows: int) -> Any:
    """A block (rows, 1) of which nothing is written yet."""
    return np.full((rows, 1), None, dtype=object).view(Symbols)
