"""Derivatives of ``dynamics.right_hand_side``, generated from its source: adjoints and the Jacobian of d(state)/dt.

``made`` is the generated module. Sources of gradients and tangents: state (18), openings (4), force of the hand (2), and with
``_rig`` those of the parameters ``RIG`` after them.
"""

from __future__ import annotations

from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.gradients.derivatives import reverse
from birthsim_env.physics.gradients.graph import Graph, Value
from birthsim_env.physics.gradients.source import HEAD, loop, module_of
from birthsim_env.physics.gradients.symbols import empty, inputs
from birthsim_env.physics.gradients.tracing import call

RIG = tuple(row for row in range(at.DEADBAND) if row not in (at.LUGRE, at.ELASTO_PLASTIC))
"""Rows of the parameters that there are gradients to: all of a rig without options and with valves that open as commanded."""

INPUTS = at.STATES + 4 + 2
EVERY = INPUTS + len(RIG)


CHAMBERS = tuple(zip(at.PRESSURES, at.TEMPERATURES, strict=True))
GROUPS = (tuple(set(range(at.STATES)) - set(at.PRESSURES + at.TEMPERATURES)), *CHAMBERS)
"""Rates whose slopes are a loop of their own: LLVM vectorises no loop that writes hundreds of rows."""


def _generated() -> tuple[str, tuple[tuple[int, int], ...]]:
    """Source of the module, and where its Jacobian is not zero: (rate, source), those of the state first.

    All its functions are over (rows, n). ``rates`` is the traced primal, in ``adjoint`` and ``adjoint_rig`` ``g`` weighs the
    rates. ``slopes`` and ``slopes_rig`` write the entries of the Jacobian, the first also the rates below them; ``carry``
    multiplies its part of the state with a tangent ``s`` (18, n).
    """
    graph = Graph()
    sizes = {"x": at.STATES, "u": 4, "f": 2, "p": at.PARAMETERS, "g": at.STATES}
    x, u, f, p, g = (inputs(graph, name, rows)[:, 0] for name, rows in sizes.items())
    dx = empty(at.STATES)
    call(dynamics.right_hand_side, x[:, None], u[:, None], f[:, None], p[:, None], dx, 1)
    rates, read = list(dx[:, 0]), ("x", "u", "f", "p")
    own = [*x, *u, *f]
    every = [*own, *p[list(RIG)]]
    texts = [loop(graph, "rates", (*read, "out"), [("out", row, rate) for row, rate in enumerate(rates)])]
    for name, sources in (("", own), ("_rig", every)):
        bars = reverse(graph, zip(rates, g, strict=True), sources)
        texts.append(loop(graph, f"adjoint{name}", (*read, "g", "out"), [("out", k, bar) for k, bar in enumerate(bars)]))
    rows = [reverse(graph, [(rate, 1.0)], every) for rate in rates]
    places = [(r, k) for k in range(EVERY) for r in range(at.STATES) if isinstance(rows[r][k], Value) or rows[r][k] != 0.0]
    written = [*((r, k, rows[r][k]) for r, k in places), *((r, 0, rate) for r, rate in enumerate(rates))]
    for name, first, last in (("", 0, INPUTS), ("_rig", INPUTS, EVERY)):
        calls = ""
        for k, group in enumerate(GROUPS):
            outputs = [("out", slot, value) for slot, (r, of, value) in enumerate(written) if r in group and first <= of < last]
            texts.append(loop(graph, f"slopes{name}{k}", (*read, "out"), outputs))
            calls += f"    slopes{name}{k}(x, u, f, p, out, n)\n"
        texts.append(f"@helper\ndef slopes{name}(x, u, f, p, out, n):\n{calls}")
    product, moved = Graph(), [0.0] * at.STATES
    s = inputs(product, "s", at.STATES)[:, 0]
    for slot, (r, k) in enumerate(places):
        if k < at.STATES:
            slope = product.input("j", slot) if isinstance(rows[r][k], Value) else rows[r][k]
            moved[r] = moved[r] + slope * s[k]
    texts.append(loop(product, "carry", ("j", "s", "out"), [("out", r, value) for r, value in enumerate(moved)]))
    return "\n\n".join([HEAD, *texts]), tuple(places)


GENERATED, ENTRIES = _generated()
made = module_of(GENERATED)
