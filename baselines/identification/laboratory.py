"""An experiment on simulated rigs: plan, law, sensors, and the log that a laboratory would have of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from baselines.controller import Controller, checked_command
from baselines.identification.experiment import Plan
from baselines.identification.trial import Trial
from birthsim_env.loop.signals import REFERENCES, Measurement, Reference
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.parts.own_parts import Through
from birthsim_env.parts.sensors.sensors import SENSORS, put_out
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.physics.geometry import inverse_geometry
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters

STIFFNESS = 3000.0
"""N/m asked of the law in both directions; laws that know no stiffness ignore it."""

PNEUMATIC = (4400.0, 2200.0)
"""N/m asked of the pneumatic stiffness."""


def run_plan(
    plan: Plan, rigs: Sequence[Parameters], controller: Controller, sensors: str, seed: int,
    tick: Callable[[], Any] = lambda: None,
) -> list[Trial]:  # fmt: skip
    """What a log of every rig would hold; lane i has the sensors of ``seed`` + i. ``tick`` is called once per control period.

    Rigs have the control period of the first. Raises ``ValueError`` where a piston hits its end stop, with the rig's number.
    """
    lanes, period = len(rigs), rigs[0].electronics.control_period
    plant, models = Plant(list(rigs), lanes), [SENSORS[sensors](rig.electronics, 1) for rig in rigs]
    for lane, model in enumerate(models):
        model.begin(0, stream(seed + lane, 0, "sensors"))
    path = Through(plan.times, plan.target.T)
    rows = np.zeros((REFERENCES, lanes))
    rows[8:10], rows[10:12] = STIFFNESS, np.transpose([PNEUMATIC])
    piston = inverse_geometry(plan.target[:, :1], rigs[0])
    plant.state = balanced_state(plant.lane_parameters, np.repeat(piston, lanes, axis=1), None, rows[10:12].copy())
    controller.reset()
    count = int((plan.times[-1] - plan.times[0]) / period)
    openings, pressures, positions = np.empty((count, 4, lanes)), np.empty((count, 4, lanes)), np.empty((count, 2, lanes))
    still = np.zeros((1, 2, lanes))
    for k in range(count):
        now = plan.times[0] + k * period
        rows[:8] = path.sample(np.full(1, now))
        seen = _measured(models, k, k * period, plant)
        added = plan.added[:, np.searchsorted(plan.times, now + 1e-9) - 1]
        wanted = checked_command("law", controller.command(seen, Reference(rows)), lanes) + added[:, None]
        command = np.clip(wanted, -1.0, 1.0)
        pressures[k], positions[k], openings[k] = seen.pressures, seen.position, command
        ticks = np.full(1, k)
        reached = [put_out(model, ticks, command[:, [lane]]) for lane, model in enumerate(models)]
        plant.advance_unchecked(np.ascontiguousarray(np.concatenate(reached, axis=1)), still, period)
        hit = plant.impacts.max(axis=0) > 0
        if hit.any():
            raise ValueError(
                f"a piston of rig {int(np.argmax(hit))} hits its end stop after {k * period:.3g} s; allowed: a law and a plan "
                "that keep the pistons within their strokes"
            )
        tick()
    times = plan.times[0] + period * np.arange(count)
    return [
        Trial(times, openings[:, :, k].T.copy(), pressures[:, :, k].T.copy(), positions[:, :, k].T.copy(), np.zeros((2, count)))
        for k in range(lanes)
    ]


def _measured(models: Sequence[Any], tick: int, now: float, plant: Plant) -> Measurement:
    """What the sensors of all lanes say, one model a lane."""
    motion, pressures, clock = plant.end_effector(), plant.pressures, np.full(1, now)
    said: list[Measurement] = []
    for k, model in enumerate(models):
        lane = (np.ascontiguousarray(values[:, [k]]) for values in (motion, pressures))
        said.append(model.measure(np.full(1, tick), clock, *lane, np.zeros((2, 1))))

    def joined(name: str) -> Array:
        return np.concatenate([getattr(one, name) for one in said], axis=-1)

    return Measurement(
        joined("time"), joined("position"), joined("position_time"), joined("velocity"), joined("pressures"),
        joined("user_force"), said[0].sampled, None if said[0].acceleration is None else joined("acceleration"),
    )  # fmt: skip
