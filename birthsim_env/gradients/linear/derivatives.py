"""Exact derivatives of the plant's rates and outputs at given states: traced from the source of its kernels.

At a kink, where a spool is shut or a piston at rest, a derivative is the mean of those of both sides. Central differences tend
to the same value, and so does the first harmonic of the answer to a small sine: the describing function of a characteristic of
slopes k- and k+ is (k- + k+)/2 at every amplitude.
"""

from functools import cache
from typing import Any

import numpy as np

from birthsim_env.gradients.derivatives import reverse
from birthsim_env.gradients.evaluated import evaluated
from birthsim_env.gradients.graph import Graph, Scalar
from birthsim_env.gradients.symbols import empty, inputs
from birthsim_env.gradients.tracing import call
from birthsim_env.physics import control_model, dynamics, options
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage import mechanics
from birthsim_env.physics.linkage.geometry import end_effector_motion
from birthsim_env.physics.pneumatics import tubes

KINKED = (at.V1, at.V2, *at.SPOOLS)
"""States that may stand on a kink: dry friction and orifices."""

STILL = range(at.STATES + options.FLOWS, at.STATES + options.BRISTLES)
"""The same of ``physics.options``: air in tubes, which carries the heat of where it comes from."""

BESIDE = 1e-300
"""Of such a state: on one side of zero, and nothing beside any other value."""


@cache
def _traced(has_options: bool) -> tuple[Graph, list[Scalar]]:
    """Rates (S) and outputs (12), and then the gradient of each to states, openings and force (S + 6)."""
    graph, size = Graph(), options.ALL if has_options else at.STATES
    x, u, f, p = (inputs(graph, name, rows) for name, rows in (("x", size), ("u", 4), ("f", 2), ("p", at.PARAMETERS)))
    rates, motion = empty(size), empty(4)
    if has_options:
        own, tube = empty(at.PARAMETERS), empty(tubes.CONSTANTS)
        call(options.alter, p, own, tube, 1)
        rates[at.STATES + options.BRISTLES :] = 0.0
        call(options.right_hand_side, x, u, f, own, tube, empty(4), empty(2), empty(2), rates, 1)
        call(options.port_motion, x[: at.STATES], x[at.STATES :], p, motion)
    else:
        call(dynamics.right_hand_side, x, u, f, p, rates, 1)
        call(end_effector_motion, x, p, motion)
    values = [*rates[:, 0], *motion[:, 0], *_of_air(x[:, 0], p[:, 0])]
    sources = [*x[:, 0], *u[:, 0], *f[:, 0]]
    return graph, values + [slope for value in values for slope in reverse(graph, [(value, 1.0)], sources)]


def _of_air(x: Any, p: Any) -> list[Scalar]:
    """Pneumatic forces (3) and stiffness (9) of the cylinders, and the pressures."""
    forces, stiffness = [], []
    first = at.PP1, at.PN1, at.Y1, [at.AREA_P1, at.AREA_N1, at.HALF_L1]
    second = at.PP2, at.PN2, at.Y2, [at.AREA_P2, at.AREA_N2, at.HALF_L2]
    for pp, pn, y, rows in (first, second):
        area_p, area_n, half = p[rows]
        forces.append(call(mechanics.piston_force, x[pp], x[pn], area_p, area_n, p[at.ATMOSPHERE]))
        lengths = half + x[y], half - x[y]
        stiffness.append(call(control_model.pneumatic_stiffness, x[pp], x[pn], area_p, area_n, *lengths, p[at.INDEX]))
    return [*forces, *stiffness, *x[list(at.PRESSURES)]]


def derivatives_of(x: Array, u: Array, f: Array, p: Array) -> tuple[Array, Array]:
    """Rates and outputs (S + 12, N), and their derivatives (N, S + 12, S + 6) to states (S, N), openings (4, N), force (2, N).

    S is 18, or with options of the rigs ``p`` (PARAMETERS, N) ``options.ALL``.
    """
    size, lanes = x.shape
    graph, wanted = _traced(size > at.STATES)
    both = np.concatenate([x, x], axis=1)
    both[[*KINKED, *(STILL if size > at.STATES else ())]] += np.repeat([BESIDE, -BESIDE], lanes)
    twice = {name: np.concatenate([block, block], axis=1) for name, block in (("u", u), ("f", f), ("p", p))}
    found = evaluated(graph, {"x": both, **twice}, wanted).reshape(len(wanted), 2, lanes).mean(axis=1)
    count = size + 12
    return found[:count], found[count:].T.reshape(lanes, count, size + 6)
