"""How much of the rig's strength an episode asks for, whatever controls it.

On the compliant target each piston has to bear weight and inertia of the mass, the hand and its own friction. The chambers,
between atmosphere and supply, can push with (Ps - Pa) Sp and pull with (Ps - Pa) Sn. Where more is asked for than that, no
controller stays on the target.
"""

from copy import deepcopy
from typing import Any

import numpy as np

from birthsim_env.parts.hands.user_forces import forces_of
from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage.geometry import inverse_geometry, jacobian

FEASIBLE = 0.9
"""A world that asks for a larger fraction of its rig's strength counts as infeasible; assumed."""

STEP = 0.05
"""s between the instants that are looked at."""

MOVING = 1e-3
"""m/s; a slower piston may rest, and its friction then holds rather than loads it."""


def required_strength_ratio(env: Any) -> Array:
    """The largest fraction (N,) of what the cylinders can bear that the present episodes of a vector environment ask for.

    1 and more is beyond the rig. Forces of the hand are those at the places asked for; a compliant target that the rig cannot
    reach counts as infinite.
    """
    simulation = env.simulation
    p, rig = simulation.plant.lane_parameters, simulation.parameters
    lanes = p.shape[1]
    most: Array = np.zeros(lanes)
    spare = p[at.SUPPLY] - p[at.ATMOSPHERE]
    strength = spare * np.stack([[p[at.AREA_P1], p[at.AREA_P2]], [p[at.AREA_N1], p[at.AREA_N2]]])
    # Friction is that of a cylinder at its strength: one chamber at the supply's pressure, the other at the atmosphere's.
    full, friction, viscous = np.zeros((at.STATES, lanes)), np.empty((2, lanes)), np.stack([p[at.FV1], p[at.FV2]])
    full[[at.PP1, at.PP2]], full[[at.PN1, at.PN2]] = p[at.SUPPLY], p[at.ATMOSPHERE]
    duration = env.steps * simulation.period * simulation.periods
    hand = deepcopy(simulation.user_force)  # one with a memory must not remember this
    for instant in np.arange(0.0, duration, STEP):
        reference = simulation.reference_at(np.full(lanes, instant))
        force = forces_of(hand, np.full((1, lanes), instant), reference.position, reference.velocity)[0]
        place = reference.compliant_target(force)
        try:
            piston = inverse_geometry(place, rig)
        except ValueError:
            piston, reachable = _one_by_one(place, rig)
            most[~reachable] = np.inf
        columns = jacobian(piston, rig)
        speed: Array = np.linalg.solve(np.moveaxis(columns, 2, 0), reference.velocity.T[..., None])[..., 0].T
        load = p[at.MASS] * (reference.acceleration + np.stack([np.zeros(lanes), p[at.GRAVITY]])) - force
        needed: Array = np.einsum("jin,jn->in", columns, load) + viscous * speed
        full[[at.V1, at.V2]] = speed
        dynamics.coulomb_levels(full, p, friction)
        needed += np.where(np.abs(speed) > MOVING, np.sign(speed), 0.0) * friction
        np.maximum(most, np.where(needed > 0, needed / strength[0], -needed / strength[1]).max(axis=0), out=most)
    return most


def _one_by_one(place: Array, rig: Any) -> tuple[Array, Any]:
    """Piston positions (2, N), the middle where a place is out of reach, and which (N,) are within it."""
    piston, reachable = np.zeros_like(place), np.ones(place.shape[1], dtype=np.bool_)
    for lane in range(place.shape[1]):
        try:
            piston[:, lane] = inverse_geometry(place[:, lane], rig)
        except ValueError:
            reachable[lane] = False
    return piston, reachable
