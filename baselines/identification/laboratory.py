"""An experiment on simulated rigs: plan, law, sensors, and the log that a laboratory would have of it."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from baselines.bench.resting import RestingRigs
from baselines.controller import Controller
from baselines.identification.experiment import PNEUMATIC, STIFFNESS, Plan
from baselines.identification.log.rail_log import on_rail
from baselines.identification.log.trial import Trial
from birthsim_env.loop.signals import Reference
from birthsim_env.loop.stage import Part
from birthsim_env.physics.rig.parameters import Parameters


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
    rest = Reference.lane(position=plan.target[:, 0], stiffness=STIFFNESS, pneumatic_stiffness=PNEUMATIC)
    loop = RestingRigs([rig], Reference(rest[:, None]), controller, sensors, seed, name="law")
    period = loop.period
    times, asked, added = plan.periods(period)
    count = len(times)
    openings, pressures, positions = np.empty((4, count)), np.empty((4, count)), np.empty((2, count))

    def follow(k: int) -> None:
        loop.asked[:, 0] = asked[:, k]

    def add(k: int) -> None:
        loop.opened[:] = np.clip(loop.opened + added[:, k : k + 1], -1.0, 1.0)
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
    trial = Trial(times, openings, pressures, positions, np.zeros((2, count)), counted=counted)
    return on_rail(trial, rig) if rig.linkage.is_rail else trial
