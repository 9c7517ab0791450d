"""The check of new episodes: what is asked for stays finite, reachable and stiff from their beginning to their end.

A user's points are checked as an environment is made, every one of them."""

import copy
import dataclasses
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.signals import Motion, Setpoints
from birthsim_env.parts.drawn.seeding import is_vectorised
from birthsim_env.parts.hands.user_forces import ForceProfile, UserForce
from birthsim_env.parts.points import Through
from birthsim_env.parts.references import Trajectory
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.parts.times import Timed, check_times
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage.geometry import inverse_geometry
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
) -> Array:
    """What is asked of ``lanes`` (L,) as their episodes begin, rows of a ``Reference``, (15, L).

    Raises ``ValueError`` where it is not finite, leaves the workspace of ``rig``, or is no stiffness, within ``duration`` s.
    """
    motion = _sampler("reference", trajectory, Motion.size, lanes, num_envs)
    setpoints = _sampler("stiffness", stiffness, Setpoints.size, lanes, num_envs)
    instants, together = np.linspace(0.0, duration, CHECKS), max(1, TOGETHER // len(lanes))
    start = np.concatenate([motion(instants[:1]), setpoints(instants[:1])])
    for k in range(0, CHECKS, together):
        group = instants[k : k + together]
        _check(group, motion(group), setpoints(group), rig)
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
    for instant in np.linspace(0.0, duration, CHECKS):
        try:
            inverse_geometry(one.sample(np.full(lanes, instant))[:2], tight)
        except ValueError as error:
            raise ValueError(f"reference at {instant:.3g} s, of one that can be drawn: {error}") from None


HASTE = 2.0
"""Times the steady speed of a piston that points may ask for: for a moment air is compressed instead of let out; assumed."""


def check_points(said: str, trajectory: Trajectory, duration: float, rig: Parameters) -> None:
    """Points of a user's, of which those within ``duration`` s must be in the workspace of ``rig``, no farther apart than it
    moves.

    A piston's steady speed is that at which its chamber N lets its air out through a choked valve, C p0 / A. Raises
    ``ValueError`` that begins with what is ``said`` of the argument and names the row of the point, or both.
    """
    if not isinstance(trajectory, Through):
        return
    inside = np.flatnonzero((trajectory.times >= 0.0) & (trajectory.times <= duration))
    if len(inside) == 0:
        return  # between two rows
    times, points, first = trajectory.times[inside], trajectory.points[inside], int(inside[0]) + 1
    try:
        pistons = inverse_geometry(points.T, rig)
    except ValueError:
        for row, (instant, point) in enumerate(zip(times, points, strict=True), first):
            try:
                inverse_geometry(point, rig)
            except ValueError as error:
                raise ValueError(f"{said} at {instant:.6g} s (row {row}): {error}") from None
    if trajectory.hurried:
        return
    air, choked = rig.air, rig.valves.sonic_conductance
    steady = choked * air.reference_density * air.gas_constant * air.reference_temperature
    for number, cylinder in enumerate((rig.cylinder1, rig.cylinder2)):
        way, most = np.abs(np.diff(pistons[number])), HASTE * steady / cylinder.area_n
        if (fast := way > most * np.diff(times)).any():
            k = int(fast.argmax())
            ends = [
                f"({x:.6g}, {y:.6g}) m at {t:.10g} s" for t, (x, y) in zip(times[k : k + 2], points[k : k + 2], strict=True)
            ]
            raise ValueError(
                f"{said} goes from {ends[0]} to {ends[1]} (rows {first + k} and {first + k + 1}): piston {number + 1} at "
                f"{way[k] / (times[k + 1] - times[k]):.3g} m/s; allowed: up to {most:.3g} m/s, so here {way[k] / most:.2g} s "
                "or more from one to the other"
            )


def check_knots(hand: UserForce, lanes: NDArray[np.intp], duration: float) -> None:
    """Raises ``ValueError`` where what a hand has drawn for ``lanes`` (L,) begins after ``duration`` s in all of them."""
    if isinstance(hand, ForceProfile):
        check_times("user_force", hand, Timed(np.empty(0), hand.first_knot(lanes)), duration, False)


def _sampler(name: str, part: Any, size: int, lanes: NDArray[np.intp], num_envs: int) -> Callable[[Array], Array]:
    """What gives the rows (size, K L) of a part at K instants, s; where the part can do that, of these lanes alone."""

    def checked_rows(part: Any, times: Array) -> Array:
        return checked(f"{name}.sample(time)", part.sample(times), (size, len(times)), "SI")

    if not is_vectorised(part.sample):
        return lambda instants: np.concatenate(
            [checked_rows(part, np.full(num_envs, instant)).take(lanes, axis=1) for instant in instants], axis=1
        )
    repeated = cache(lambda times: part.some(np.tile(lanes, times)))
    return lambda instants: checked_rows(repeated(len(instants)), np.repeat(instants, len(lanes)))


def _check(instants: Array, motion: Array, asked: Array, rig: Parameters) -> None:
    """Raises ``ValueError`` with what is wrong first, if anything is; ``motion`` (8, K L), ``asked`` (7, K L), K instants."""
    times, (kx, ky), kxy = np.repeat(instants, motion.shape[1] // len(instants)), asked[:2], asked[6]
    if (soft := (asked[:4] <= 0).any(axis=0)).any():
        k = int(soft.argmax())
        raise ValueError(f"stiffness.sample(time = {times[k]:g} s) = {asked[:4, k].min():g} N/m; allowed: more than 0")
    if (coupled := kxy**2 >= kx * ky).any():
        k = int(coupled.argmax())
        raise ValueError(
            f"stiffness.sample(time = {times[k]:g} s): Kclxy = {abs(kxy[k]):g} N/m; allowed: below sqrt(Kclx Kcly)"
        )
    try:
        inverse_geometry(motion[:2], rig)
    except ValueError:
        for instant, places in zip(instants, np.split(motion[:2], len(instants), axis=1), strict=True):
            try:
                inverse_geometry(places, rig)
            except ValueError as error:
                raise ValueError(f"reference at {instant:.3g} s: {error}") from error
