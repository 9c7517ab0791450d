"""A trajectory through points: between two of them it stays between them.

Every interval is a polynomial of degree 5 that meets position, speed and acceleration of its two points, so that all three are
continuous. Speed and acceleration of a point come from the polynomial through its nearest points, and are then made as small as
it takes for every interval to be monotone (Fritsch and Carlson 1980 for degree 3).
"""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.signals import Motion
from birthsim_env.parts.references import FARTHEST, Trajectory
from birthsim_env.parts.times import timed
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.plant import checked
from birthsim_env.physics.rig.values import shown

NEAREST = 5
"""Points, with itself, that tell speed and acceleration of one."""

CLOSEST, LATEST = 1e-9, 1e20
"""s: rows are at least so far apart, and no later; beyond, powers of their differences leave the range of a float."""

STEEPEST = 20.0
"""Mean speeds that 8 (v0 + v1) + h (a0 - a1) is at most in a monotone interval of h s; see ``_monotone``."""

GRID = 0.01
"""s between the instants at which a function of time is taken."""

SUDDEN = 1e-4
"""m by which a function may be elsewhere between two of these instants, a third of what a tracker is off; assumed."""


@kernel
def _along(time: Array, breaks: Array, pieces: Array, rows: Array) -> None:
    """``breaks`` (M,), ``pieces`` (6, M - 1, 2): coefficients over each interval, highest power first; at rest outside."""
    motion, first, last = Motion(rows), 0, breaks.shape[0] - 1
    for i in range(time.shape[0]):
        t = max(breaks[first], min(breaks[last], time[i]))
        low, high = first, last
        while high - low > 1:
            middle = (low + high) // 2
            if breaks[middle] <= t:
                low = middle
            else:
                high = middle
        h = breaks[high] - breaks[low]
        u = (t - breaks[low]) / h
        inside = breaks[first] <= time[i] <= breaks[last]
        for axis in range(2):
            value, slope, bend, jerk = 0.0, 0.0, 0.0, 0.0
            for k in range(6):
                jerk = jerk * u + 3.0 * bend
                bend = bend * u + 2.0 * slope
                slope = slope * u + value
                value = value * u + pieces[k, low, axis]
            motion.position[axis, i], motion.velocity[axis, i] = value, slope / h if inside else 0.0
            motion.acceleration[axis, i] = bend / (h * h) if inside else 0.0
            motion.jerk[axis, i] = jerk / (h * h * h) if inside else 0.0


class Through(Trajectory):
    """Through positions (M, 2), m, at ``times`` (M,), s, which increase.

    Between two points, x and y stay between theirs; position, velocity and acceleration are continuous. Before the first point
    and after the last one it rests, so that velocity steps there, unless an ``episode``, s, begins before the first or ends
    after the last: then it leaves or reaches rest smoothly. ``within`` (M - 1,) says which intervals stay between their points,
    by default all; the others may pass an extreme of theirs by what smooth motion would.

    ``hurried`` ones may go from point to point faster than a rig. Raises ``ValueError`` for fewer than two points, for times
    that do not increase, and for numbers that are not finite.
    """

    hurried = False

    def __init__(self, times: Any, positions: Any, episode: float | None = None, within: Any = True) -> None:
        count = len(times) if np.ndim(times) == 1 else 0
        if count < 2:
            raise ValueError(f"times = {shown(times)}; allowed: at least 2 increasing times, (M,) (s)")
        rows, points = checked("times", times, (count,), "s"), checked("positions", positions, (count, 2), "m")
        if not (np.diff(rows) >= CLOSEST).all() or max(abs(rows[0]), abs(rows[-1])) > LATEST:
            late = int((np.diff(rows) < CLOSEST).argmax())
            raise ValueError(
                f"times[{late + 1}] = {rows[late + 1]:.10g} after {rows[late]:.10g} s; allowed: times that increase by "
                f"{CLOSEST:g} s or more, up to {LATEST:g} s"
            )
        if not (np.abs(points) <= FARTHEST).all():
            far = tuple(int(k) for k in np.argwhere(np.abs(points) > FARTHEST)[0])
            raise ValueError(f"positions{list(far)} = {points[far]:g}; allowed: {-FARTHEST:g} to {FARTHEST:g} (m)")
        self.times, self.points, self.timed = rows, points, timed(rows, points)
        if episode is not None and rows[0] >= CLOSEST:
            rows, points = np.concatenate([[0.0], rows]), np.concatenate([points[:1], points])
        if episode is not None and episode - rows[-1] >= CLOSEST:
            rows, points = np.concatenate([rows, [episode]]), np.concatenate([points, points[-1:]])
        self._breaks: Array = rows
        self._pieces = _pieces(rows, points, np.broadcast_to(within, len(rows) - 1)[:, None])

    def sample(self, time: Array) -> Array:
        rows = np.empty((Motion.size, time.shape[0]))
        _along(time, self._breaks, self._pieces, rows)
        return rows


UNEVEN = 0.381966
"""Where between two values a function is asked once more: the golden section, since a fast sine may be zero halfway too."""


