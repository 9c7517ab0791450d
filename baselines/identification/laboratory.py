"""An experiment on simulated rigs: plan, law, sensors, and the log that a laboratory would have of it."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from baselines.bench.resting import RestingRigs
from baselines.controller import Controller
from baselines.identification.experiment import PNEUMATIC, Plan
from baselines.identification.log.rail_log import on_rail
from baselines.identification.log.trial import Trial
from birthsim_env.loop.signals import REFERENCES, Reference
from birthsim_env.loop.stage import Part
from birthsim_env.parts.points import Through
from birthsim_env.physics.rig.parameters import Parameters

STIFFNESS = 3000.0
"""N/m asked of the law in both directions; laws that know no stiffness ignore it."""


def run_plan(
    plan: Plan,
    rigs: Sequence[Parameters],
    controller: Controller,
    sensors: str,
    seed: int,
    tick: Callable[[], Any] = lambda: None,
    carry: Callable[[RestingRigs], Part] | None = None,
) -> list[Trial]:
    """What a log of every rig would hold; rig i has the sensors of ``seed`` + i. ``tick`` is called once per control period.

    ``carry`` makes of the rigs at rest what moves in the plant's place.

    Raises ``ValueError`` where a piston hits its end stop, with the rig's number.
    """
    return [_run(plan, rig, number, controller, sensors, seed + number, tick, carry) for number, rig in enumerate(rigs)]


def _run(
    plan: Plan,
    rig: Parameters,
    number: int,
    controller: Controller,
    sensors: str,
    seed: int,
    tick: Callable[[], Any],
    carry: Callable[[RestingRigs], Part] | None,
) -> Trial:
    # A plan's rows are those of a multisine, which passes them between two of them; cut to its rows it would jerk there.
    rows, path = np.zeros((REFERENCES, 1)), Through(plan.times, plan.target.T, within=False)
    rows[:2], rows[8:10], rows[10:12] = plan.target[:, :1], STIFFNESS, np.transpose([PNEUMATIC])
    loop = RestingRigs([rig], Reference(rows), controller, sensors, seed, name="law")
    period, start = loop.period, plan.times[0]
    count = int((plan.times[-1] - start) / period)
    openings, pressures, positions = np.empty((4, count)), np.empty((4, count)), np.empty((2, count))

    stiffness = np.array([np.interp(start + period * np.arange(count + 1), plan.times, one) for one in plan.asked()])

    def follow(k: int) -> None:
        loop.asked[:8] = path.sample(np.full(1, start + k * period))
        loop.asked[10:12, 0], loop.asked[12:14, 0] = stiffness[:, k], (stiffness[:, k + 1] - stiffness[:, k]) / period

    def add(k: int) -> None:
        added = plan.added[:, np.searchsorted(plan.times, start + k * period + 1e-9) - 1]
        loop.opened[:] = np.clip(loop.opened + added[:, None], -1.0, 1.0)
        seen = loop.measurement
        pressures[:, k], positions[:, k], openings[:, k] = seen.pressures[:, 0], seen.position[:, 0], loop.opened[:, 0]

    def look(k: int) -> None:
        if loop.impacts.max() > 0:
            raise ValueError(
                f"a piston of rig {number} hits its end stop after {k * period:.3g} s; allowed: a law and a plan that keep the "
                "pistons within their strokes"
            )
        tick()

    loop.close([follow], [add], [*([carry(loop)] if carry else loop.pipeline.group("plant")), look])
    loop.run(count)
    counted = np.full(2, rig.electronics.encoder_offset) if sensors.startswith("encoders") else None
    times, forces = start + period * np.arange(count), np.zeros((2, count))
    trial = Trial(times, openings, pressures, positions, forces, counted=counted)
    return on_rail(trial, rig) if rig.linkage.is_rail else trial
