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

RIG = tuple(row for row in range(at.DEADBAND) if row not in (at.LUGRE, at.GMS, at.BRISTLED, at.ATTRACTION))
"""Rows of the parameters that there are gradients to: all of a rig without options and with valves that open as commanded."""

INPUTS = at.STATES + 4 + 2
EVERY = INPUTS + len(RIG)


def generated() -> str:
    """Source of the module: a traced primal, adjoints (``g`` weighs the rates) and tangents (along ``s``), all (rows, n)."""
    graph = Graph()
    sizes = {"x": at.STATES, "u": 4, "f": 2, "p": at.PARAMETERS, "g": at.STATES, "s": EVERY}
    x, u, f, p, g, s = (inputs(graph, name, rows)[:, 0] for name, rows in sizes.items())
    dx = empty(at.STATES)
    call(dynamics.right_hand_side, x[:, None], u[:, None], f[:, None], p[:, None], dx, 1)
    rates, read = list(dx[:, 0]), ("x", "u", "f", "p")
    own = [*x, *u, *f]
    every = [*own, *p[list(RIG)]]
    texts = [loop(graph, "rates", (*read, "out"), [("out", row, rate) for row, rate in enumerate(rates)])]
    for name, sources in (("", own), ("_rig", every)):
        bars = reverse(graph, zip(rates, g, strict=True), sources)
        texts.append(loop(graph, f"adjoint{name}", (*read, "g", "out"), [("out", k, bar) for k, bar in enumerate(bars)]))
    dots = forward(graph, rates, dict(zip(every, s, strict=True)))
    both = [*(("out", k, dot) for k, dot in enumerate(dots)), *(("out", at.STATES + k, rate) for k, rate in enumerate(rates))]
    texts.append(loop(graph, "tangent_rig", (*read, "s", "out"), both))
    return "\n\n".join([HEAD, *texts])


GENERATED = generated()
made = module_of(GENERATED)
