"""Reference trajectories of the end effector, evaluated for all lanes at once.

A user's own trajectory derives from ``Trajectory`` and implements ``sample``. Numbers given as (low, high) are drawn at the
start of every episode.
"""

import copy
import math
from collections.abc import Callable
from typing import Any, Self

import numpy as np

from birthsim_env.loop.loop import sampled
from birthsim_env.loop.rows import REFERENCE, Seen
from birthsim_env.loop.signals import Motion
from birthsim_env.loop.stage import Stage, Staged, table2
from birthsim_env.parts.drawn.seeding import Range, draw, put, vectorised
from birthsim_env.parts.times import Timed
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, row, rows
from birthsim_env.physics.rig.values import checked_number, checked_range, shown

FARTHEST = 10.0
"""m: coordinates and lengths up to here; rigs are smaller."""

TURNED = 100.0
"""rad: angles up to here, sixteen turns."""

LONGEST, SHORTEST = 1e6, 1e-3
"""s: times up to here, and what takes time takes no less."""


class Trajectory(Staged):
    """Where the end effector should be; derive from it to make a target of your own.

    Notes
    -----
    A trajectory of your own overrides ``sample``, and the other two methods where it needs them. ``prepare(num_envs)`` is
    called once. ``begin(lane, rng)`` is called at the start of every episode of a lane, with that lane's own random stream.
    ``sample(time)`` gets the time of every lane since its episode began, s, (N,). It returns (8, N): x, y (m), vx, vy, ax, ay
    and jerks jx, jy, consistent with each other. ``timed`` says when it does something, where that is known.

    Examples
    --------
    A target that moves slowly up and down:

    >>> import numpy as np, birthsim
    >>> class Bob(birthsim.Trajectory):
    ...     def sample(self, time):
    ...         sine, cosine, still = 0.02 * np.sin(time), 0.02 * np.cos(time), 0 * time
    ...         return np.stack([0.5 + still, sine, still, cosine, still, -sine, still, -cosine])
    >>> env = birthsim.make("BirthSIM/Circle-v2", reference=Bob())
    >>> observation, info = env.reset(seed=0)
    >>> info["target"].tolist()
    [0.5, 0.0]
    """

    timed: Timed | None = None

    def prepare(self, num_envs: int) -> None:
        """Make room for ``num_envs`` lanes."""

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        """Start a new episode in one lane."""

    def sample(self, time: Array) -> Array:
        """Target motion, (8, N), at ``time`` (N,), s."""
        raise NotImplementedError(
            f"{type(self).__name__}.sample(time) is missing; it returns x, y and three derivatives, (8, N)"
        )


class Planned(Trajectory):
    """A trajectory that a compiled ``stage`` works out of a few numbers per lane, ``_own`` (rows, N)."""

    _own: Array

    def some(self, lanes: Any) -> Self:
        """The same for lanes (L,) alone."""
        few = copy.copy(self)
        few._own = self._own.take(lanes, axis=1)
        return few

    @vectorised
    def sample(self, time: Array) -> Array:
        return sampled(self.stage(), time, REFERENCE, Motion.size)

    def stage(self) -> Stage:
        """``sample``, compiled into the closed loop."""
        raise NotImplementedError(f"{type(self).__name__}.stage() is missing; it returns a Stage with ``_own`` as its table")


class _Drawn(Planned):
    """One that has nothing else: the layout of its numbers, and what follows, a kernel."""

    planned: tuple[type[Rows], Callable[..., int]]

    def prepare(self, num_envs: int) -> None:
        self._own = np.zeros((self.planned[0].size, num_envs))

    def stage(self) -> Stage:
        return Stage(self.planned[1], tables=(self._own,))


def require_line(middle: tuple[float, float], heading: float) -> None:
    """Raise ``ValueError`` for a ``middle``, m, or a ``heading``, rad, of no line in reach."""
    require_point("middle", middle)
    checked_number("heading", heading, "rad", least=-TURNED, most=TURNED)