class Sampled(Through):
    """A function of time (s) that returns (x, y) in m, through its values every ``GRID`` s of an ``episode``, s.

    It may pass the values where the function does. It is asked once more between two of them: where it is elsewhere there, by
    more than ``SUDDEN``, a warning says so, and the passage stays between the two. ``call`` asks it at a time.
    """

    hurried = True

    def __init__(self, call: Callable[[float], Array], episode: float) -> None:
        count = max(7, round(episode / GRID) + 1)
        rows = np.linspace(0.0, episode, 2 * count - 1)[::2]
        between = rows[:-1] + UNEVEN * np.diff(rows)
        points, asked = (np.array([call(float(t)) for t in times]) for times in (rows, between))
        super().__init__(rows, points, within=False)
        off = np.abs(self.sample(between)[:2].T - asked).max(axis=1)
        if (sudden := off > SUDDEN).any():
            # The worst one is at the step; its neighbours differ because the polynomials through it swing.
            k, number = int(off.argmax()), _steps(sudden)
            where = f"from {_place(points[k])} at {rows[k]:.6g} s to {_place(points[k + 1])} at {rows[k + 1]:.6g} s"
            more = f", and at {number - 1} more places" if number > 1 else ""
            warnings.warn(
                f"reference: the function steps {where}{more}, or moves faster than its values every {GRID:g} s tell; the "
                f"target goes smoothly from one to the other, and between them is {1e3 * off[k]:.3g} mm off",
                stacklevel=2,
            )
            super().__init__(rows, points, within=sudden)


def _steps(sudden: NDArray[np.bool_]) -> int:
    """How many runs of sudden intervals (M,) there are."""
    return int(sudden[0]) + int((sudden[1:] & ~sudden[:-1]).sum())


def _place(point: Array) -> str:
    return f"({point[0]:.6g}, {point[1]:.6g}) m"


def _pieces(times: Array, points: Array, within: NDArray[np.bool_]) -> Array:
    """Coefficients (6, M - 1, 2) of the polynomials between points (M, 2), in parts of an interval, highest power first."""
    h, way = np.diff(times)[:, None], np.diff(points, axis=0)
    speed, bend = _monotone(h, way / h, *_estimated(times, points), within)
    v0, v1, a0, a1 = speed[:-1] * h, speed[1:] * h, bend[:-1] * h * h, bend[1:] * h * h
    fifth = 6.0 * way - 3.0 * (v0 + v1) - 0.5 * (a0 - a1)
    fourth = -15.0 * way + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1
    third = 10.0 * way - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1
    return np.array([fifth, fourth, third, 0.5 * a0, v0, points[:-1]])


def _estimated(times: Array, points: Array) -> tuple[Array, Array]:
    """Speed and acceleration (M, 2) at points (M, 2): derivatives of the polynomials through the nearest ones."""
    count = min(NEAREST, len(times))
    first = np.clip(np.arange(len(times)) - count // 2, 0, len(times) - count)
    near = first[:, None] + np.arange(count)
    since, away = times[near] - times[:, None], points[near] - points[:, None]
    speed, bend = np.zeros_like(points), np.zeros_like(points)
    for k in range(count):
        # Lagrange's polynomial that is 1 at point k and 0 at the others: its lowest three coefficients.
        constant, linear, square = np.ones(len(times)), np.zeros(len(times)), np.zeros(len(times))
        for other in range(count):
            if other != k:
                u, scale = since[:, other], since[:, k] - since[:, other]
                constant, linear, square = -u * constant / scale, (constant - u * linear) / scale, (linear - u * square) / scale
        speed += linear[:, None] * away[:, k]
        bend += 2.0 * square[:, None] * away[:, k]
    return speed, bend


def _monotone(h: Array, mean: Array, speed: Array, bend: Array, within: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Speed and acceleration (M, 2) of points with which the intervals ``within`` (M - 1, 1) are monotone.

    ``h`` (M - 1, 1), s, and ``mean`` (M - 1, 2), m/s, are duration and mean speed of each interval. In Bernstein's form the
    speed of an interval has the coefficients v0, v0 + h a0 / 4, 5 mean - 2 (v0 + v1) - h (a0 - a1) / 4, v1 - h a1 / 4 and v1,
    and has the sign of ``mean`` where all of them do. The first two and the last two bound each point by itself. Where the
    third is wrong, both points are scaled down. That harms no other interval, because a point's share of its bound there,
    8 v + h a or 8 v - h a, has the sign of ``mean`` too.
    """
    before, after = np.concatenate([mean[:1], mean]), np.concatenate([mean, mean[-1:]])
    h0, h1 = np.concatenate([h[:1], h]), np.concatenate([h, h[-1:]])
    none = np.zeros((1, 1), dtype=bool)
    bound0, bound1 = np.concatenate([none, within]), np.concatenate([within, none])

    def wrong(speed: Array) -> NDArray[np.bool_]:
        sign = np.sign(speed)
        found: NDArray[np.bool_] = (bound0 & (sign * np.sign(before) <= 0)) | (bound1 & (sign * np.sign(after) <= 0))
        return found

    parabola = (h1 * before + h0 * after) / (h0 + h1)
    parabola[0] = parabola[-1] = 0.0  # has no second side
    speed = np.where(wrong(speed), parabola, speed)
    speed = np.where(wrong(speed), 0.0, speed)
    least0, least1 = 4.0 * np.abs(speed) / h0, 4.0 * np.abs(speed) / h1
    most = np.minimum(np.where(bound0 & (before >= 0), least0, np.inf), np.where(bound1 & (after <= 0), least1, np.inf))
    least = np.maximum(np.where(bound0 & (before <= 0), -least0, -np.inf), np.where(bound1 & (after >= 0), -least1, -np.inf))
    bend = np.clip(bend, least, most)
    share = 8.0 * np.abs(speed[:-1] + speed[1:]) + h * np.sign(mean) * (bend[:-1] - bend[1:])
    most_share = STEEPEST * np.abs(mean)
    part = np.where(within & (share > most_share), most_share / np.where(share > 0, share, 1.0), 1.0)
    ones = np.ones((1, 2))
    scale = np.minimum(np.concatenate([ones, part]), np.concatenate([part, ones]))
    return speed * scale, bend * scale
