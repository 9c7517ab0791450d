"""A graph of scalar operations without control flow: what tracing a helper gives, and what derivatives are appended to.

Equal operations on equal arguments are one node, so what primal and derivative share is computed once. Operations on numbers
alone are no nodes: Python computes them, with the bits that a kernel has.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

CONDITIONS = frozenset({"<", ">", "<=", ">=", "==", "!=", "and", "or", "not", "isfinite"})
"""Operations whose result is a truth value. It has no derivative."""

STEPS = frozenset({"int", "uint", "bits", "floor", "%", "^", ">>", *CONDITIONS})
"""Operations that are constant but for jumps."""

MASKS: list[Value] = []
"""Conditions of the ``if`` that are being traced: writes to arrays obey them."""


class Value:
    """One scalar of a graph, the result of node ``at``."""

    __slots__ = ("at", "graph")
    __array_ufunc__ = None
    """NumPy's numbers leave operations with a ``Value`` to it."""

    def __init__(self, graph: Graph, at: int) -> None:
        self.graph, self.at = graph, at

    def __bool__(self) -> bool:
        raise TypeError("a branch on a computed value; allowed: if, conditional expressions, and, or, not")

    __hash__ = object.__hash__
    __add__, __radd__ = (lambda a, b: a.graph.node("+", a, b)), (lambda a, b: a.graph.node("+", b, a))
    __sub__, __rsub__ = (lambda a, b: a.graph.node("-", a, b)), (lambda a, b: a.graph.node("-", b, a))
    __mul__, __rmul__ = (lambda a, b: a.graph.node("*", a, b)), (lambda a, b: a.graph.node("*", b, a))
    __truediv__, __rtruediv__ = (
        (lambda a, b: a.graph.node("/", a, _divisor(b))),
        (lambda a, b: a.graph.node("/", b, _divisor(a))),
    )
    __neg__, __pos__, __abs__ = (lambda a: a.graph.node("neg", a)), (lambda a: a), (lambda a: a.graph.node("abs", a))
    __lt__, __gt__ = (lambda a, b: a.graph.node("<", a, b)), (lambda a, b: a.graph.node(">", a, b))
    __le__, __ge__ = (lambda a, b: a.graph.node("<=", a, b)), (lambda a, b: a.graph.node(">=", a, b))
    __mod__, __xor__ = (lambda a, b: a.graph.node("%", a, b)), (lambda a, b: a.graph.node("^", a, b))
    __rshift__, __pow__ = (lambda a, b: a.graph.node(">>", a, b)), (lambda a, b: a if b == 1 else a ** (b - 1) * a)

    def __eq__(self, other: object) -> Any:
        return self.graph.node("==", self, other)

    def __ne__(self, other: object) -> Any:
        return self.graph.node("!=", self, other)


Scalar = Any
"""A ``Value``, or a number that is known while tracing."""


class Graph:
    """``nodes`` are (operation, argument, ...); arguments are earlier values, or numbers."""

    def __init__(self) -> None:
        self.nodes: list[tuple[Any, ...]] = []
        self._known: dict[tuple[Any, ...], Value] = {}

    def node(self, operation: str, *arguments: Any) -> Value:
        """The value of an operation, a new one where there is none like it."""
        given = tuple(a if isinstance(a, (Value, str)) else _number(a) for a in arguments)
        key = (operation, *((a.at,) if isinstance(a, Value) else repr(a) for a in given))
        if key not in self._known:
            self.nodes.append((operation, *given))
            self._known[key] = Value(self, len(self.nodes) - 1)
        return self._known[key]

    def input(self, array: str, row: int) -> Value:
        """What a kernel reads from a row of an array."""
        return self.node("input", array, int(row))

    def select(self, condition: Value, yes: Scalar, no: Scalar) -> Scalar:
        """One of two numbers that are both at hand."""
        if yes is no or (not isinstance(yes, Value) and not isinstance(no, Value) and repr(_number(yes)) == repr(_number(no))):
            return no
        return self.node("where", condition, yes, no)

    def depends(self, sources: list[Value]) -> list[bool]:
        """For every node whether its derivative to any of the ``sources`` may be other than zero."""
        active = [False] * len(self.nodes)
        for value in sources:
            active[value.at] = True
        for k, (operation, *arguments) in enumerate(self.nodes):
            active[k] = active[k] or any(isinstance(a, Value) and active[a.at] for a in _smooth(operation, arguments))
        return active

    def within(self, values: Iterable[Scalar], smooth: bool = False) -> set[int]:
        """Nodes that ``values`` are made of; ``smooth``: those to which their derivative may be other than zero."""
        found, waiting = set[int](), [value.at for value in values if isinstance(value, Value)]
        while waiting:
            k = waiting.pop()
            if k not in found:
                found.add(k)
                operation, *arguments = self.nodes[k]
                waiting += [a.at for a in (_smooth(operation, arguments) if smooth else arguments) if isinstance(a, Value)]
        return found


def _smooth(operation: str, arguments: list[Any]) -> list[Any]:
    """The arguments to which an operation has a derivative."""
    return [] if operation in STEPS else arguments[1:] if operation == "where" else arguments


def _number(value: Any) -> Any:
    return value if isinstance(value, (bool, int, np.uint64)) else float(value)


def _divisor(value: Scalar) -> Scalar:
    """A divisor, within an ``if`` 1 instead of 0: where an ``if`` keeps from dividing by zero, gradients stay numbers."""
    return value.graph.select(value == 0.0, 1.0, value) if MASKS and isinstance(value, Value) else value
