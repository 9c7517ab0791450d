"""Reverse and forward mode on a graph: the operations of a vector-Jacobian or a Jacobian-vector product are appended to it.

At kinks derivatives are one-sided: of a tie in ``max(a, b)`` or ``min(a, b)`` they are those of ``a``, of ``abs(0)`` that of
its negative side; the square root of 0 has slope 0. So a spool at zero opens both of its orifices, either of which it can.
What a converter rounds passes as it is (straight through).
"""

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from birthsim_env.gradients.graph import Graph, Scalar, Value

Term = tuple[Any, Scalar]
"""An argument of a node, and a number times the node's derivative to it."""

ONE = 1.0


def _divided(graph: Graph, y: Value, a: Any, b: Any, g: Scalar) -> list[Term]:
    if not isinstance(a, Value):
        return [(b, -(g * y) * (y if a == 1.0 else y / a))]
    over = g / b
    return [(a, over), (b, -(over * y))]


def _larger(graph: Graph, first: Value, a: Any, b: Any, g: Scalar) -> list[Term]:
    return [(a, graph.select(first, g, 0.0)), (b, graph.select(first, 0.0, g))]


def _chosen(graph: Graph, y: Value, condition: Value, a: Any, b: Any, g: Scalar) -> list[Term]:
    if isinstance(b, Value) and graph.nodes[b.at][0] == "neg" and graph.nodes[b.at][1] is a:
        return [(a, graph.select(condition, g, -g))]
    return _larger(graph, condition, a, b, g)


RULES: dict[str, Callable[..., list[Term]]] = {
    "+": lambda graph, y, a, b, g: [(a, g), (b, g)],
    "-": lambda graph, y, a, b, g: [(a, g), (b, -g)],
    "*": lambda graph, y, a, b, g: [(a, g * b), (b, g * a)],
    "/": _divided,
    "neg": lambda graph, y, a, g: [(a, -g)],
    "sqrt": lambda graph, y, a, g: [(a, graph.select(y > 0.0, 0.5 * g / y, 0.0))],
    "abs": lambda graph, y, a, g: [(a, graph.select(a > 0.0, g, -g))],
    "max": lambda graph, y, a, b, g: _larger(graph, a >= b, a, b, g),
    "min": lambda graph, y, a, b, g: _larger(graph, a <= b, a, b, g),
    "where": _chosen,
    "copysign": lambda graph, y, a, b, g: [(a, graph.select(a == y, g, -g))],
    "rounded": lambda graph, y, a, step, g: [(a, g)],
    "exp": lambda graph, y, a, g: [(a, g * y)],
    "exp2": lambda graph, y, a, g: [(a, g * y * math.log(2.0))],
    "log": lambda graph, y, a, g: [(a, g / a)],
    "log1p": lambda graph, y, a, g: [(a, g / (1.0 + a))],
    "tanh": lambda graph, y, a, g: [(a, g * (1.0 - y * y))],
    "sine": lambda graph, y, a, g: [(a, g * graph.node("cosine", a))],
    "cosine": lambda graph, y, a, g: [(a, -(g * graph.node("sine", a)))],
}  # fmt: skip


def _terms(graph: Graph, k: int, g: Scalar, active: list[bool]) -> list[tuple[Value, Scalar]]:
    """The terms of node ``k`` that count."""
    operation, *arguments = graph.nodes[k]
    terms = RULES[operation](graph, Value(graph, k), *arguments, g)
    return [(a, what) for a, what in terms if isinstance(a, Value) and a.at < len(active) and active[a.at]]


def reverse(graph: Graph, outputs: Iterable[tuple[Scalar, Scalar]], sources: list[Value]) -> list[Scalar]:
    """Gradients to ``sources`` of the sum of every output (value, weight) times its weight."""
    active = graph.depends(sources)
    bars: dict[int, Scalar] = {}

    def add(to: Any, what: Scalar) -> None:
        if isinstance(to, Value) and active[to.at]:
            bars[to.at] = bars[to.at] + what if to.at in bars else what

    for value, weight in outputs:
        add(value, weight)
    wanted = {value.at for value in sources}
    for k in range(len(active) - 1, -1, -1):
        if k in bars and k not in wanted:
            for argument, what in _terms(graph, k, bars[k], active):
                add(argument, what)
    return [bars.get(value.at, 0.0) for value in sources]


def forward(graph: Graph, outputs: Iterable[Scalar], seeds: Mapping[Value, Scalar]) -> list[Scalar]:
    """Tangents of ``outputs`` for tangents ``seeds`` of the sources."""
    active = graph.depends(list(seeds))
    dots: dict[int, Scalar] = {value.at: seed for value, seed in seeds.items()}

    def of(value: Any) -> Scalar:
        return dots.get(value.at, 0.0) if isinstance(value, Value) else 0.0

    for k in range(len(active)):
        if active[k] and k not in dots:
            operation, *arguments = graph.nodes[k]
            if operation in ("where", "max", "min"):
                a, b = arguments[-2:]
                condition = arguments[0] if operation == "where" else a >= b if operation == "max" else a <= b
                dots[k] = graph.select(condition, of(a), of(b))
            else:
                parts = [of(a) if slope is ONE else slope * of(a) for a, slope in _terms(graph, k, ONE, active)]
                dots[k] = sum(parts[1:], parts[0])
    return [of(value) for value in outputs]
