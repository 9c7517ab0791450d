"""Traces a helper: Python runs its own source once, on symbols instead of numbers, for one lane.

That unrolls loops, inlines calls, and follows rows and their names by itself: a block is an array (rows, 1) of ``Value``, and
the records of ``compiled.records`` name its rows. Only what asks for the truth of a computed value is rewritten first, in the
helper's syntax tree: conditional expressions, ``and``, ``or``, ``not``, chained comparisons and ``if`` become selections; both
ways of an ``if`` run, and what they write is merged. A computed row is chosen from all rows that it can be, and a loop over a
computed number has as many passes as that can be. Primal operations keep their order, and hence their bits.

What Python cannot decide while tracing is an ``UntraceableError``: ``while``, a loop that is left under a computed condition or
that has no bound, and functions that are neither helpers nor known.
"""

from __future__ import annotations

import ast
import builtins
import inspect
import math
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from birthsim_env.physics.compiled import exact
from birthsim_env.physics.gradients.graph import MASKS, Graph, Scalar, Value
from birthsim_env.physics.gradients.syntax import Continues, Rewriter


class UntraceableError(ValueError):
    """What cannot be differentiated, and why."""


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
    low, high = _bounds(root)
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


def _bounds(value: Any) -> tuple[float, float]:
    """The least and the most that a whole number can be, as far as its own operation says so."""
    if not isinstance(value, Value):
        return value, value
    operation, *arguments = value.graph.nodes[value.at]
    if operation == "int":
        return _bounds(arguments[0])
    if operation == "%" and isinstance(arguments[1], int):
        return 0, arguments[1] - 1
    if operation not in ("where", "max", "min"):
        return -math.inf, math.inf
    (low, high), (lower, higher) = map(_bounds, arguments[-2:])
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


def _is_traced(value: Any) -> bool:
    if isinstance(value, (tuple, list)):
        return any(map(_is_traced, value))
    return isinstance(value, (Value, Symbols, Picked)) or isinstance(getattr(value, "rows", None), (Symbols, Picked))


# What rewritten helpers call.


def select(condition: Any, yes: Callable[[], Any], no: Callable[[], Any]) -> Any:
    """A conditional expression."""
    if not isinstance(condition, Value):
        return yes() if condition else no()
    return _merged(condition, yes(), no())


def _merged(condition: Value, yes: Any, no: Any) -> Any:
    if isinstance(yes, tuple) and isinstance(no, tuple):
        return tuple(_merged(condition, a, b) for a, b in zip(yes, no, strict=True))
    if yes is None or no is None:
        return no if yes is None else yes
    return condition.graph.select(condition, yes, no)


def logic(operation: str, *values: Callable[[], Any]) -> Any:
    """``and`` or ``or``; what Python can decide ends it early."""
    result = values[0]()
    for more in values[1:]:
        if not isinstance(result, Value):
            if bool(result) != (operation == "and"):
                return result
            result = more()
        else:
            other = more()
            if isinstance(other, Value):
                result = result.graph.node(operation, result, other)
            elif bool(other) != (operation == "and"):
                return other
    return result


def denied(value: Any) -> Any:
    """``not``."""
    return value.graph.node("not", value) if isinstance(value, Value) else not value


def branch(condition: Any, yes: Callable[[], Any], no: Callable[[], Any]) -> Any:
    """An ``if``: both ways where its condition is computed, merged."""
    if not isinstance(condition, Value):
        return yes() if condition else no()
    results = []
    for mask, way in ((condition, yes), (denied(condition), no)):
        with under(mask):
            results.append(way())
    return _merged(condition, *results)


def passes(count: Any) -> range:
    """What a loop over ``range(count)`` goes through: as many passes as a computed number may be."""
    _, most = _bounds(count)
    if most == math.inf:
        raise UntraceableError("a loop over a computed number; allowed: min(number, the most that it can be)")
    return range(int(most))


