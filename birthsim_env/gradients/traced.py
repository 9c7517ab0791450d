"""The adjoint of a stage, generated from its source.

A stage is traced for one lane. What it reads and writes of the world, of what is seen and of its memory are rows of the space
that ``loop.Loop`` lays out, and rows of its tables count on from there. Constants are numbers while tracing, so that options
cost nothing.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from birthsim_env.gradients import source, symbols, tracing
from birthsim_env.gradients.derivatives import reverse
from birthsim_env.gradients.graph import Graph, Scalar, Value
from birthsim_env.gradients.tracing import UntraceableError
from birthsim_env.loop import stage as stages
from birthsim_env.loop.rows import SEEN, WORLD
from birthsim_env.loop.stage import Stage, layouts_of

HEAD = f"""{source.HEAD}from birthsim_env.loop.stage import block, scratch
from birthsim_env.physics.dynamics import copy

"""

KERNEL = """

@kernel
def adjoint(tape, bars, out, rig, constants, lane, n):
    a, b, o = scratch({reads}), scratch({rows}), scratch({rows})
    copy(block(tape, {reads}), a, n)
    copy(block(bars, {rows}), b, n)
    back(a, b, o, n)
    copy(o, block(out, {rows}), n)
    return 0
"""


@dataclass
class Adjoint:
    """How the bars of a stage go back: its ``function``, and the rows whose bars it takes and gives.

    The rows that it ``reads`` of the space are kept on the tape before the stage, or ``after`` it. It computes in ``room``
    rows behind the bars that it gives.
    """

    function: Callable[..., int]
    reads: list[int]
    rows: list[int]
    constants: Any = None
    after: bool = False
    room: int = 0


@dataclass
class Traced:
    """A stage as a graph: values read (``inputs``) and written (``outputs``) by row of the space and of tables."""

    name: str
    graph: Graph
    inputs: dict[int, Value]
    outputs: dict[int, Scalar]

    def depends(self, active: set[int]) -> set[int]:
        """Rows whose values depend on those of ``active`` rows after this stage."""
        live = self.graph.depends([value for row, value in self.inputs.items() if row in active])
        return {row for row, value in self.outputs.items() if isinstance(value, Value) and live[value.at]}

    def feeds(self, live: set[int]) -> set[int]:
        """Rows on which what this stage writes to ``live`` rows depends."""
        needed = self.graph.within((value for row, value in self.outputs.items() if row in live), smooth=True)
        return {row for row, value in self.inputs.items() if value.at in needed}

    def adjoint(self, live: set[int]) -> Adjoint | None:
        """Its adjoint for the bars of ``live`` rows; None for a stage that changes none of these."""
        rows, graph = sorted(live & (self.outputs.keys() | self.feeds(live))), self.graph
        if not rows:
            return None
        bars = {row: graph.input("b", k) for k, row in enumerate(rows)}
        weighed = [(self.outputs.get(row, self.inputs.get(row)), bars[row]) for row in rows]
        sources = [row for row in rows if row in self.inputs]
        found = dict(zip(sources, reverse(graph, weighed, [self.inputs[row] for row in sources]), strict=True))
        results = [("o", k, found.get(row, 0.0)) for k, row in enumerate(rows)]
        used = graph.within(found.values())
        reads = [row for row, value in self.inputs.items() if value.at in used]
        # What is read gets its place on the tape.
        for k, row in enumerate(reads):
            graph.nodes[self.inputs[row].at] = ("input", "a", k)
        text = source.loop(graph, "back", ("a", "b", "o"), results)
        text = HEAD + text + KERNEL.format(reads=max(1, len(reads)), rows=len(rows))
        return Adjoint(source.module_of(text).adjoint, reads, rows)


class _Place:
    """Where a stage is handed an address instead of named rows."""

    def __init__(self, rows: Any) -> None:
        self.rows = rows


class _Tables:
    """The tables of a stage, of one lane; ``place`` says at which row each stands."""

    def __init__(self, graph: Graph, tables: tuple[Any, ...], place: Callable[[Any, bool], int]) -> None:
        self._graph, self._tables, self._place = graph, tables, place
        self.made: dict[str, tuple[int, Any]] = {}

    def get(self, k: int, lanes_first: bool) -> Any:
        name, shape = f"t{k}", self._tables[k].shape
        if name not in self.made:
            shape = (1, *shape[1:]) if lanes_first else (*shape[:-1], 1)
            block = symbols.inputs(self._graph, name, math.prod(shape)).reshape(shape)
            self.made[name] = self._place(self._tables[k], lanes_first), block
        return self.made[name][1]


def _block(place: _Place, rows: int) -> Any:
    return place.rows[:rows]


def _table(tables: _Tables, k: int) -> Any:
    return tables.get(k, False)


def _singles(tables: _Tables, k: int) -> Any:
    return tables.get(k, True)


tracing.INSTEAD[stages.block] = tracing.INSTEAD[stages.numbers] = _block
tracing.INSTEAD[stages.singles] = _singles
for _kind in (stages.table1, stages.table2, stages.table3, stages.table4):
    tracing.INSTEAD[_kind] = _table


def trace(stage: Stage, memory: int, place: Callable[[Any, bool], int]) -> Traced:
    """A stage whose memory begins at row ``memory`` of the space, and each of its tables where ``place`` says, as a graph.

    ``place(table, lanes_first)`` raises ``ValueError`` for a table whose lanes are not its first or last axis. Raises
    ``ValueError`` that names a stage that cannot be traced.
    """
    graph = Graph()
    sizes = {"w": (0, WORLD), "s": (WORLD, SEEN), "m": (memory, 0 if stage.memory is None else stage.memory.shape[0])}
    blocks = {name: (first, symbols.inputs(graph, name, rows)) for name, (first, rows) in sizes.items()}
    tables = _Tables(graph, stage.tables, place)
    layouts: list[Any] = layouts_of(stage.function)
    constants = np.array([*stage.constants], dtype=object).view(symbols.Symbols)
    handed = (*(block for _, block in blocks.values()), constants, tables, 0, 1)
    arguments = [
        value if k in (5, 6) or value is tables else layouts[k](value) if layouts[k] else _Place(value)
        for k, value in enumerate(handed)
    ]
    name = f"{stage.function.__module__}.{getattr(stage.function, '__name__', stage.function)}"
    try:
        tracing.rewritten(getattr(stage.function, "py_func", stage.function))(*arguments)
    except (UntraceableError, TypeError, AttributeError, IndexError, ValueError, KeyError) as error:
        raise ValueError(f"stage {name} cannot be differentiated ({error}); allowed: stages of the package") from error
    inputs, outputs = dict[int, Value](), dict[int, Scalar]()
    for of, (first, block) in {**blocks, **tables.made}.items():
        for row, value in enumerate(block.reshape(-1)):
            inputs[first + row] = graph.input(of, row)
            if value is not inputs[first + row]:
                outputs[first + row] = value
    return Traced(name, graph, inputs, outputs)
