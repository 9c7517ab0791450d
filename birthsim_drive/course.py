"""What a drive asks for in every control period: an identification's plan, a scenario's target and stiffness, or to rest.

All is worked out before the rig moves, so that the control loop only reads rows.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from baselines.identification.experiment import MARGIN, PNEUMATIC, STIFFNESS, read_plan
from birthsim_drive.plain import in_python
from birthsim_env.loop.signals import Motion, Reference
from birthsim_env.parts.references import minimum_jerk
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters

PACE = 0.1
"""m/s in the mean, assumed: the end effector is led to where a course begins no faster, however short the ramp."""

smooth = in_python(minimum_jerk)
"""From 0 to 1, or a derivative."""


@dataclass(frozen=True)
class Course:
    """T control periods: ``references`` (15, T), see ``Reference``, and openings ``added`` (4, T) to the controller's."""

    references: Array
    added: Array
    period: float

    def __len__(self) -> int:
        return int(self.references.shape[1])

    def at(self, time: float) -> int:
        """The period in which a ``time``, s since the course began, lies."""
        return min(max(int(time / self.period + MARGIN), 0), len(self) - 1)


def of_plan(path: Path, rig: Parameters) -> Course:
    """The course of an experiment that ``birthsim identify --propose`` wrote."""
    period = rig.electronics.control_period
    _, rows, added = read_plan(path, rig).periods(period)
    return Course(rows, added, period)


def of_scenario(environment: str, rig: Parameters, seed: int, duration: float | None, **arguments: Any) -> Course:
    """What a scenario asks for in the episode of a seed; its hand is the one that is there."""
    period = rig.electronics.control_period
    env: Any = gymnasium.make(environment, parameters=rig, policy_period=period, **arguments)
    try:
        env.reset(seed=seed)
        lasts = env.get_wrapper_attr("duration") if duration is None else duration
        simulation = env.unwrapped.simulation
        times = period * np.arange(round(lasts / period))
        rows = np.hstack([simulation.reference_at(np.full(1, time)).rows for time in times])
    finally:
        env.close()
    return Course(np.ascontiguousarray(rows), np.zeros((4, len(times))), period)


def resting(position: Array, rig: Parameters, duration: float) -> Course:
    """To stay where the end effector is, (2,), m, for ``duration`` s."""
    period = rig.electronics.control_period
    one = Reference.lane(position=position, stiffness=STIFFNESS, pneumatic_stiffness=PNEUMATIC)
    count = round(duration / period)
    return Course(np.repeat(one[:, None], count, axis=1), np.zeros((4, count)), period)


class Lead:
    """The way of the target from ``position`` (2,), m, at rest, to where ``course`` begins, in ``lasts`` s at minimum jerk.

    Without a ``ramp``, s, it takes no time.
    """

    def __init__(self, course: Course, position: Array, ramp: float) -> None:
        self._first, self._from = course.references[:, 0], position.copy()
        self._way = self._first[:2] - position
        self.lasts = max(ramp, math.hypot(*self._way.tolist()) / PACE) if ramp > 0.0 else 0.0

    def at(self, time: float) -> Array:
        """The reference (15,) at a ``time``, s, since the way began."""
        row, part = self._first.copy(), time / self.lasts
        for order in range(4):
            row[2 * order : 2 * order + 2] = self._way * (smooth(part, order) / self.lasts**order)
        row[:2] += self._from
        return row


def hold(reference: Array) -> None:
    """Let a reference (15,) stay where it is."""
    reference[2 : Motion.size] = 0.0
    Reference(reference).pneumatic_stiffness_rate[:] = 0.0