def _extreme(name: str, values: Any) -> Scalar:
    result = values[0]
    for value in values[1:]:
        of = result if isinstance(result, Value) else value
        traced = isinstance(of, Value)
        result = of.graph.node(name, result, value) if traced else getattr(builtins, name)(result, value)
    return result


_UNARY: dict[Any, str] = {
    math.sqrt: "sqrt", math.isfinite: "isfinite", np.floor: "floor", int: "int", np.int64: "int", np.uint64: "uint",
    exact.exp: "exp", exact.exp2: "exp2", exact.log: "log", exact.log1p: "log1p", exact.tanh: "tanh", exact.sine: "sine",
    exact.cosine: "cosine",
}  # fmt: skip
"""Functions of one number that are operations of a graph."""

_COMPOSED: dict[Any, Callable[[Value], Value]] = {
    math.floor: lambda value: value.graph.node("int", value.graph.node("floor", value)),
    math.ceil: lambda value: value.graph.node("int", -value.graph.node("floor", -value)),
    math.isnan: lambda value: value != value,
}

INSTEAD: dict[Any, Callable[..., Any]] = {}
"""What stands for functions that make or read arrays in ways of their own; rooms above add theirs."""


def call(function: Any, *arguments: Any, **named: Any) -> Any:
    """A call: helpers are traced, and what is made of numbers alone is computed."""
    if function in INSTEAD:
        return INSTEAD[function](*arguments, **named)
    if not _is_traced((*arguments, *named.values())):
        return getattr(function, "py_func", function)(*arguments, **named)
    first = arguments[0] if arguments else None
    if function in (max, min):
        return _extreme(function.__name__, arguments)
    if function in (float, bool, np.float64):
        return first
    if function is math.copysign:
        return next(a for a in arguments if isinstance(a, Value)).graph.node("copysign", *arguments)
    if function in _UNARY and isinstance(first, Value):
        return first.graph.node(_UNARY[function], first)
    if function in _COMPOSED and isinstance(first, Value):
        return _COMPOSED[function](first)
    if function is exact.rounded:
        return next(a for a in arguments if isinstance(a, Value)).graph.node("rounded", *arguments)
    if hasattr(function, "py_func"):
        return rewritten(function.py_func)(*arguments, **named)
    if function in (abs, len, zip, enumerate, range, slice) or isinstance(function, type) or inspect.ismethod(function):
        return function(*arguments, **named)
    raise UntraceableError(f"{getattr(function, '__name__', function)} of a computed value; allowed: helpers, +, -, *, /, sqrt")


def known(condition: Any) -> Any:
    """A condition that Python has to decide."""
    if isinstance(condition, Value):
        raise UntraceableError("a loop that is left under a computed condition")
    return condition


_NAMES = {
    "select": select, "logic": logic, "denied": denied, "branch": branch, "passes": passes, "call": call, "known": known,
    "local": lambda of, name: of.get(name),
}  # fmt: skip

_REWRITTEN: dict[Any, Any] = {}


def rewritten(function: Any) -> Any:
    """A helper's Python function with everything rewritten that asks for a truth value."""
    if function not in _REWRITTEN:
        if function.__closure__:
            raise UntraceableError(f"{function.__qualname__} is a closure; allowed: functions of a module")
        definition = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
        assert isinstance(definition, ast.FunctionDef)
        if any(isinstance(x, ast.While) for x in ast.walk(definition)):
            raise UntraceableError(f"{function.__qualname__} has a while loop; allowed: for")
        definition.decorator_list, definition.returns = [], None
        for argument in definition.args.args:
            argument.annotation = None
        definition = Continues().visit(definition)
        definition.body = Rewriter().block(definition.body)
        space = {**function.__globals__, **{f"__{name}": value for name, value in _NAMES.items()}}
        module = ast.fix_missing_locations(ast.Module([definition], []))
        exec(compile(module, f"<traced {function.__qualname__}>", "exec"), space)
        _REWRITTEN[function] = space[definition.name]
    return _REWRITTEN[function]
