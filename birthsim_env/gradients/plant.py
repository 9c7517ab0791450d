"""Derivatives of the plant over some time: vector-Jacobian and Jacobian-vector products, in the words of JAX.

They are one-sided at kinks: a spool at zero, an orifice that begins to choke, a piston at its stop, a bristle whose piston
turns.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from birthsim_env.gradients import steps
from birthsim_env.gradients.right_hand_side import EVERY, INPUTS, RIG
from birthsim_env.physics import dynamics, options
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.blocks import BLOCK
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.plant import Plant, checked
from birthsim_env.physics.pneumatics import spools


@dataclass(frozen=True)
class Derivatives:
    """Gradients, or a tangent, of what a plant's new state depends on, SI units over N lanes.

    ``state`` (18, N) before, ``opening`` (4, N), ``force`` (K, 2, N) of every sample, and ``rig`` (PARAMETERS, N), rows of
    ``Plant.lane_parameters``: None where it was not asked for.
    """

    state: Array
    opening: Array
    force: Array
    rig: Array | None = None


def require_plain(plant: Plant) -> None:
    """Raise ``ValueError`` for a rig whose derivatives are not known, by name."""
    p, names = plant.lane_parameters, []
    if not options.are_off(p):
        names += [
            "air.supply_conductance",
            "chambers.tube_length",
            "mechanics.mode_frequency",
            "friction.law with the choice 'gms'",
        ]
    if not spools.are_perfect(p):
        names += ["valves.hysteresis", "valves.opening_limit"]
    if names:
        raise ValueError(f"gradients of a rig with one of {', '.join(names)}; allowed: these at their defaults")


def vjp(plant: Plant, command: Array, forces: Array, duration: float) -> Callable[..., Derivatives]:
    """``plant.advance_unchecked``, with its bits; returns the pullback ``f(gradient, rig=False)``.

    It gives ``Derivatives`` of the sum of ``gradient`` (18, N) times the state that was reached, with ``rig`` also to the rig.
    """
    require_plain(plant)
    held = duration / len(forces)
    count = dynamics.steps_in(held)
    step = held / count
    blocks, rig_rows = -(-plant.num_envs // BLOCK), plant.lane_parameters.copy()
    tape = np.empty((blocks, len(forces) * count, at.STATES, BLOCK))
    steps.advance(plant.state, command, forces, rig_rows, count, step, plant.impacts, tape)

    def pullback(gradient: ArrayLike, rig: bool = False) -> Derivatives:
        late = checked("gradient", gradient, plant.state.shape, "1/SI")
        result, by_force = np.empty((EVERY, plant.num_envs)), np.empty_like(forces)
        steps.backward(tape, command, forces, rig_rows, count, step, late, by_force, rig, result)
        return Derivatives(result[: at.STATES], result[at.STATES : INPUTS - 2], by_force, _spread(result) if rig else None)

    return pullback


def jvp(plant: Plant, command: Array, forces: Array, duration: float, along: Derivatives) -> Array:
    """``plant.advance_unchecked``, with its bits; returns the tangent of the new state (18, N) ``along`` that of the rest."""
    require_plain(plant)
    held = duration / len(forces)
    count = dynamics.steps_in(held)
    tangent = np.zeros((EVERY, plant.num_envs))
    tangent[: at.STATES], tangent[at.STATES : INPUTS - 2] = along.state, along.opening
    if along.rig is not None:
        tangent[INPUTS:] = along.rig[list(RIG)]
    by_force = np.ascontiguousarray(np.broadcast_to(along.force, forces.shape))
    steps.advance_tangent(plant.state, command, forces, plant.lane_parameters, count, held / count, tangent, by_force)
    return tangent[: at.STATES]


def _spread(result: Array) -> Array:
    """Gradients to the rows of a rig; those of options and laws of friction, which there are none to, are zero."""
    rows = np.zeros((at.PARAMETERS, result.shape[1]))
    rows[list(RIG)] = result[INPUTS:]
    return rows
