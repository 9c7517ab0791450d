"""Traces a helper: Python runs its own source once, on symbols instead of numbers, for one lane.

That unrolls loops, inlines calls, and follows rows and their names by itself: a block is an array (rows, 1) of ``Value``, and
the records of ``compiled.records`` name its rows. Only what asks for the truth of a computed value is rewritten first, in the
helper's syntax tree: conditional expressions, ``and``, ``or``, ``not``, chained comparisons and ``if`` become selections; both
ways of an ``if`` run, and what they write is merged. A computed row is chosen from all rows that it can be, and a loop over a
computed number has as many passes as that can be. Primal operations keep their order, and hence their bits.

What Python cannot decide while tracing is an ``UntraceableError``: ``while``, a loop that is left under a computed condition or
that has no bound, and functions that are neither helpers nor known.
"""

import ast
import builtins
import inspect
import math
import textwrap
from collections.abc import Callable
from typing import Any

import numpy as np

from birthsim_env.gradients.graph import Scalar, Value
from birthsim_env.gradients.symbols import Picked, Symbols, bounds, empty, under
from birthsim_env.gradients.syntax import Continues, Rewriter
from birthsim_env.physics.compiled import exact, stack
from birthsim_env.physics.compiled.plain import REAL


class UntraceableError(ValueError):
    """What cannot be differentiated, and why."""


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
        merged = [_merged(condition, a, b) for a, b in zip(yes, no, strict=True)]
        return type(yes)(*merged) if hasattr(yes, "_fields") else tuple(merged)
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
    _, most = bounds(count)
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

INSTEAD: dict[Any, Callable[..., Any]] = {stack.scratch: empty, stack.column: lambda rows: empty(rows)[:, 0]}
"""What stands for functions that make or read arrays in ways of their own; rooms above add theirs."""


def call(function: Any, *arguments: Any, **named: Any) -> Any:
    """A call: helpers are traced, and what is made of numbers alone is computed."""
    function = REAL.get(function, function)
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