def require_point(name: str, point: tuple[float, float]) -> None:
    """Raise ``ValueError`` for what is no (x, y), m, in reach."""
    if not (isinstance(point, tuple) and len(point) == 2):
        raise ValueError(f"{name} = {shown(point)}; allowed: (x, y) (m)")
    for coordinate in point:
        checked_number(name, coordinate, "m", least=-FARTHEST, most=FARTHEST)


class Round(Rows):
    """A circle."""

    centre = rows("x y", "m", "centre")
    radius = row("m", "radius")
    rate = row("rad/s", "angular speed")


@kernel
def _circle(world: int, seen: Seen, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    own, time, target = Round(table2(tables, 0)[:, lane : lane + n]), seen.time, seen.reference
    for i in range(n):
        w = own.rate[i]
        cosine, sine = own.radius[i] * exact.cosine(w * time[i]), own.radius[i] * exact.sine(w * time[i])
        target.position[0, i], target.position[1, i] = own.centre[0, i] + cosine, own.centre[1, i] + sine
        target.velocity[0, i], target.velocity[1, i] = -w * sine, w * cosine
        target.acceleration[0, i], target.acceleration[1, i] = -w * w * cosine, -w * w * sine
        target.jerk[0, i], target.jerk[1, i] = w * w * w * sine, -w * w * w * cosine
    return 0


class Circle(_Drawn):
    """A circle at constant speed, which starts at its rightmost point.

    Parameters
    ----------
    centre : (float, float)
        x and y, m.
    radius : float or (float, float)
        m; a range (low, high) is drawn from at the start of every episode.
    period : float or (float, float)
        s a turn; below zero it runs clockwise.

    Raises
    ------
    ValueError
        Names the argument, its value and what is allowed.

    Examples
    --------
    >>> import birthsim
    >>> env = birthsim.make("BirthSIM/Circle-v2", reference=birthsim.Circle(radius=0.03, period=5.0))
    >>> observation, info = env.reset(seed=0)
    >>> info["target"].tolist()
    [0.53, 0.0]
    """

    planned = Round, _circle

    def __init__(self, centre: tuple[float, float] = (0.5, 0.0), radius: Range = 0.05, period: Range = 4.0) -> None:
        require_point("centre", centre)
        checked_range("radius", radius, "m", least=0.0, most=FARTHEST)
        checked_range("period", period, "s", least=-LONGEST, most=LONGEST)
        if np.min(period) < SHORTEST and np.max(period) > -SHORTEST:
            raise ValueError(f"period = {shown(period)}; allowed: other than zero, {SHORTEST:g} s or more either way")
        self.centre, self.radius, self.period = centre, radius, period

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        put(self._own, lane, (*self.centre, draw(self.radius, rng), 2 * math.pi / draw(self.period, rng)))


class Swing(Rows):
    """To and fro along a line."""

    middle = rows("x y", "m", "middle")
    direction = rows("x y", "1", "of the line")
    amplitude = row("m", "amplitude")
    rate = row("rad/s", "angular frequency")


@kernel
def _sine(world: int, seen: Seen, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    own, time, target = Swing(table2(tables, 0)[:, lane : lane + n]), seen.time, seen.reference
    for i in range(n):
        w = own.rate[i]
        cosine, sine = own.amplitude[i] * exact.cosine(w * time[i]), own.amplitude[i] * exact.sine(w * time[i])
        for axis in range(2):
            way = own.direction[axis, i]
            target.position[axis, i] = own.middle[axis, i] + way * sine
            target.velocity[axis, i] = w * way * cosine
            target.acceleration[axis, i] = -w * w * way * sine
            target.jerk[axis, i] = -w * w * w * way * cosine
    return 0


class Sine(_Drawn):
    """To and fro along a line, a sine of time, from its middle on.

    Parameters
    ----------
    middle : (float, float)
        x and y, m.
    heading : float
        Of the line, rad from x.
    amplitude : float or (float, float)
        m; a range (low, high) is drawn from at the start of every episode.
    period : float or (float, float)
        s to and fro.

    Raises
    ------
    ValueError
        Names the argument, its value and what is allowed.
    """

    planned = Swing, _sine

    def __init__(
        self, middle: tuple[float, float] = (0.5, 0.0), heading: float = 0.0, amplitude: Range = 0.05, period: Range = 4.0
    ) -> None:
        require_line(middle, heading)
        checked_range("amplitude", amplitude, "m", least=0.0, most=FARTHEST)
        checked_range("period", period, "s", least=SHORTEST, most=LONGEST)
        self.middle, self.amplitude, self.period = middle, amplitude, period
        self._direction = exact.direction(heading)

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        rate = 2 * math.pi / draw(self.period, rng)
        put(self._own, lane, (*self.middle, *self._direction, draw(self.amplitude, rng), rate))


@helper
def minimum_jerk(u: float, order: int) -> float:
    """10 u^3 - 15 u^4 + 6 u^5 on [0, 1] (Flash and Hogan 1985), or its first to third derivative; constant outside."""
    u = max(0.0, min(1.0, u))
    value = u * u * u * (10.0 + u * (6.0 * u - 15.0))
    slope = 30.0 * u * u * (1.0 - u) * (1.0 - u)
    bend = 60.0 * u * (1.0 + u * (2.0 * u - 3.0))
    jerk = 60.0 + 360.0 * u * (u - 1.0) if 0.0 < u < 1.0 else 0.0
    return value if order == 0 else slope if order == 1 else bend if order == 2 else jerk


class Line(Rows):
    """A straight line, then an arc."""

    start = rows("x y", "m", "where it starts")
    heading = row("rad", "from x")
    straight = row("m", "length of the line")
    radius = row("m", "of the arc")
    angle = row("rad", "of the arc")
    begins = row("s", "when the motion begins")
    ends = row("s", "when it ends")


@kernel
def _path(world: int, seen: Seen, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    own, time, target = Line(table2(tables, 0)[:, lane : lane + n]), seen.time, seen.reference
    for i in range(n):
        heading, straight, radius, angle = own.heading[i], own.straight[i], own.radius[i], own.angle[i]
        lasts = own.ends[i] - own.begins[i]
        total = straight + radius * abs(angle)
        u = (time[i] - own.begins[i]) / lasts
        s = total * minimum_jerk(u, 0)
        ds = total * minimum_jerk(u, 1) / lasts
        dds = total * minimum_jerk(u, 2) / lasts**2
        ddds = total * minimum_jerk(u, 3) / lasts**3
        on_arc = max(s - straight, 0.0)
        curvature = (1.0 / radius if angle > 0.0 else -1.0 / radius) if on_arc > 0.0 else 0.0
        turned = curvature * on_arc
        along, across = min(s, straight), 0.0
        if on_arc > 0.0:
            along += exact.sine(turned) / curvature
            across = (1.0 - exact.cosine(turned)) / curvature
        cosine, sine = exact.cosine(heading), exact.sine(heading)
        target.position[0, i] = own.start[0, i] + cosine * along - sine * across
        target.position[1, i] = own.start[1, i] + sine * along + cosine * across
        tx, ty = exact.cosine(heading + turned), exact.sine(heading + turned)
        normal = curvature * ds * ds
        jerk_t, jerk_n = ddds - curvature * curvature * ds * ds * ds, 3.0 * curvature * ds * dds
        target.velocity[0, i], target.velocity[1, i] = tx * ds, ty * ds
        target.acceleration[0, i], target.acceleration[1, i] = tx * dds - ty * normal, ty * dds + tx * normal
        target.jerk[0, i], target.jerk[1, i] = tx * jerk_t - ty * jerk_n, ty * jerk_t + tx * jerk_n
    return 0


class Path(_Drawn):
    """A straight line, then an arc, at minimum jerk along the whole; at rest before ``begins`` and after ``ends``.

    Numbers may be ranges (low, high), from which every episode draws, but for the times.

    Parameters
    ----------
    start : (float, float)
        x and y, m.
    heading : float
        Of the line, rad from x.
    length : float
        Of the line, m.
    radius : float
        Of the arc, m.
    angle : float
        Of the arc, rad; above zero it turns left.
    begins, ends : float
        s since the episode began.

    Raises
    ------
    ValueError
        Names the argument, its value and what is allowed.

    Notes
    -----
    Where the line meets the arc the acceleration steps by speed^2 / radius. Minimum jerk: Flash and Hogan, J. Neurosci. 5
    (1985) 1688.

    Examples
    --------
    >>> import birthsim
    >>> ahead = birthsim.Path(start=(0.45, 0.0), length=0.05, begins=1.0, ends=3.0)
    >>> env = birthsim.make("BirthSIM/Forceps-v2", reference=ahead)
    >>> observation, info = env.reset(seed=0)
    >>> info["target"].tolist()
    [0.45, 0.0]
    """

    planned = Line, _path

    def __init__(
        self,
        start: tuple[Range, Range] = (0.5, 0.0),
        heading: Range = 0.0,
        length: Range = 0.0,
        radius: Range = 0.07,
        angle: Range = 0.0,
        begins: float = 0.0,
        ends: float = 1.0,
    ) -> None:
        if not (isinstance(start, tuple) and len(start) == 2):
            raise ValueError(f"start = {shown(start)}; allowed: (x, y), numbers or ranges (low, high) (m)")
        for name, coordinate in zip(("start x", "start y"), start, strict=True):
            checked_range(name, coordinate, "m", least=-FARTHEST, most=FARTHEST)
        checked_range("heading", heading, "rad", least=-TURNED, most=TURNED)
        checked_range("length", length, "m", least=0.0, most=FARTHEST)
        checked_range("radius", radius, "m", least=1e-3, most=FARTHEST)
        checked_range("angle", angle, "rad", least=-TURNED, most=TURNED)
        checked_number("begins", begins, "s", least=0.0, most=LONGEST)
        if not checked_number("ends", ends, "s", least=0.0, most=LONGEST) >= begins + SHORTEST:
            raise ValueError(f"ends = {ends!r}; allowed: {SHORTEST:g} s or more after begins = {begins!r}")
        self.start, self.heading, self.length, self.radius, self.angle = start, heading, length, radius, angle
        self.begins, self.ends = begins, ends
        self.timed = Timed(np.empty(0), begins)

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        numbers = (*self.start, self.heading, self.length, self.radius, self.angle)
        put(self._own, lane, (*(draw(number, rng) for number in numbers), self.begins, self.ends))


class FixedTarget(Path):
    """A target that stays where it is.

    Parameters
    ----------
    position : (float, float)
        x and y, m; each may be a range (low, high), from which every episode draws.

    Raises
    ------
    ValueError
        Names the value and what is allowed.

    Examples
    --------
    >>> import birthsim
    >>> env = birthsim.make("BirthSIM/Circle-v2", reference=birthsim.FixedTarget((0.48, 0.01)))
    >>> observation, info = env.reset(seed=0)
    >>> info["target"].tolist()
    [0.48, 0.01]
    """

    def __init__(self, position: tuple[Range, Range] = (0.5, 0.0)) -> None:
        if not (isinstance(position, tuple) and len(position) == 2):
            raise ValueError(f"position = {shown(position)}; allowed: (x, y), numbers or ranges (low, high) (m)")
        for axis, coordinate in zip("xy", position, strict=True):
            checked_range(f"position {axis}", coordinate, "m", least=-FARTHEST, most=FARTHEST)
        super().__init__(start=position)
