"""The loops in Python: what every target is compared with."""

from typing import Any

import gymnasium
import numpy as np

from baselines.driving import Driving, driving
from baselines.named import make_controller
from birthsim_build.layout import LAYOUT
from birthsim_env import Measurement, Parameters, Plant, Reference
from birthsim_env.loop.rows import ASKED, IMPACT, OPENING, SEEN, WORLD
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.compiled.lanes import STATES, Array

PERIODS = 2000
"""Control periods of a comparison: 200 policy steps of 10 ms."""

SHARED = [*range(IMPACT), *range(IMPACT + 2, WORLD + ASKED), *range(WORLD + OPENING, WORLD + OPENING + 4)]
"""Rows that are compared: all of the world and of what is measured, asked for and commanded. Impacts begin anew in Python."""

CHAMBERS = ("P1", "N1", "P2", "N2")


class OneValve(Driving):
    """A controller, called back, with one valve per cylinder: it gets half the difference of its chambers' openings."""

    def openings(self, plant: Plant, measurement: Measurement, reference: Reference) -> Array:
        opened = super().openings(plant, measurement, reference)
        half = (opened[::2] - opened[1::2]) / 2
        return np.stack([half[0], -half[0], half[1], -half[1]])


def whole_rows(
    scenario: str,
    sensors: str,
    controller: str,
    periods: int = PERIODS,
    exchange: Any = None,
    valves: str = "two_valves",
    rig: Parameters | None = None,
    **world: Any,
) -> Array:
    """Rows of world and seen before the first control period and after each, (1 + periods, WORLD + SEEN).

    The scenario is nominal. ``exchange`` {"at", "controller"} puts another controller in its place; controllers
    believe in ``rig``; ``world`` are arguments of the environment.
    """

    def drives(name: str) -> Driving:
        law = make_controller(name, rig or Parameters())
        return OneValve(law, name, {}) if valves == "one_valve" else driving(law, name)

    period = Parameters().electronics.control_period
    own = {"sensors": sensors, "policy_period": period, "actuation": drives(controller), **world}
    env: Any = gymnasium.make_vec(environment_id(scenario), num_envs=1, **own)
    env.reset(seed=0)
    simulation, rows = env.unwrapped.simulation, np.empty((1 + periods, WORLD + SEEN))
    for k, row in enumerate(rows):
        if k:
            simulation.step(simulation.action)
        row[:] = np.concatenate(simulation.rows())[:, 0]
        if exchange and exchange["at"] == k:
            simulation.actuation = drives(exchange["controller"])
    return rows


def loop_rows(*case: Any, **options: Any) -> Array:
    """Rows of world and seen after each control period, (periods, WORLD + SEEN): arguments of ``whole_rows``."""
    return whole_rows(*case, **options)[1:]


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
    """What a law saw in a closed loop before each period (periods, ASKED), and the openings that it commanded (periods, 4)."""
    seen = whole_rows("circle", sensors, controller, periods)[:, WORLD:]
    return seen[:-1, :ASKED], seen[1:, OPENING : OPENING + 4]


def as_inputs(seen: Array) -> dict[str, Array]:
    """What a law sees, (periods, ASKED), as rows by name."""
    return {row.name: seen[:, row.number - WORLD] for row in LAYOUT if WORLD <= row.number < WORLD + ASKED}


def first_difference(one: Array, other: Array) -> int | None:
    """The first period in which a bit differs; None where none does."""
    same = np.ascontiguousarray(one).view(np.int64) == np.ascontiguousarray(other).view(np.int64)
    return None if same.all() else int(np.argmin(same.all(axis=1)))
