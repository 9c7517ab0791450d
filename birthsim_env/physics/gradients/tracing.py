"""Traces a helper: Python runs its own source once, on symbols instead of numbers, for one lane.

That unrolls loops, inlines calls, and follows rows and their names by itself: a block is an array (rows, 1) of ``Value``, and
the records of ``compiled.records`` name its rows. Only what asks for the truth of a computed value is rewritten first, in the
helper's syntax tree: conditional expressions, ``and``, ``or``, ``not``, chained comparisons and ``if`` become selections; both
ways of an ``if`` run, and what they write is merged. Primal operations keep their order, and hence their bits.

What Python cannot decide while tracing is an ``UntraceableError``: ``while``, a loop that is left under a computed condition,
rows that are computed, and functions that are neither helpers nor known.
"""

from __future__ import annotations

import ast
import builtins
import inspect
import math
import textwrap
from collections.abc import Callable
from typing import Any

import numpy as np

from birthsim_env.physics.compiled import exact
from birthsim_env.physics.gradients.graph import Graph, Scalar, Value


class UntraceableError(ValueError):
    """What cannot be differentiated, and why."""


MOST_PASSES = 8
"""Passes into which a loop is unrolled whose number is computed; each happens under the condition that it is asked for."""

_MASKS: list[Value] = []
"""Conditions of the ``if`` that are being traced: writes to arrays obey them."""


class Symbols(np.ndarray[Any, Any]):
    """An array of ``Value``, numbers and, where nothing is written yet, None. Writes obey the conditions of the moment."""

    def __setitem__(self, where: Any, value: Any) -> None:
        for mask in reversed(_MASKS):
            before = self[where]
            value = value if before is None else mask.graph.select(mask, value, before)
        super().__setitem__(where, value)


def inputs(graph: Graph, name: str, rows: int) -> Any:
    """The block ``name`` (rows, 1), of which all is read."""
    block = np.empty((rows, 1), dtype=object).view(Symbols)
    for row in range(rows):
        block[row, 0] = graph.input(name, row)
    return block


def empty(rows: int) -> Any:
    """A block (rows, 1) of which nothing is written yet."""
    return np.full((rows, 1), None, dtype=object).view(Symbols)


def _is_traced(value: Any) -> bool:
    if isinstance(value, (tuple, list)):
        return any(map(_is_traced, value))
    return isinstance(value, (Value, Symbols)) or isinstance(getattr(value, "rows", None), Symbols)


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
        _MASKS.append(mask)
        try:
            results.append(way())
        finally:
            _MASKS.pop()
    return _merged(condition, *results)


def passes(count: Any) -> range:
    """What a loop over ``range(count)`` goes through."""
    return range(MOST_PASSES) if isinstance(count, Value) else range(count)


def _extreme(name: str, values: Any) -> Scalar:
    result = values[0]
    for value in values[1:]:
        of = result if isinstance(result, Value) else value
        traced = isinstance(of, Value)
        result = of.graph.node(name, result, value) if traced else getattr(builtins, name)(result, value)
    return result


_UNARY: dict[Any, str] = {
    math.sqrt: "sqrt", math.isfinite: "isfinite", np.floor: "floor", int: "int", np.int64: "int", exact.exp: "exp",
    exact.exp2: "exp2", exact.log: "log", exact.log1p: "log1p", exact.tanh: "tanh", exact.sine: "sine", exact.cosine: "cosine",
}  # fmt: skip
"""Functions of one number that are operations of a graph."""

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
    if hasattr(function, "py_func"):
        return rewritten(function.py_func)(*arguments, **named)
    if function in (abs, len, zip, enumerate, range, slice) or isinstance(function, type) or inspect.ismethod(function):
        return function(*arguments, **named)
    raise UntraceableError(f"{getattr(function, '__name__', function)} of a computed value; allowed: helpers, +, -, *, /, sqrt")


def _call(name: str, *arguments: ast.expr) -> ast.Call:
    return ast.Call(ast.Name(f"__{name}", ast.Load()), list(arguments), [])


def _later(expression: ast.expr) -> ast.Lambda:
    return ast.Lambda(ast.arguments([], [], None, [], [], None, []), expression)


