"""What an episode draws, as one stage: the Python that draws it is run once, on symbols instead of numbers."""

import copy
import math
from typing import Any

import numpy as np

from birthsim_build.device.loops import pieces_of
from birthsim_build.device.program import Key, key_of
from birthsim_env.gradients.graph import Graph
from birthsim_env.gradients.source import Output, loop, module_of
from birthsim_env.gradients.symbols import Unknown
from birthsim_env.loop.stage import Stage
from birthsim_env.parts.drawn.frictions import LAW, OPTIONAL
from birthsim_env.parts.drawn.randomization import draw_rig
from birthsim_env.parts.drawn.seeding import STREAMS, is_vectorised
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.rows import rows_of
from birthsim_env.simulation import Simulation

HEAD = '''"""Generated: what an episode draws."""

import math

import numpy as np

from birthsim_build.code.drawing import bits, uniform
from birthsim_env.loop.rows import World
from birthsim_env.loop.stage import scratch, table2
from birthsim_env.loop.world import Start
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.gradients.source import choose, straight

'''

BEGIN = """

@kernel
def begin(world: World, seen: int, own: Start, constants: int, tables: int, lane: int, n: int) -> int:
"""


class Symbolic:
    """``Streams`` of one lane whose numbers are symbols of a ``graph``; a kernel of these ``lines`` draws them into rows."""

    def __init__(self, graph: Graph, part: str, stream: int) -> None:
        self.graph, self.lines, self._part, self._stream, self._drawn = graph, list[str](), part, stream, 0

    def generators(self) -> Any:
        """Asked for by what draws lane by lane."""
        raise ValueError(f"{self._part}, drawn in Python; allowed on a device: what draws for all lanes at once")

    def _next(self, kind: str, count: int, rows: str = "") -> Any:
        first = rows_in(self.graph)
        self.lines.append(f"{kind}(own, {self._stream}, {self._drawn}, drawn, {first}{rows}, n)")
        self._drawn += count
        values = np.empty((count, 1), dtype=object)
        values[:, 0] = [self.graph.input("drawn", first + k) for k in range(count)]
        return values.view(Unknown)

    def uniform(self, low: float = 0.0, high: float = 1.0, size: int | tuple[int, ...] = ()) -> Any:
        """``Streams.uniform``."""
        shape = (size,) if isinstance(size, int) else size
        count = math.prod(shape)
        drawn = self._next("uniform", count, f", {count}")
        return (float(low) + (float(high) - float(low)) * drawn).reshape(*shape, 1)

    def integers(self, high: int, dtype: type) -> Any:
        """``Streams.integers``."""
        return self._next("bits", 1)[0]


def rows_in(graph: Graph) -> int:
    """How many rows have been drawn: all inputs of a graph."""
    return sum(operation == "input" for operation, *_ in graph.nodes)


def drawing(simulation: Simulation) -> Stage:
    """A stage that draws the world of an episode whose seed and number are in the simulation's ``Start``, its memory.

    It writes rigs and tables, to the bits of ``Simulation.begin``. Raises ``ValueError`` for a part that draws in Python, and
    for a friction law with states that the rig as described has not: a device is built for one kind of plant.
    """
    if OPTIONAL in simulation.ranges.get(LAW, ()) and simulation.parameters.friction.law != OPTIONAL:
        raise ValueError(f"{LAW} drawn from {', '.join(simulation.ranges[LAW])}; allowed on a device: all but {OPTIONAL}")
    graph, outputs, tables, body = Graph(), list[Output](), list[Array](), list[str]()
    parts = {
        "reference": simulation.trajectory, "user_force": simulation.user_force, "stiffness": simulation.stiffness,
        "sensors": simulation.sensors,
    }  # fmt: skip
    placed = {key_of(table) for stage in pieces_of(simulation).stages for table in stage.tables}
    for number, name in enumerate(STREAMS):
        part = parts.get(name)
        streams: Any = Symbolic(graph, f"{name} = {type(part).__name__}", number)
        if part is not None:
            for table, symbols in _begun(part, placed, streams):
                written = [(row, value) for row, value in enumerate(symbols.reshape(-1)) if value is not None]
                outputs += [(f"table{len(tables)}", row, value) for row, value in written]
                tables += [table.view(np.float64).reshape(-1, table.shape[-1])] if written else []
        elif simulation.ranges:
            rig = draw_rig(simulation.parameters, simulation.ranges, streams)
            rows = (value[0] if np.ndim(value) else float(value) for value in rows_of(rig))
            outputs += [("rig", row, value) for row, value in enumerate(rows)]
        body += streams.lines
    names = [f"table{k}" for k in range(len(tables))]
    views = [f"table2(tables, {k})[:, mine]" for k in range(len(tables))]
    body = [f"mine, drawn = slice(lane, lane + n), scratch({max(1, rows_in(graph))})", *body]
    body += [f"fill({', '.join(['drawn', 'world.rig', *views, 'n'])})", "return 0"]
    text = HEAD + loop(graph, "fill", ["drawn", "rig", *names], outputs) + BEGIN + "".join(f"    {line}\n" for line in body)
    return Stage(module_of(text).begin, memory=simulation.start, tables=tuple(tables))


def _begun(part: Any, placed: set[Key], streams: Any) -> list[tuple[Array, Any]]:
    """The ``placed`` arrays of a part, and what its ``begin`` writes to them, for one lane."""
    if not is_vectorised(part.begin):
        streams.generators()
    own, arrays = copy.copy(part), []
    for name, array in vars(part).items():
        if isinstance(array, np.ndarray) and key_of(array) in placed:
            arrays.append((array, np.full((*array.shape[:-1], 1), None, dtype=object).view(Unknown)))
            setattr(own, name, arrays[-1][1])
    own.begin(np.zeros(1, dtype=np.intp), streams)
    return arrays
