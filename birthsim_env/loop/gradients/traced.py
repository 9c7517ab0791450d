"""The adjoint of a stage, generated from its source.

A stage is traced for one lane. What it reads and writes of the world, of what is seen and of its memory are rows of the space
that ``loop.Loop`` lays out; tables are read as they are and get no gradient, and what is written to a table is an output with a
gradient of its own. Constants are numbers while tracing, so that options cost nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from birthsim_env.loop import stage as stages
from birthsim_env.loop.rows import SEEN, WORLD
from birthsim_env.loop.stage import Stage, address_of, layouts_of
from birthsim_env.physics.gradients import source, tracing
from birthsim_env.physics.gradients.derivatives import reverse
from birthsim_env.physics.gradients.graph import Graph, Scalar, Value
from birthsim_env.physics.gradients.tracing import Symbols, UntraceableError

HEAD = f"""{source.HEAD}from birthsim_env.loop.stage import block, scratch

"""

KERNEL = """

@kernel
def adjoint(tape, bars, out, rig, constants, lane, n):
    given, weighs = block(tape, {reads}), block(bars, {rows})
    a, b, o = scratch({reads}), scratch({rows}), scratch({rows})
    for row in range({reads}):
        for i in range(n):
            a[row, i] = given[row, i]
    for row in range({rows}):
        for i in range(n):
            b[row, i] = weighs[row, i]
    back(a, b, o, n)
    result = block(out, {rows})
    for row in range({rows}):
        for i in range(n):
            result[row, i] = o[row, i]
    return 0
"""


@dataclass
class Adjoint:
    """How the bars of a stage go back: ``address`` of its code, and the rows whose bars it takes and gives.

    The rows that it ``reads`` of the space are kept on the tape before the stage, or ``after`` it.
    """

    address: int
    reads: list[int]
    rows: list[int]
    constants: Any = None
    after: bool = False


@dataclass
class Traced:
    """A stage as a graph: values read (``inputs``) and written (``outputs``) by row of the space.

    ``extras`` are those written to tables, by their rows.
    """

    name: str
    graph: Graph
    inputs: dict[int, Value]
    outputs: dict[int, Scalar]
    extras: dict[int, Scalar] = field(default_factory=dict)

    def depends(self, active: set[int]) -> set[int]:
        """Rows whose values depend on those of ``active`` rows after this stage."""
        sources = [value for row, value in self.inputs.items() if row in active]
        live = self.graph.depends(sources)
        outputs = {**self.outputs, **self.extras}
        return {row for row, value in outputs.items() if isinstance(value, Value) and live[value.at]}

    def adjoint(self, active: set[int]) -> Adjoint:
        """Its adjoint for rows that are ``active`` before or after it."""
        outputs = {**self.outputs, **self.extras}
        rows = sorted(active & (outputs.keys() | self.inputs.keys()))
        graph = self.graph
        bars = {row: graph.input("b", k) for k, row in enumerate(rows)}
        now = {row: outputs.get(row, self.inputs.get(row)) for row in rows}
        sources = {row: self.inputs[row] for row in rows if row in self.inputs}
        weighed = [(value, bars[row]) for row, value in now.items()]
        found = dict(zip(sources, reverse(graph, weighed, list(sources.values())), strict=True))
        results = [("o", k, found.get(row, 0.0)) for k, row in enumerate(rows)]
        used = _used(graph, (value for _, _, value in results))
        reads = [row for row, value in self.inputs.items() if value.at in used]
        # What is read gets its place on the tape.
        for k, row in enumerate(reads):
            graph.nodes[self.inputs[row].at] = ("input", "a", k)
        text = source.loop(graph, "back", ("a", "b", "o"), results)
        text = HEAD + text + KERNEL.format(reads=max(1, len(reads)), rows=len(rows))
        return Adjoint(address_of(source.module_of(text).adjoint), reads, rows)


def _used(graph: Graph, values: Iterable[Scalar]) -> set[int]:
    """Nodes that values are made of."""
    used, waiting = set[int](), [value.at for value in values if isinstance(value, Value)]
    while waiting:
        k = waiting.pop()
        if k not in used:
            used.add(k)
            waiting += [a.at for a in graph.nodes[k][1:] if isinstance(a, Value)]
    return used


class _Place:
    """Where a stage is handed an address instead of named rows."""

    def __init__(self, rows: Any) -> None:
        self.rows = rows


class _Tables:
    """The tables of a stage, of one lane: rows that are written are outputs, and nothing is read before."""

    def __init__(self, tables: tuple[Any, ...]) -> None:
        self._tables = tables
        self.made: dict[int, Any] = {}

    def get(self, k: int, lanes_first: bool) -> Any:
        if k not in self.made:
            shape = self._tables[k].shape
            shape = (1, *shape[1:]) if lanes_first else (*shape[:-1], 1)
            self.made[k] = np.full(shape, None, dtype=object).view(Symbols)
        return self.made[k]


def _block(place: _Place, rows: int) -> Any:
    return place.rows[:rows]


def _table(tables: _Tables, k: int) -> Any:
    return tables.get(k, False)


def _singles(tables: _Tables, k: int) -> Any:
    return tables.get(k, True)


tracing.INSTEAD[stages.scratch] = tracing.empty
tracing.INSTEAD[stages.block] = tracing.INSTEAD[stages.numbers] = _block
tracing.INSTEAD[stages.singles] = _singles
for _kind in (stages.table1, stages.table2, stages.table3, stages.table4):
    tracing.INSTEAD[_kind] = _table


def trace(stage: Stage, memory: int, extra: int = 0, wanted: Callable[[int, int], bool] = lambda table, row: False) -> Traced:
    """A stage whose memory begins at row ``memory`` of the space, as a graph.

    Rows of tables for which ``wanted(table, row)`` holds are outputs, numbered from ``extra`` on. Raises ``ValueError`` that
    names a stage that cannot be traced.
    """
    graph = Graph()
    sizes = {"w": WORLD, "s": SEEN, "m": 0 if stage.memory is None else stage.memory.shape[0]}
    blocks = {name: tracing.inputs(graph, name, rows) if rows else tracing.empty(1) for name, rows in sizes.items()}
    firsts = {"w": 0, "s": WORLD, "m": memory}
    inputs = {firsts[name] + row: blocks[name][row, 0] for name, rows in sizes.items() for row in range(rows)}
    tables = _Tables(stage.tables)
    layouts: list[Any] = layouts_of(stage.function)
    handed = (*blocks.values(), stage.constants, tables, 0, 1)
    arguments = [
        value if k in (5, 6) or value is tables else layouts[k](value) if layouts[k] else _Place(value)
        for k, value in enumerate(handed)
    ]
    name = f"{stage.function.__module__}.{getattr(stage.function, '__name__', stage.function)}"
    try:
        tracing.rewritten(getattr(stage.function, "py_func", stage.function))(*arguments)
    except (UntraceableError, TypeError, AttributeError, IndexError, ValueError, KeyError) as error:
        raise ValueError(
            f"stage {name} cannot be differentiated ({error}); allowed: ideal sensors and compiled laws"
        ) from error
    now = {firsts[of] + row: blocks[of][row, 0] for of, rows in sizes.items() for row in range(rows)}
    outputs = {row: value for row, value in now.items() if value is not inputs[row]}
    extras: dict[int, Scalar] = {}
    for k, made in sorted(tables.made.items()):
        for row, value in enumerate(made.reshape(-1)):
            if wanted(k, row) and value is not None:
                extras[extra + len(extras)] = value
    return Traced(name, graph, inputs, outputs, extras)
