"""Forces of the user's hand at the end effector, evaluated for all lanes at once.

A user's own force derives from ``UserForce`` and implements ``force``. The built-in ones are piecewise linear in time.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.parts.seeding import Range, draw, put, served, vectorised
from birthsim_env.physics import exact
from birthsim_env.physics.compilation import kernel
from birthsim_env.physics.lanes import Array
from birthsim_env.physics.plant import checked


class UserForce:
    """The hand (or the uterus) that pushes the end effector.

    ``prepare(num_envs)`` is called once, ``begin(lane, rng)`` at the start of every episode of a lane with that lane's own
    random stream; both may stay as they are. ``force(time, position, velocity)`` gets K instants of every lane, s, (K, N),
    and the end effector's position and velocity at the first of them, (2, N), m and m/s; it returns (K, 2, N), N. Each
    sample is held for one control period. A force that depends on position or velocity sets ``closed_loop = True`` and
    is then asked at every control period (K = 1), and again at the same instant where another lane starts anew; it may
    return one force per lane, (2, N).
    A component that changes faster than ``jump_rate``, N/s, jumps: no tracking can follow, and ``info["since_jump"]`` starts
    anew.
    """

    closed_loop = False
    jump_rate = 150.0

    def prepare(self, num_envs: int) -> None:
        """Make room for ``num_envs`` lanes."""

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        """Start a new episode in one lane."""

    def force(self, time: Array, position: Array, velocity: Array) -> Array:
        """Force on the end effector, N, (K, 2, N)."""
        raise NotImplementedError(f"{type(self).__name__}.force(time, position, velocity) is missing; it returns N, (K, 2, N)")


def forces_of(hand: UserForce, time: Array, position: Array, velocity: Array) -> Array:
    """What a hand pushes with, N, (K, 2, N), at ``time`` (K, N), s; ``position`` and ``velocity`` (2, N) in m and m/s.

    A hand may return one force per lane, (2, N), for one instant. Raises ``ValueError`` for anything but finite numbers.
    """
    force = hand.force(time, position, velocity)
    instants, lanes = time.shape
    if instants == 1 and np.shape(force) == (2, lanes):
        force = np.asarray(force)[None]
    return checked("user_force.force(...)", force, (instants, 2, lanes), "N")


@kernel
def _interpolate(time: Array, knots: Array, counts: Array, forces: Array) -> None:
    """``knots`` (M, 3, N): time, Fx, Fy; the first ``counts`` (N,) of them count; constant before and after."""
    for i in range(time.shape[1]):
        last = int(counts[i]) - 1
        for k in range(time.shape[0]):
            t = time[k, i]
            low, high = 0, last
            while high - low > 1:
                middle = (low + high) // 2
                if knots[middle, 0, i] <= t:
                    low = middle
                else:
                    high = middle
            span = knots[high, 0, i] - knots[low, 0, i]
            part = max(0.0, min(1.0, (t - knots[low, 0, i]) / span)) if span > 0.0 else 1.0
            forces[k, 0, i] = knots[low, 1, i] + part * (knots[high, 1, i] - knots[low, 1, i])
            forces[k, 1, i] = knots[low, 2, i] + part * (knots[high, 2, i] - knots[low, 2, i])


@kernel
def _write(columns: Array, lanes: NDArray[np.int64], knots: Array) -> bool:
    """Copies ``columns`` (M, 3, L) into the lanes (L,) of ``knots`` (M or more, 3, N).

    Returns whether there are any, all are finite, and none comes before the one that stands before it.
    """
    wrong = 0
    for k in range(columns.shape[0]):
        for i in range(lanes.shape[0]):
            time, x, y = columns[k, 0, i], columns[k, 1, i], columns[k, 2, i]
            knots[k, 0, lanes[i]], knots[k, 1, lanes[i]], knots[k, 2, lanes[i]] = time, x, y
            late = columns[max(k - 1, 0), 0, i] <= time
            wrong += 0 if late and abs(time) < math.inf and abs(x) < math.inf and abs(y) < math.inf else 1
    return columns.shape[0] > 0 and wrong == 0


def _columns(knots: Any, lanes: int) -> Array:
    """Knots as an array (M, 3, L), from one or from triples whose entries are numbers or (L,); (0, 3, L) if they are neither."""
    if isinstance(knots, np.ndarray) and knots.shape[1:] == (3, lanes):
        return knots
    try:
        columns = np.empty((len(knots), 3, lanes))
        for rows, knot in zip(columns, knots, strict=True):
            put(rows, slice(None), knot)
    except (TypeError, ValueError):
        return np.empty((0, 3, lanes))
    return columns


def _possible(columns: Array) -> bool:
    return _write(columns, np.arange(columns.shape[2]), np.empty_like(columns))


def _refusal(name: str, knots: Any, columns: Array) -> ValueError:
    """The error that names impossible knots; of several lanes, those of the first whose ``columns`` (M, 3, L) are impossible."""
    if columns.shape[2] > 1:
        wrong = (lane for lane in range(columns.shape[2]) if not _possible(columns[:, :, [lane]].copy()))
        knots = [tuple(knot) for knot in columns[:, :, next(wrong)].tolist()]
    return ValueError(f"{name} = {knots!r}; allowed: finite (time, Fx, Fy) with increasing times (s, N, N)")


class ForceProfile(UserForce):
    """A force that is linear between knots. Subclasses draw their knots at the start of every episode."""

    def __init__(self, knots: list[tuple[float, float, float]] | None = None) -> None:
        self._fixed = knots or [(0.0, 0.0, 0.0)]
        columns = _columns(self._fixed, 1)
        if not _possible(columns):
            raise _refusal("knots", self._fixed, columns)

    @vectorised
    def knots(self, rng: np.random.Generator) -> list[tuple[float, float, float]]:
        """(time, Fx, Fy) of one episode, s and N, with increasing times."""
        return self._fixed

    def prepare(self, num_envs: int) -> None:
        self._knots: Array = np.zeros((1, 3, num_envs))
        self._counts = np.ones(num_envs)

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        for one, own in served(self.knots, lane, rng):
            knots, lanes = self.knots(own), np.atleast_1d(one)
            columns = _columns(knots, len(lanes))
            missing = len(columns) - len(self._knots)
            if missing > 0:
                self._knots = np.concatenate([self._knots, np.zeros((missing, 3, self._knots.shape[2]))])
            if not _write(columns, lanes, self._knots):
                raise _refusal(f"{type(self).__name__}.knots(rng)", knots, columns)
            self._counts[one] = len(columns)

    def force(self, time: Array, position: Array, velocity: Array) -> Array:
        forces = np.empty((time.shape[0], 2, time.shape[1]))
        _interpolate(time, self._knots, self._counts, forces)
        return forces


class AlternatingSteps(ForceProfile):
    """The pushes of Fig. 4, repeated every ``repeat`` s: +x, -x, +y, -y of ``amplitude`` N, ``ramp`` s up and down."""

    STARTS = ((1.0, 2.0), (3.0, 4.0), (5.0, 6.0), (6.9, 7.7))
    """Assumed: start and end of the four pushes, s; every push ends well before the next."""

    jump_rate = 1.0
    """N/s: every ramp is a step, however small the push."""

    def __init__(self, amplitude: Range = 30.0, ramp: float = 0.1, repeat: float = 8.0, repeats: int = 2) -> None:
        super().__init__()
        self.amplitude, self.ramp, self.repeat, self.repeats = amplitude, ramp, repeat, repeats

    @vectorised
    def knots(self, rng: np.random.Generator) -> list[tuple[float, float, float]]:
        knots = [(0.0, 0.0, 0.0)]
        directions = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0))
        for k in range(self.repeats):
            for (start, end), (dx, dy) in zip(self.STARTS, directions, strict=True):
                size = draw(self.amplitude, rng)
                begin, stop = k * self.repeat + start, k * self.repeat + end
                knots += [(begin, 0.0, 0.0), (begin + self.ramp, size * dx, size * dy)]
                knots += [(stop, size * dx, size * dy), (stop + self.ramp, 0.0, 0.0)]
        return knots


class Ramp(ForceProfile):
    """The stiffness test: from ``begins`` ramp to ``amplitude`` N over ``rise`` s along ``angle`` (rad from x), then hold.

    ``angle`` "axes" draws one of the four axis directions.
    """

    def __init__(self, amplitude: Range = 20.0, angle: Range | str = 0.0, begins: float = 1.0, rise: float = 1.0) -> None:
        super().__init__()
        if isinstance(angle, str) and angle != "axes":
            raise ValueError(f"angle = {angle!r}; allowed: a number or (low, high) in rad, or 'axes'")
        self.amplitude, self.angle, self.begins, self.rise = amplitude, angle, begins, rise

    @vectorised
    def knots(self, rng: np.random.Generator) -> list[tuple[float, float, float]]:
        size = draw(self.amplitude, rng)
        x, y = exact.direction(rng.integers(4) * math.pi / 2 if isinstance(self.angle, str) else draw(self.angle, rng))
        return [(0.0, 0.0, 0.0), (self.begins, 0.0, 0.0), (self.begins + self.rise, size * x, size * y)]


class Pulls(ForceProfile):
    """Tractions one after the other: ramp at ``rate`` N/s, hold, release, pause.

    ``sizes`` N, one per pull; ``angle`` rad from x; ``hold``, ``release``, ``pause`` and ``begins`` in s.
    """

    def __init__(
        self,
        sizes: tuple[Range, ...],
        rate: Range,
        angle: Range = 0.0,
        begins: float = 1.0,
        hold: float = 2.0,
        release: float = 0.3,
        pause: float = 1.2,
    ) -> None:
        super().__init__()
        if not np.min(rate) > 0:
            raise ValueError(f"rate = {rate!r}; allowed: > 0 (N/s)")
        self.sizes, self.rate, self.angle = sizes, rate, angle
        self.begins, self.hold, self.release, self.pause = begins, hold, release, pause

    @vectorised
    def knots(self, rng: np.random.Generator) -> list[tuple[float, float, float]]:
        knots = [(0.0, 0.0, 0.0)]
        now = self.begins
        for sizes in self.sizes:
            size, rate = draw(sizes, rng), draw(self.rate, rng)
            along, across = exact.direction(draw(self.angle, rng))
            x, y, top = size * along, size * across, now + size / rate
            knots += [(now, 0.0, 0.0), (top, x, y), (top + self.hold, x, y), (top + self.hold + self.release, 0.0, 0.0)]
            now = top + self.hold + self.release + self.pause
        return knots


@kernel
def _contraction(
    time: Array, begins: float, lasts: float, size: Array, share: Array, bumps: NDArray[np.int64], along: Array, knots: Array
) -> None:
    """Fills ``knots`` (M, 3, L) with one contraction of each lane at ``time`` (M,), s since it ``begins``.

    It carries 1 - ``share``, so that the sum with its ``bumps`` pushes peaks near ``size``, N; all three (L,).
    """
    least = bumps.min()
    pushes = np.empty(bumps.max() - least + 1)
    for k in range(time.shape[0]):
        middle = max(0.0, min(1.0, (time[k] - 0.25 * lasts) / (0.5 * lasts)))
        contraction = exact.sine(math.pi * time[k] / lasts)
        for more in range(pushes.shape[0]):
            pushes[more] = exact.sine(math.pi * (least + more) * middle)
        for i in range(size.shape[0]):
            push = pushes[bumps[i] - least]
            force = size[i] * ((1.0 - share[i]) * contraction * contraction + share[i] * push * push)
            knots[k, 0, i] = begins + time[k]
            knots[k, 1, i], knots[k, 2, i] = force * along[0], force * along[1]


class Contractions(ForceProfile):
    """Uterine contractions: sin^2 of ``lasts`` s and ``amplitude`` N, with maternal pushes on top, along ``heading``.

    Each contraction carries ``pushes`` sin^2 bumps of ``push`` times its amplitude over its middle half (assumed).
    """

    GRID = 0.05
    """s between knots: below 0.2 % of the amplitude in error."""

    def __init__(
        self,
        amplitude: Range = 80.0,
        count: int = 2,
        lasts: float = 12.0,
        pushes: tuple[int, int] = (4, 5),
        push: Range = 0.25,
        heading: float = 0.0,
    ) -> None:
        super().__init__()
        self.amplitude, self.count, self.lasts, self.pushes, self.push = amplitude, count, lasts, pushes, push
        self.heading = heading

    @vectorised
    def knots(self, rng: np.random.Generator) -> list[tuple[float, float, float]]:
        time = np.arange(0.0, self.lasts, self.GRID)
        drawn = []
        for _ in range(self.count):
            size, share = draw(self.amplitude, rng), draw(self.push, rng)
            drawn.append((size, share, rng.integers(self.pushes[0], self.pushes[1] + 1)))
        lanes = np.shape([bumps for _, _, bumps in drawn[:1]])[1:]
        columns = np.empty((self.count * len(time) + 1, 3, *(lanes or (1,))))
        along = np.array(exact.direction(self.heading))
        for k, numbers in enumerate(drawn):
            piece = columns[k * len(time) : (k + 1) * len(time)]
            _contraction(time, k * self.lasts, self.lasts, *(np.full(columns.shape[2], one) for one in numbers), along, piece)
        columns[-1, 0], columns[-1, 1:] = self.count * self.lasts, 0.0
        return columns if lanes else [tuple(knot) for knot in columns[:, :, 0].tolist()]  # type: ignore[return-value]
