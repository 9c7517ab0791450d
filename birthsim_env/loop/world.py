"""Stages of the world: the plant with its clock, and what jumps."""

from __future__ import annotations

import numpy as np

from birthsim_env.loop.rows import (
    FORCE,
    IMPACT,
    MOTION,
    OPENING,
    REFERENCE,
    SEEN,
    SINCE_JUMP,
    STATE,
    TICK,
    TIME,
    USER_FORCE,
    WORLD,
)
from birthsim_env.loop.stage import Stage, block, numbers, scratch
from birthsim_env.physics import dynamics, options, spools
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import PARAMETERS, STATES, Array
from birthsim_env.physics.geometry import end_effector_motion
from birthsim_env.physics.options import SCRATCH
from birthsim_env.physics.plant import Plant


@helper
def _tick(w: Array, s: Array, period: float, n: int) -> None:
    for i in range(n):
        w[TICK, i] += 1.0
        s[TIME, i] = w[TICK, i] * period


@helper
def _move(w: Array, s: Array, u: Array, about: Array, dx: Array, total: Array, trial: Array, n: int) -> None:
    """One control period under openings ``u`` (4, n); ``about``: its length, s, and integration steps in it."""
    x, p, hit = w[STATE : STATE + STATES], w[:PARAMETERS], w[IMPACT : IMPACT + 2]
    steps = int(about[1])
    dynamics.integrate(x, u, w[FORCE : FORCE + 2], p, steps, about[0] / steps, hit, dx, total, trial, n)
    dynamics.settle(x, n)
    _tick(w, s, about[0], n)
    end_effector_motion(x[:, :n], p[:, :n], w[MOTION : MOTION + 4, :n])


@kernel
def _plant(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Constants: control period, s; integration steps in it."""
    w, s, about = block(world, WORLD), block(seen, SEEN), numbers(constants, 2)
    dx, total, trial = scratch(STATES), scratch(STATES), scratch(STATES)
    _move(w, s, s[OPENING : OPENING + 4], about, dx, total, trial, n)
    return 0


@kernel
def _worn_plant(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """As ``_plant``, with valves that do not open as they are told; memory: their inner commands."""
    w, s, about = block(world, WORLD), block(seen, SEEN), numbers(constants, 2)
    dx, total, trial, u = scratch(STATES), scratch(STATES), scratch(STATES), scratch(4)
    spools.admit(s[OPENING : OPENING + 4], w[:PARAMETERS], block(memory, 4), u, n)
    _move(w, s, u, about, dx, total, trial, n)
    return 0


@kernel
def _optional_plant(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """As ``_worn_plant``, with the options of ``physics.options``; memory: inner commands and further states."""
    w, s, m, about = block(world, WORLD), block(seen, SEEN), block(memory, 4 + options.FURTHER), numbers(constants, 2)
    u, own, p, x = scratch(4), scratch(SCRATCH), w[:PARAMETERS], w[STATE : STATE + STATES]
    spools.admit(s[OPENING : OPENING + 4], p, m[:4], u, n)
    steps = int(about[1])
    options.integrate(
        x, m[4:], u, w[FORCE : FORCE + 2], p, steps, about[0] / steps, w[IMPACT : IMPACT + 2], own, n
    )  # fmt: skip
    _tick(w, s, about[0], n)
    options.port_motion(x[:, :n], m[4:, :n], p[:, :n], w[MOTION : MOTION + 4, :n])
    return 0


def plant_stage(plant: Plant, period: float) -> Stage:
    """The plant over one control ``period``, s, under the openings that are commanded and the force of the hand."""
    about = np.array([period, dynamics.steps_in(period)])
    if not options.are_off(plant.lane_parameters):
        return Stage(_optional_plant, about, plant.memory)
    perfect = spools.are_perfect(plant.lane_parameters)
    return Stage(_plant, about) if perfect else Stage(_worn_plant, about, plant.inner_commands)


@kernel
def _jumps(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Constants: period, s; what of a force's change in one is a jump, N; 1 to start counting the present instant."""
    w, s, last, about = block(world, WORLD), block(seen, SEEN), block(memory, 5), numbers(constants, 3)
    for i in range(n):
        since = w[SINCE_JUMP, i] + about[0]
        jumped = abs(w[FORCE, i] - last[0, i]) > about[1] or abs(w[FORCE + 1, i] - last[1, i]) > about[1]
        for k, row in ((2, 8), (3, 9), (4, 14)):
            jumped = jumped or s[REFERENCE + row, i] != last[k, i]
        w[SINCE_JUMP, i] = w[SINCE_JUMP, i] if about[2] > 0.0 else 0.0 if jumped else since
        last[0, i], last[1, i] = w[FORCE, i], w[FORCE + 1, i]
        last[2, i], last[3, i], last[4, i] = s[REFERENCE + 8, i], s[REFERENCE + 9, i], s[REFERENCE + 14, i]
    return 0


def jump_stage(period: float, jump_rate: float, memory: Array, begins: bool) -> Stage:
    """Counts the time since the force changed faster than ``jump_rate``, N/s, or a closed-loop setpoint changed at all.

    ``memory`` (5, N): force and setpoints a period ago; where an episode ``begins`` they are only remembered.
    """
    return Stage(_jumps, np.array([period, jump_rate * period, float(begins)]), memory)


@kernel
def _hide_force(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    s = block(seen, SEEN)
    for axis in range(2):
        for i in range(n):
            s[USER_FORCE + axis, i] = 0.0
    return 0


def no_force_stage() -> Stage:
    """A rig without a force sensor: what is measured of the hand's force is zero."""
    return Stage(_hide_force)