class _Rewriter(ast.NodeTransformer):
    """Rewrites what asks for a truth value."""

    def visit_IfExp(self, n: ast.IfExp) -> Any:
        return _call("select", self.visit(n.test), *(_later(self.visit(way)) for way in (n.body, n.orelse)))

    def visit_BoolOp(self, n: ast.BoolOp) -> Any:
        name = ast.Constant("and" if isinstance(n.op, ast.And) else "or")
        return _call("logic", name, *(_later(self.visit(value)) for value in n.values))

    def visit_UnaryOp(self, n: ast.UnaryOp) -> Any:
        self.generic_visit(n)
        return _call("denied", n.operand) if isinstance(n.op, ast.Not) else n

    def visit_Compare(self, n: ast.Compare) -> Any:
        self.generic_visit(n)
        if len(n.ops) == 1:
            return n
        sides = [n.left, *n.comparators]
        pairs = [_later(ast.Compare(a, [op], [b])) for a, op, b in zip(sides, n.ops, sides[1:], strict=False)]
        return _call("logic", ast.Constant("and"), *pairs)

    def visit_Call(self, n: ast.Call) -> Any:
        self.generic_visit(n)
        return ast.Call(ast.Name("__call", ast.Load()), [n.func, *n.args], n.keywords)

    def block(self, statements: list[ast.stmt]) -> list[ast.stmt]:
        """Statements with their loops and ``if`` rewritten."""
        done: list[ast.stmt] = []
        for k, statement in enumerate(statements):
            if isinstance(statement, ast.If):
                made, ends = self._if(statement, statements[k + 1 :])
                done += made
                if ends:
                    return done
            elif isinstance(statement, ast.For):
                done += self._for(statement, k)
            else:
                done.append(self.visit(statement))
        return done

    def _for(self, loop: ast.For, k: int) -> list[ast.stmt]:
        """A loop; over ``range(count)`` each pass happens only where the count asks for it."""
        called = loop.iter if isinstance(loop.iter, ast.Call) and ast.unparse(loop.iter.func) == "range" else None
        if called is None or len(called.args) != 1 or not isinstance(loop.target, ast.Name):
            return [ast.For(loop.target, self.visit(loop.iter), self.block(loop.body), [])]
        count, target = f"__n{k}_{loop.lineno}", loop.target.id
        target = f"__k{loop.lineno}" if target == "_" else target
        test = ast.Compare(ast.Name(target, ast.Load()), [ast.Lt()], [ast.Name(count, ast.Load())])
        leaves = any(isinstance(x, (ast.Break, ast.Continue, ast.Return)) for x in ast.walk(loop))
        body = self.block(loop.body if leaves else [ast.If(test, loop.body, [])])
        again = _call("passes", ast.Name(count, ast.Load()))
        return [
            ast.Assign([ast.Name(count, ast.Store())], self.visit(called.args[0])),
            ast.For(ast.Name(target, ast.Store()), again, body, []),
        ]

    def _if(self, statement: ast.If, rest: list[ast.stmt]) -> tuple[list[ast.stmt], bool]:
        """An ``if`` as two local functions; one that returns takes the statements after it into both of them."""
        if any(isinstance(x, (ast.Break, ast.Continue)) for x in ast.walk(statement)):
            test = _call("known", self.visit(statement.test))
            return [ast.If(test, self.block(statement.body), self.block(statement.orelse))], False
        leaves = any(isinstance(x, ast.Return) for x in ast.walk(statement))
        ways = [[*body, *(rest if leaves else [])] for body in (statement.body, statement.orelse)]
        changed = sorted({
            x.id for way in ways for s in way for x in ast.walk(s) if isinstance(x, ast.Name) and isinstance(x.ctx, ast.Store)
        })  # fmt: skip
        done: list[ast.stmt] = []
        for name, way in zip(("__yes", "__no"), ways, strict=True):
            head = f"def {name}({', '.join(f'{one}=__local(locals(), {one!r})' for one in changed)}): pass"
            function = ast.parse(head).body[0]
            assert isinstance(function, ast.FunctionDef)
            give = ast.Return(ast.Tuple([ast.Name(one, ast.Load()) for one in changed], ast.Load()))
            function.body = [*self.block([_copied(s) for s in way]), *([] if leaves else [give])]
            function.body = function.body or [ast.Pass()]
            done.append(function)
        merged = _call("branch", self.visit(statement.test), *(ast.Name(name, ast.Load()) for name in ("__yes", "__no")))
        if leaves:
            return [*done, ast.Return(merged)], True
        target = ast.Tuple([ast.Name(one, ast.Store()) for one in changed], ast.Store())
        return [*done, ast.Assign([target], merged) if changed else ast.Expr(merged)], False


def _copied(statement: ast.stmt) -> ast.stmt:
    return ast.parse(ast.unparse(ast.fix_missing_locations(statement))).body[0]


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
        definition.body = _Rewriter().block(definition.body)
        space = {**function.__globals__, **{f"__{name}": value for name, value in _NAMES.items()}}
        module = ast.fix_missing_locations(ast.Module([definition], []))
        exec(compile(module, f"<traced {function.__qualname__}>", "exec"), space)
        _REWRITTEN[function] = space[definition.name]
    return _REWRITTEN[function]
