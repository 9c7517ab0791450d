"""Smooth passages: of the target from one scenario to the next, and of setpoints and forces that would jump."""

from __future__ import annotations

import numpy as np

from birthsim_env.parts.references import Trajectory
from birthsim_env.physics.compiled.lanes import Array

LEAST_TIME, PACE = 0.5, 0.1
"""s and m/s, assumed: a target passes over in the least time and a second for every 0.1 m: with 0.15 m/s at most."""

NEGLIGIBLE = 1e-9
"""SI: offsets below it, and derivatives, are rounding."""


class Bridge:
    """An offset that starts with a value and three derivatives, ``offset`` (8, N) as in ``Trajectory.sample``, at ``begins`` s
    and has come to rest at zero ``lasts`` s later: a polynomial of degree 7, whose jerk is continuous."""

    def __init__(self, begins: float, lasts: float, offset: Array) -> None:
        self.begins, self.lasts = begins, lasts
        scale = np.array([1.0, lasts, lasts**2, lasts**3])
        start = offset.reshape(4, 2, -1) * scale[:, None, None]
        low = start / np.array([1.0, 1.0, 2.0, 6.0])[:, None, None]
        # Coefficients 4 to 7 make value and three derivatives zero at u = 1.
        powers = np.arange(8)
        rows = np.array([powers**0, powers, powers * (powers - 1), powers * (powers - 1) * (powers - 2)], dtype=np.float64)
        high = np.linalg.solve(rows[:, 4:], -np.einsum("rc,cxn->rxn", rows[:, :4], low).reshape(4, -1)).reshape(low.shape)
        self._coefficients: Array = np.concatenate([low, high])

    def sample(self, time: float) -> Array:
        """The offset and three derivatives, (8, N), at ``time`` s; zero once it has ended."""
        u = max((time - self.begins) / self.lasts, 0.0)
        coefficients = self._coefficients
        rows = np.zeros((4, *coefficients.shape[1:]))
        if u < 1.0:
            for order in range(4):
                value = coefficients[-1]
                for c in coefficients[-2::-1]:
                    value = c + u * value
                rows[order] = value / self.lasts**order
                coefficients = coefficients[1:] * np.arange(1.0, len(coefficients))[:, None, None]
        return rows.reshape(8, -1)


class Course(Trajectory):
    """The target of one lane: a scenario's trajectory, since ``begins`` s, reached over a bridge from what was before."""

    def __init__(self, trajectory: Trajectory) -> None:
        self._trajectory = trajectory
        self.begins = 0.0
        self._bridge: Bridge | None = None

    def prepare(self, num_envs: int) -> None:
        self._trajectory.prepare(num_envs)

    def begin(self, lane: int, rng: np.random.Generator) -> None:
        self._trajectory.begin(lane, rng)
        self.begins, self._bridge = 0.0, None

    def sample(self, time: Array) -> Array:
        rows = np.asarray(self._trajectory.sample(time - self.begins))
        return rows if self._bridge is None else rows + self._bridge.sample(float(time[0]))

    def follow(self, trajectory: Trajectory, rng: np.random.Generator, now: float) -> None:
        """From ``now``, s, on follow another trajectory (or the same one anew) from its start."""
        instant = np.array([now])
        before = self.sample(instant).copy()
        trajectory.prepare(1)
        trajectory.begin(0, rng)
        self._trajectory, self.begins, self._bridge = trajectory, now, None
        offset = before - self.sample(instant)
        if np.abs(offset).max() > NEGLIGIBLE:
            self._bridge = Bridge(now, LEAST_TIME + float(np.hypot(*offset[:2, 0])) / PACE, offset)

    def path(self, duration: float, points: int) -> Array:
        """Where the trajectory itself goes within ``duration`` s, m, (points, 2)."""
        instants = np.linspace(0.0, duration, points)
        return np.concatenate([self._trajectory.sample(np.array([t]))[:2] for t in instants], axis=1).T


class Fade:
    """An offset that fades to zero over ``lasts`` s at minimum jerk, so that what jumped passes over."""

    def __init__(self, begins: float, lasts: float, offset: Array) -> None:
        self._begins, self._lasts, self._offset = begins, lasts, offset

    def sample(self, time: float) -> tuple[Array, Array]:
        """The offset left at ``time`` s, and its rate per s."""
        u = min(max((time - self._begins) / self._lasts, 0.0), 1.0)
        # As in ``references.minimum_jerk``, whose first call from Python would hold the rig up by half a second of compiling.
        passed, rate = u * u * u * (10.0 + u * (6.0 * u - 15.0)), 30.0 * u * u * (1.0 - u) * (1.0 - u)
        return self._offset * (1.0 - passed), -self._offset * rate / self._lasts

    def over(self, time: float) -> bool:
        """True once nothing is left."""
        return time >= self._begins + self._lasts
