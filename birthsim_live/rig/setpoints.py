"""Stiffness setpoints of one lane: the scenario's, or those that a person has chosen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.physics.compiled.lanes import Array
from birthsim_live.rig.bridge import Fade

TRANSITION = 0.05
"""s, assumed: setpoints that a person changes pass over in this time, with the rates that laws need."""

VALUES, RATES = [0, 1, 2, 3, 6], [4, 5]
"""Rows of a sample that are setpoints (Kclx, Kcly, Kpneu1, Kpneu2, Kclxy), and rates of the third and fourth."""


class Setpoints(StiffnessSchedule):
    """A scenario's schedule since ``begins`` s, or what ``choose`` put in its place; every change passes over smoothly."""

    def __init__(self, schedule: StiffnessSchedule) -> None:
        self._schedule = schedule
        self.begins = 0.0
        self._chosen: Array | None = None
        self._fade: Fade | None = None

    def prepare(self, num_envs: int) -> None:
        self._schedule.prepare(num_envs)

    def begin(self, lane: int, rng: np.random.Generator) -> None:
        self._schedule.begin(lane, rng)
        self.begins, self._fade = 0.0, None

    def sample(self, time: Array) -> Array:
        if self._chosen is None:
            rows = np.asarray(self._schedule.sample(time - self.begins))
        else:
            rows = np.zeros((7, len(time)))
            rows[:4] = self._chosen[:, None]
        now = float(time[0])
        if self._fade is not None and not self._fade.over(now):
            offset, rate = self._fade.sample(now)
            rows[VALUES] += offset[:, None]
            rows[RATES] += rate[2:4, None]
        return rows

    def follow(self, schedule: StiffnessSchedule, rng: np.random.Generator, now: float) -> None:
        """From ``now``, s, on ask for what another schedule (or the same one anew) asks for, unless values are chosen."""
        before = self._at(now)
        schedule.prepare(1)
        schedule.begin(0, rng)
        self._schedule, self.begins = schedule, now
        self._pass_over(before, now)

    def choose(self, values: Sequence[float] | None, now: float) -> None:
        """From ``now``, s, on ask for Kclx, Kcly, Kpneu1, Kpneu2, N/m; None gives them back to the schedule."""
        before = self._at(now)
        self._chosen = None if values is None else np.array(values)
        self._pass_over(before, now)

    def scenario(self, now: float) -> Array:
        """What the schedule itself asks for at ``now`` s, (7,)."""
        return np.asarray(self._schedule.sample(np.array([now - self.begins])))[:, 0]

    def _at(self, now: float) -> Array:
        return self.sample(np.array([now]))[VALUES, 0]

    def _pass_over(self, before: Array, now: float) -> None:
        self._fade = None
        offset = before - self._at(now)
        self._fade = Fade(now, TRANSITION, offset) if offset.any() else None
