"""Derivatives of ``dynamics.right_hand_side``, generated from its source: adjoints and tangents of d(state)/dt.

``made`` is the generated module. Rows of gradients and tangents: state (18), openings (4), force of the hand (2), and with
``_rig`` those of the parameters ``RIG`` after them.
"""

from birthsim_env.gradients.derivatives import forward, reverse
from birthsim_env.gradients.graph import Graph
from birthsim_env.gradients.source import HEAD, loop, module_of
from birthsim_env.gradients.symbols import empty, inputs
from birthsim_env.gradients.tracing import call
from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled import lanes as at

INPUTS = at.STATES + 4 + 2


class Traced:
    """The right-hand side on symbols: its rates, what they depend on, and which rows of the rig have a part in them."""

    def __init__(self) -> None:
        self.graph = graph = Graph()
        sizes = {"x": at.STATES, "u": 4, "f": 2, "p": at.PARAMETERS, "g": at.STATES}
        x, u, f, self.rig, self.weights = (inputs(graph, name, rows)[:, 0] for name, rows in sizes.items())
        dx = empty(at.STATES)
        call(dynamics.right_hand_side, x[:, None], u[:, None], f[:, None], self.rig[:, None], dx, 1)
        self.rates, self.own = list(dx[:, 0]), [*x, *u, *f]
        smooth = graph.within(self.rates, smooth=True)
        self.rows = tuple(row for row, one in enumerate(self.rig) if one.at in smooth)

    def source(self) -> str:
        """The module: a traced primal, adjoints (``g`` weighs the rates) and tangents (along ``s``), all (rows, n)."""
        graph, read, every = self.graph, ("x", "u", "f", "p"), [*self.own, *self.rig[list(self.rows)]]
        along = inputs(graph, "s", len(every))[:, 0]
        texts = [loop(graph, "rates", (*read, "out"), [("out", row, rate) for row, rate in enumerate(self.rates)])]
        for name, sources in (("", self.own), ("_rig", every)):
            bars = reverse(graph, zip(self.rates, self.weights, strict=True), sources)
            texts.append(loop(graph, f"adjoint{name}", (*read, "g", "out"), [("out", k, bar) for k, bar in enumerate(bars)]))
        dots = forward(graph, self.rates, dict(zip(every, along, strict=True)))
        both = [("out", k, dot) for k, dot in enumerate(dots)]
        both += [("out", at.STATES + k, rate) for k, rate in enumerate(self.rates)]
        texts.append(loop(graph, "tangent_rig", (*read, "s", "out"), both))
        return "\n\n".join([HEAD, *texts])


TRACED = Traced()
RIG = TRACED.rows
"""Rows of the parameters that there are gradients to: all that a rig without options computes with, but its law of friction."""
EVERY = INPUTS + len(RIG)
GENERATED = TRACED.source()
made = module_of(GENERATED)
