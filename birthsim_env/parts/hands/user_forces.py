"""Forces of the user's hand at the end effector, evaluated for all lanes at once.

A user's own force derives from ``UserForce`` and implements ``force``. ``ForceProfile`` is piecewise linear in time. A hand
that is registered in its own file by ``@register(hand="name", about="...")`` is also known by its name.
"""

import math
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.loop import Loop
from birthsim_env.loop.rows import FORCE, MOTION, TIME, Seen, World
from birthsim_env.loop.stage import Stage, Staged, table1, table3
from birthsim_env.parts.drawn.seeding import Range, draw, put, served, vectorised, whole
from birthsim_env.parts.references import LONGEST, TURNED
from birthsim_env.parts.times import Timed, timed
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, row, rows
from birthsim_env.physics.plant import checked
from birthsim_env.physics.rig.arrays import shape_of
from birthsim_env.physics.rig.values import checked_number, checked_range, shown
from birthsim_env.restored import Declared, Kept

STRONGEST = 1000.0
"""N: five times what clinicians pull; more breaks end stops within a policy step."""

MOST = 100
"""Pushes, pulls or contractions of an episode."""


class UserForce(Staged):
    """The hand (or the uterus) that pushes the end effector; derive from it to make one of your own.

    Notes
    -----
    Three methods make a hand; a class of your own overrides those that it needs.

    ``prepare(num_envs)`` is called once. ``begin(lane, rng)`` is called at the start of every episode of a lane, with that
    lane's own random stream. ``force(time, position, velocity)`` returns forces (K, 2, N), N, at K instants of N lanes. It gets
    these instants, s, (K, N), and the end effector's position and velocity at the first of them, (2, N), m and m/s. Each
    force is held for one control period.

    A force that depends on position or velocity sets ``closed_loop = True``. It is then asked at every control period (K = 1),
    and again at the same instant where another lane starts anew. It may return one force per lane, (2, N).

    A component that changes faster than ``jump_rate``, N/s, counts as a jump: no controller can follow it, and
    ``info["since_jump"]`` starts anew. ``timed`` says when it does something, where that is known.

    Examples
    --------
    A hand that pulls to the right with 10 N, twice as hard in every second lane:

    >>> import numpy as np, birthsim
    >>> class Pull(birthsim.UserForce):
    ...     def prepare(self, num_envs):
    ...         self.strength = np.where(np.arange(num_envs) % 2, 20.0, 10.0)
    ...     def force(self, time, position, velocity):
    ...         return np.stack([self.strength + 0 * time, 0 * time], axis=1)
    >>> worlds = birthsim.make_vec("BirthSIM/Circle-v2", num_envs=2, user_force=Pull(), duration=1.0)
    >>> observations, infos = worlds.reset(seed=0)
    >>> infos["user_force"].tolist()
    [[10.0, 0.0], [20.0, 0.0]]
    """

    closed_loop: bool = False
    """Whether it feels the rig: whether ``force`` depends on position or velocity."""

    jump_rate: float = 150.0
    """N/s of a component, beyond which a change counts as a jump."""

    timed: Timed | None = None
    """When it does something, where that is known."""

    @classmethod
    def varied(cls) -> Self:
        """What the name of a registered hand stands for where ``randomize`` draws the experiment: its numbers are ranges."""
        return cls()

    def prepare(self, num_envs: int) -> None:
        """Make room for ``num_envs`` lanes."""

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        """Start a new episode in one lane."""

    def force(self, time: Array, position: Array, velocity: Array) -> Array:
        """Force on the end effector, N, (K, 2, N)."""
        raise NotImplementedError(f"{type(self).__name__}.force(time, position, velocity) is missing; it returns N, (K, 2, N)")


class CompiledForce(UserForce):
    """A force that a ``stage`` of the closed loop computes."""

    def force(self, time: Array, position: Array, velocity: Array) -> Array:
        forces, stages = np.zeros((time.shape[0], 2, time.shape[1])), [self.stage()]
        motion = [(np.concatenate([position, velocity]), MOTION)] if self.closed_loop else []
        for now, force in zip(np.array(time, dtype=np.float64), forces, strict=True):
            Loop(len(now), [(force, FORCE), *motion], [(now[None], TIME)], stages).run()
        return forces

    def stage(self) -> Stage:
        """``force``, compiled into the closed loop."""
        raise NotImplementedError(f"{type(self).__name__}.stage() is missing; it returns a birthsim_env.loop.stage.Stage")


