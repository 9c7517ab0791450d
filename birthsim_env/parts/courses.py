"""The check of new episodes: what is asked for stays finite, reachable and stiff from their beginning to their end."""

import copy
import dataclasses
import math
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.signals import Motion, Setpoints
from birthsim_env.parts.drawn.seeding import is_vectorised
from birthsim_env.parts.references import Trajectory
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array, parameter_column
from birthsim_env.physics.geometry import inverse_geometry, well_inside
from birthsim_env.physics.plant import checked
from birthsim_env.physics.rig.parameters import Parameters

CHECKS = 64
"""Instants of a new episode at which its reference is checked."""

DRAWN = 1024
"""Trajectories out of those that can be drawn that are checked before any is."""

SPARE = 2e-4
"""m of each stroke, at either end, that those leave free: more than trajectories between them sag."""

TOGETHER = 16384
"""Instants times lanes that are sampled in one call: few enough to stay in a processor's cache."""


def checked_start(
    trajectory: Trajectory,
    stiffness: StiffnessSchedule,
    lanes: NDArray[np.intp],
    num_envs: int,
    duration: float,
    rig: Parameters,
    nominal: Array,
) -> Array:
    """What is asked of ``lanes`` (L,) as their episodes begin, rows of a ``Reference``, (15, L).

    Raises ``ValueError`` where it is not finite, leaves the workspace of ``rig``, or is no stiffness, within ``duration`` s.
    ``nominal`` (PARAMETERS,) is the rig's column.
    """
    motion = _sampler("reference", trajectory, Motion.size, lanes, num_envs)
    setpoints = _sampler("stiffness", stiffness, Setpoints.size, lanes, num_envs)
    instants, together = np.linspace(0.0, duration, CHECKS), max(1, TOGETHER // len(lanes))
    start = np.concatenate([motion(instants[:1]), setpoints(instants[:1])])
    groups = (instants[k : k + together] for k in range(0, CHECKS, together))
    if not all(_is_plain(Motion(motion(group)), Setpoints(setpoints(group)), nominal) for group in groups):
        _explain(trajectory, stiffness, lanes, num_envs, instants, rig)
    return start


class _Grid:
    """Stands for the streams of ``lanes`` lanes: the k-th number drawn is one of ``levels`` from low to high, by digit k."""

    def __init__(self, lanes: int, levels: int) -> None:
        self._numbers, self._levels, self.drawn = np.arange(lanes), levels, 0

    def uniform(self, low: float, high: float) -> Array:
        digit = self._numbers // self._levels**self.drawn % self._levels
        self.drawn += 1
        number: Array = low + (high - low) * digit / max(1, self._levels - 1)
        return number


def check_drawn(trajectory: Trajectory, duration: float, rig: Parameters) -> None:
    """Raises ``ValueError`` where a trajectory draws its numbers, and some of them would leave the workspace of ``rig``.

    Every number is tried at several values from the lowest to the highest, ``DRAWN`` trajectories in all, ``SPARE`` inside, so
    that what lies between them is inside too. A trajectory that draws nothing is checked as its episodes begin, and so is one
    of a user's own.
    """
    if not (is_vectorised(trajectory.begin) and is_vectorised(trajectory.sample)):
        return
    one, counted = copy.copy(trajectory), _Grid(1, 1)
    one.prepare(1)
    one.begin(np.zeros(1, dtype=np.intp), counted)  # type: ignore[arg-type]
    if counted.drawn == 0:
        return
    levels = max(2, int(DRAWN ** (1 / counted.drawn) + 1e-9))
    lanes = min(DRAWN, levels**counted.drawn)
    one.prepare(lanes)
    one.begin(np.arange(lanes), _Grid(lanes, levels))  # type: ignore[arg-type]
    tight = copy.copy(rig)
    for name in ("cylinder1", "cylinder2"):
        cylinder = getattr(rig, name)
        shorter = max(cylinder.stroke - 2 * SPARE, 0.5 * cylinder.stroke)
        object.__setattr__(tight, name, dataclasses.replace(cylinder, stroke=shorter))
    stiff, p = Setpoints(np.ones((Setpoints.size, lanes))), parameter_column(tight)
    stiff.stiffness_coupling[:] = 0.0
    for instant in np.linspace(0.0, duration, CHECKS):
        motion = one.sample(np.full(lanes, instant))
        if not _is_plain(Motion(motion), stiff, p):
            try:
                inverse_geometry(motion[:2], tight)
            except ValueError as error:
                raise ValueError(f"reference at {instant:.3g} s, of one that can be drawn: {error}") from None


def _sampler(name: str, part: Any, size: int, lanes: NDArray[np.intp], num_envs: int) -> Callable[[Array], Array]:
    """What gives the rows (size, K L) of a part at K instants, s; where the part can do that, of these lanes alone."""
    if not is_vectorised(part.sample):
        return lambda instants: np.concatenate(
            [_of_all(name, part, size, num_envs, instant).take(lanes, axis=1) for instant in instants], axis=1
        )

    @cache
    def repeated(times: int) -> Any:
        return part.some(np.tile(lanes, times))

    def sample(instants: Array) -> Array:
        rows: Array = repeated(len(instants)).sample(np.repeat(instants, len(lanes)))
        return rows

    return sample


def _of_all(name: str, part: Any, size: int, num_envs: int, instant: float) -> Array:
    return checked(f"{name}.sample(time)", part.sample(np.full(num_envs, instant)), (size, num_envs), "SI")


@kernel
def _is_plain(motion: Motion, asked: Setpoints, p: Array) -> bool:
    """Whether no lane is anywhere near what the check refuses."""
    doubtful = 0
    for i in range(motion.rows.shape[1]):
        size = 0.0
        for row in range(motion.rows.shape[0]):
            size += abs(motion.rows[row, i])
        for row in range(asked.rows.shape[0]):
            size += abs(asked.rows[row, i])
        kx, ky, kxy = asked.stiffness[0, i], asked.stiffness[1, i], asked.stiffness_coupling[i]
        softest = min(min(kx, ky), min(asked.pneumatic_stiffness[0, i], asked.pneumatic_stiffness[1, i]))
        inside = well_inside(motion.position[0, i], motion.position[1, i], p)
        doubtful += 0 if size < math.inf and not (softest <= 0.0 or kxy * kxy >= kx * ky) and inside else 1
    return doubtful == 0


def _explain(
    trajectory: Trajectory,
    stiffness: StiffnessSchedule,
    lanes: NDArray[np.intp],
    num_envs: int,
    instants: Array,
    rig: Parameters,
) -> None:
    """Raises ``ValueError`` with what is wrong first, if anything is."""
    points, asked = np.empty((2, CHECKS, len(lanes))), np.empty((7, CHECKS, len(lanes)))
    for k, instant in enumerate(instants):
        points[:, k] = _of_all("reference", trajectory, 8, num_envs, instant)[:2, lanes]
        asked[:, k] = _of_all("stiffness", stiffness, 7, num_envs, instant)[:, lanes]

    def first(wrong: Any) -> tuple[int, float]:
        k = int(wrong.any(axis=1).argmax())
        return k, float(instants[k])

    soft = (asked[:4] <= 0).any(axis=0)
    if soft.any():
        k, instant = first(soft)
        raise ValueError(f"stiffness.sample(time = {instant:g} s) = {asked[:4, k].min():g} N/m; allowed: more than 0")
    kx, ky, kxy = asked[0], asked[1], asked[6]
    coupled = kxy**2 >= kx * ky
    if coupled.any():
        k, instant = first(coupled)
        raise ValueError(
            f"stiffness.sample(time = {instant:g} s): Kclxy = {np.abs(kxy[k]).max():g} N/m; allowed: below sqrt(Kclx Kcly)"
        )
    for k, instant in enumerate(instants):
        try:
            inverse_geometry(points[:, k], rig)
        except ValueError as error:
            raise ValueError(f"reference at {instant:.3g} s: {error}") from error
