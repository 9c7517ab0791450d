"""The loops in Python: what every target is compared with."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np

from baselines.controller import Controller
from baselines.registry import make_controller
from birthsim_build.layout import LAYOUT
from birthsim_env import Measurement, Parameters, Plant, Reference
from birthsim_env.loop.rows import ASKED, IMPACT, OPENING, SEEN, WORLD, measurement_of
from birthsim_env.loop.rows import REFERENCE as ASKS
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.compiled.lanes import STATES, Array

PERIODS = 2000
"""Control periods of a comparison: 200 policy steps of 10 ms."""

SHARED = [*range(IMPACT), *range(IMPACT + 2, WORLD + ASKED), *range(WORLD + OPENING, WORLD + OPENING + 4)]
"""Rows that are compared: all of the world and of what is measured, asked for and commanded. Impacts begin anew in Python."""

CHAMBERS = ("P1", "N1", "P2", "N2")


def make_law(controller: str) -> Controller:
    """A controller by the name that it has in a bundle."""
    kind, _, policy = controller.partition(":")
    return make_controller(kind, Parameters(), **({"policy": policy} if policy else {}))


def loop_rows(
    scenario: str, sensors: str, controller: str, periods: int = PERIODS, exchange: Any = None, **world: Any
) -> Array:
    """Rows of world and seen after each control period (periods, WORLD + SEEN) of the nominal scenario under a controller.

    ``exchange`` {"at", "controller"} puts another controller in its place; ``world`` are arguments of the environment.
    """
    period = Parameters().electronics.control_period
    env: Any = gymnasium.make_vec(environment_id(scenario), num_envs=1, sensors=sensors, policy_period=period, **world)
    env.reset(seed=0)
    law, simulation = make_law(controller), env.unwrapped.simulation
    rows = np.empty((periods, WORLD + SEEN))
    for k, row in enumerate(rows):
        if exchange and exchange["at"] == k:
            law = make_law(exchange["controller"])
        opened = law.command(simulation.measurement, simulation.reference)
        if simulation.actuation.size == 2:
            opened = (opened[[0, 2]] - opened[[1, 3]]) / 2
        simulation.step(np.ascontiguousarray(opened))
        row[:] = np.concatenate(simulation.rows())[:, 0]
    return rows


def plant_states(periods: int = PERIODS) -> tuple[dict[str, Array], Array]:
    """The plant under random openings and forces, each for 10 periods: rows to set, and the states (periods, 18)."""
    rng = np.random.default_rng(0)
    openings, forces = (
        np.repeat(rng.uniform(-most, most, (periods // 10, n)), 10, axis=0) for most, n in ((0.3, 4), (30.0, 2))
    )
    plant, states = Plant(), np.empty((periods, STATES))
    for state, opening, force in zip(states, openings, forces, strict=True):
        state[:] = plant.advance(opening[:, None], force[:, None], 0.001)[:, 0]
    inputs = {f"opening_{name}": openings[:, k] for k, name in enumerate(CHAMBERS)}
    return {**inputs, "force_x": forces[:, 0], "force_y": forces[:, 1]}, states


def law_openings(controller: str, sensors: str, periods: int = PERIODS) -> tuple[Array, Array]:
    """A law alone on what it saw in a closed loop: what it sees (periods, ASKED) and the openings (periods, 4)."""
    seen = loop_rows("circle", sensors, controller, periods)[:, WORLD : WORLD + ASKED]
    law, openings = make_law(controller), np.empty((periods, 4))
    for opened, now in zip(openings, seen, strict=True):
        said: Measurement = measurement_of(now[:, None], sensors != "ideal", False)
        opened[:] = law.command(said, Reference(now[ASKS:ASKED, None]))[:, 0]
    return seen, openings


def as_inputs(seen: Array) -> dict[str, Array]:
    """What a law sees, (periods, ASKED), as rows by name."""
    return {row.name: seen[:, row.number - WORLD] for row in LAYOUT if WORLD <= row.number < WORLD + ASKED}


def first_difference(one: Array, other: Array) -> int | None:
    """The first period in which a bit differs; None where none does."""
    same = np.ascontiguousarray(one).view(np.int64) == np.ascontiguousarray(other).view(np.int64)
    return None if same.all() else int(np.argmin(same.all(axis=1)))