def forces_of(hand: UserForce, time: Array, position: Array, velocity: Array) -> Array:
    """What a hand pushes with, N, (K, 2, N), at ``time`` (K, N), s; ``position`` and ``velocity`` (2, N) in m and m/s.

    A hand may return one force per lane, (2, N), for one instant. Raises ``ValueError`` for anything but finite numbers.
    """
    force = hand.force(time, position, velocity)
    instants, lanes = time.shape
    one = (2, lanes) if instants == 1 and len(shape_of(force)) == 2 else (instants, 2, lanes)
    return checked("user_force.force(...)", force, one, "N").reshape(instants, 2, lanes)


class Knot(Rows):
    """A force, between which it is linear in time."""

    time = row("s", "since the episode began")
    force = rows("x y", "N", "of the hand")


@helper
def knot_before(times: Array, i: int, count: int, now: float) -> int:
    """The last of the ``count`` knots of lane ``i`` at or before ``now``, s, but not the very last; ``times`` (M, N), s."""
    low, high = 0, count - 1
    while high - low > 1:
        middle = (low + high) // 2
        if times[middle, i] <= now:
            low = middle
        else:
            high = middle
    return low


@kernel
def _interpolate(world: World, seen: Seen, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Knots (M, 3, N), each a ``Knot``; the first ``counts`` (N,) of them count; constant before and after."""
    knots, counts = table3(tables, 0)[:, :, lane : lane + n], table1(tables, 1)[lane : lane + n]
    time, force = seen.time, world.force
    for i in range(n):
        count = int(counts[i])
        low = knot_before(knots[:, 0], i, count, time[i])
        high = min(low + 1, count - 1)
        before, after = Knot(knots[low]), Knot(knots[high])
        span = after.time[i] - before.time[i]
        part = max(0.0, min(1.0, (time[i] - before.time[i]) / span)) if span > 0.0 else 1.0
        for axis in range(2):
            force[axis, i] = before.force[axis, i] + part * (after.force[axis, i] - before.force[axis, i])
    return 0


_NUMBERS = np.empty(0)


def _checked_knots(name: str, knots: Any, lanes: int = 1, like: Array = _NUMBERS) -> Array:
    """Knots as an array (M, 3, L), or a ``ValueError`` that names them, of the first lane that is wrong.

    They are a sequence of (time, Fx, Fy), whose entries are numbers or (L,), or symbols as those of an array that is ``like``
    them, which nobody can check.
    """
    try:
        columns = np.empty_like(like, shape=(len(knots), 3, lanes))
        for rows, knot in zip(columns, knots, strict=True):
            put(rows, slice(None), knot)
    except (TypeError, ValueError, OverflowError):
        columns = np.empty((0, 3, lanes))
    if columns.dtype == object:
        return columns
    late = columns[1:, 0] < columns[:-1, 0]
    if len(columns) == 0 or late.any() or not np.isfinite(columns).all():
        if lanes > 1:
            wrong = late.any(axis=0) | ~np.isfinite(columns).all(axis=(0, 1))
            knots = [tuple(knot) for knot in columns[:, :, int(wrong.argmax())].tolist()]
        raise ValueError(f"{name} = {shown(knots)}; allowed: finite (time, Fx, Fy) with increasing times (s, N, N)")
    return columns


class ForceProfile(CompiledForce):
    """A force that is linear between knots, and constant before the first and after the last.

    Parameters
    ----------
    knots : list of (float, float, float), optional
        (time, Fx, Fy), s since the episode began and N, with times that do not fall; else no force.

    Raises
    ------
    ValueError
        For knots that are not finite or whose times fall.

    Notes
    -----
    A class of your own may override ``knots(rng)``, which returns such a list for every episode.

    Examples
    --------
    A push along x that rises to 20 N from 1 s to 2 s:

    >>> import birthsim
    >>> push = birthsim.ForceProfile([(1.0, 0.0, 0.0), (2.0, 20.0, 0.0)])
    >>> env = birthsim.make("BirthSIM/Circle-v2", user_force=push)
    >>> observation, info = env.reset(seed=0)
    >>> for _ in range(150):
    ...     observation, reward, terminated, truncated, info = env.step(env.action_space.sample() * 0)
    >>> float(info["time"]), [round(float(force), 6) for force in info["user_force"]]
    (1.5, [10.0, 0.0])
    """

    in_state: ClassVar[Declared] = {"_knots": Kept(grows=True, shortest=1), "_counts": Kept(1, "_knots", whole=True)}
    _knots: Array = np.zeros((1, 3, 0))

    def __init__(self, knots: list[tuple[float, float, float]] | None = None) -> None:
        if not (knots is None or isinstance(knots, (list, tuple))):
            raise ValueError(f"knots = {shown(knots)}; allowed: a list of (time, Fx, Fy)")
        self._fixed = knots or [(0.0, 0.0, 0.0)]
        fixed = _checked_knots("knots", self._fixed)[:, :, 0]
        self.timed = timed(fixed[:, 0], fixed[:, 1:])

    @vectorised
    def knots(self, rng: np.random.Generator) -> list[tuple[float, float, float]]:
        """(time, Fx, Fy) of one episode, s and N, with increasing times."""
        return self._fixed

    def prepare(self, num_envs: int) -> None:
        self._knots = np.zeros((1, 3, num_envs))
        self._counts = np.ones(num_envs)

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        for one, own in served(self.knots, lane, rng):
            lanes = np.atleast_1d(one)
            columns = _checked_knots(f"{type(self).__name__}.knots(rng)", self.knots(own), len(lanes), self._knots)
            missing = len(columns) - len(self._knots)
            if missing > 0:
                self._knots = np.concatenate([self._knots, np.zeros((missing, 3, self._knots.shape[2]))])
            for knot, values in zip(self._knots, columns, strict=False):
                put(knot, lanes, values)
            self._counts[one] = len(columns)

    def first_knot(self, lanes: NDArray[np.intp]) -> float:
        """When the first knot of any of ``lanes`` (L,) is, s; 0 for a class that prepares no knots."""
        return float(self._knots[0, 0].take(lanes).min()) if self._knots.size else 0.0

    def stage(self) -> Stage:
        return Stage(_interpolate, tables=(self._knots, self._counts))


class Ramp(ForceProfile):
    """The stiffness test: from ``begins`` ramp to ``amplitude`` N over ``rise`` s along ``angle`` (rad from x), then hold.

    ``angle`` "axes" draws one of the four axis directions.
    """

    def __init__(self, amplitude: Range = 20.0, angle: Range | str = 0.0, begins: float = 1.0, rise: float = 1.0) -> None:
        super().__init__()
        if isinstance(angle, str) and angle != "axes":
            raise ValueError(f"angle = {shown(angle)}; allowed: a number or (low, high) in rad, or 'axes'")
        checked_range("amplitude", amplitude, "N", least=-STRONGEST, most=STRONGEST)
        checked_range("angle", 0.0 if isinstance(angle, str) else angle, "rad", least=-TURNED, most=TURNED)
        checked_number("begins", begins, "s", least=0.0, most=LONGEST)
        checked_number("rise", rise, "s", least=0.0, most=LONGEST)
        self.amplitude, self.angle, self.begins, self.rise = amplitude, angle, begins, rise
        self.timed = Timed(np.empty(0), begins)

    @vectorised
    def knots(self, rng: np.random.Generator) -> list[tuple[float, float, float]]:
        size = draw(self.amplitude, rng)
        x, y = exact.direction(whole(0, 4, rng) * math.pi / 2 if isinstance(self.angle, str) else draw(self.angle, rng))
        return [(0.0, 0.0, 0.0), (self.begins, 0.0, 0.0), (self.begins + self.rise, size * x, size * y)]
