"""Hands that keep moving: a sine, noise, and a hand with mass, damper and spring that holds the end effector and guides it.

None of them jumps: whatever they do, the rig can be asked to give way.
"""

import math
from collections.abc import Callable

import numpy as np

from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.signals import Point
from birthsim_env.loop.stage import Stage, table2, table3, table4
from birthsim_env.parts.drawn.seeding import Range, draw, put, vectorised
from birthsim_env.parts.hands.user_forces import STRONGEST, AlternatingSteps, CompiledForce, UserForce
from birthsim_env.parts.references import LONGEST, TURNED, minimum_jerk
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Numbers, Rows, number, row, rows
from birthsim_env.physics.rig.values import checked_range, shown

FADE = 0.5
"""s over which a sine and noise begin, at minimum jerk."""

WAVES = 16
"""Sines that noise is made of, per axis."""


class Wave(Rows):
    """A sine."""

    amplitude = row("N", "amplitude")
    rate = row("rad/s", "angular frequency")
    phase = row("rad", "at the beginning")


@kernel
def _waves(world: World, seen: Seen, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Table (2, W, 3, N): of each axis the waves, each a ``Wave``."""
    time, own, force = seen.time, table4(tables, 0)[:, :, :, lane : lane + n], world.force
    for i in range(n):
        fraction = minimum_jerk(time[i] / FADE, 0)
        for axis in range(2):
            total = 0.0
            for w in range(own.shape[1]):
                wave = Wave(own[axis, w])
                total += wave.amplitude[i] * exact.sine(wave.rate[i] * time[i] + wave.phase[i])
            force[axis, i] = fraction * total
    return 0


class _Waves(CompiledForce):
    """Sums of sines."""

    jump_rate = math.inf
    waves = 1

    def prepare(self, num_envs: int) -> None:
        self._own: Array = np.zeros((2, self.waves, Wave.size, num_envs))

    def stage(self) -> Stage:
        return Stage(_waves, tables=(self._own,))


class Sine(_Waves):
    """``amplitude`` N at ``frequency`` Hz along ``angle`` (rad from x)."""

    def __init__(self, amplitude: Range = 20.0, frequency: Range = 1.0, angle: Range = 0.0) -> None:
        checked_range("amplitude", amplitude, "N", least=-STRONGEST, most=STRONGEST)
        checked_range("frequency", frequency, "Hz", least=0.0, most=FASTEST)
        checked_range("angle", angle, "rad", least=-TURNED, most=TURNED)
        self.amplitude, self.frequency, self.angle = amplitude, frequency, angle

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        size, rate, angle = draw(self.amplitude, rng), 2 * math.pi * draw(self.frequency, rng), draw(self.angle, rng)
        x, y = exact.direction(angle)
        put(self._own[:, 0, 0], lane, (size * x, size * y))
        put(self._own[:, 0, 1], lane, (rate, rate))


class Noise(_Waves):
    """Random force of ``rms`` N, the root mean square of its size, with all frequencies of ``band`` (low, high), Hz, alike."""

    waves = WAVES

    def __init__(self, rms: Range = 15.0, band: tuple[float, float] = (0.1, 3.0)) -> None:
        checked_range("rms", rms, "N", least=0.0, most=STRONGEST)
        if not isinstance(band, tuple) or checked_range("band", band, "Hz", above=0.0, most=FASTEST)[0] == band[1]:
            raise ValueError(f"band = {shown(band)}; allowed: (low, high), 0 < low < high (Hz)")
        self.rms, self.band = rms, band

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        low, high = self.band
        # One frequency in each of equal parts of the band: none is missing, and no two lanes repeat each other.
        wave = np.arange(self.waves).reshape(-1, *[1] * np.ndim(lane))
        parts = low + (high - low) * (wave + rng.uniform(size=(2, self.waves))) / self.waves
        size, phases = draw(self.rms, rng) / math.sqrt(self.waves), rng.uniform(0, 2 * math.pi, (2, self.waves))
        for axis, own in enumerate(self._own):
            put(own[:, 0], lane, [size] * self.waves)
            put(own[:, 1], lane, 2 * math.pi * parts[axis])
            put(own[:, 2], lane, phases[axis])


FASTEST = 100.0
"""Hz: hands move at a few, and a control period is a ms."""

CALM = 1.0
"""s for which the guiding hand holds still at first."""

POINTS = 12
"""Places that it goes to, one after the other and again."""

STEP, MOST_STEPS = 0.001, 10
"""s, steps in which the hand's own motion is integrated; how many they are in the longest control period."""


class Arm(Rows):
    """An arm that goes from place to place."""

    mass = row("kg", "at the hand")
    stiffness = row("N/m", "of the spring to where it wants to be")
    damping = row("N s/m", "of the damper beside it")
    lasts = row("s", "from place to place")


class Hand(Rows):
    """Where the hand is."""

    position = rows("x y", "m", "of the hand")
    velocity = rows("vx vy", "m/s", "of the hand")
    origin = rows("x y", "m", "where it began")
    time = row("s", "of these; infinite before it takes hold of the end effector")


class Grip(Numbers):
    """Skin and fingers."""

    stiffness = number("N/m", "between hand and end effector")
    damping = number("N s/m", "between hand and end effector")


@kernel
def _guide(world: World, seen: Seen, hand: Hand, grip: Grip, tables: int, lane: int, n: int) -> int:
    """Tables: ``Arm``, and points (POINTS, 2, N), m from where the hand began."""
    arm, points = Arm(table2(tables, 0)[:, lane : lane + n]), table3(tables, 1)[:, :, lane : lane + n]
    time, motion = seen.time, world.motion
    for i in range(n):
        mass, spring, damper, lasts = arm.mass[i], arm.stiffness[i], arm.damping[i], arm.lasts[i]
        if not (hand.time[i] <= time[i]):
            for axis in range(2):
                place, speed = motion.position[axis, i], motion.velocity[axis, i]
                hand.position[axis, i], hand.velocity[axis, i], hand.origin[axis, i] = place, speed, place
            hand.time[i] = time[i]
        passed = time[i] - hand.time[i]
        steps = min(math.ceil(passed / STEP - 1e-6), MOST_STEPS)
        for step in range(steps):
            h = passed / steps
            now = hand.time[i] + h * (step + 1)
            leg = max(0.0, now - CALM) / lasts
            place = int(leg)
            u, earlier = 2.0 * (leg - place), (place - 1) % POINTS
            for axis in range(2):
                before = points[earlier, axis, i] if place > 0 else 0.0
                way = points[place % POINTS, axis, i] - before
                wanted = hand.origin[axis, i] + before + way * minimum_jerk(u, 0)
                pace = way * minimum_jerk(u, 1) * 2.0 / lasts if now > CALM and u < 1.0 else 0.0
                held = _held(motion, hand, grip, axis, i)
                push = spring * (wanted - hand.position[axis, i]) + damper * (pace - hand.velocity[axis, i]) - held
                hand.velocity[axis, i] += h * push / mass
                hand.position[axis, i] += h * hand.velocity[axis, i]
        hand.time[i] = time[i]
        for axis in range(2):
            world.force[axis, i] = _held(motion, hand, grip, axis, i)
    return 0


@helper
def _held(motion: Point, hand: Hand, grip: Grip, axis: int, i: int) -> float:
    """What the grip pulls the end effector with, N."""
    off, pace = hand.position[axis, i] - motion.position[axis, i], hand.velocity[axis, i] - motion.velocity[axis, i]
    pull: float = grip.stiffness * off + grip.damping * pace
    return pull


class Guided(CompiledForce):
    """A hand that holds the end effector and leads it from place to place.

    The arm is a mass (kg) on a spring (N/m) and damper to where it wants to be; the grip between hand and end effector is
    springy too. It holds still for ``CALM`` s, then goes to a place within ``reach`` (m) of the beginning, at minimum jerk in
    half of ``lasts`` (s), stays for the other half, and goes to the next. All values are assumed: arms have 100 to 600 N/m
    and about 1 kg at the hand (Tsuji et al. 1995).
    """

    closed_loop = True
    jump_rate = math.inf

    GRIP = (3000.0, 40.0)
    """N/m and N s/m of skin and fingers; assumed."""

    DAMPING = 0.7
    """Damping ratio of the arm; assumed."""

    def __init__(
        self, mass: Range = 1.0, stiffness: Range = 400.0, reach: tuple[float, float] = (0.02, 0.05), lasts: Range = 2.0
    ) -> None:
        checked_range("mass", mass, "kg", least=0.05, most=100.0)
        checked_range("stiffness", stiffness, "N/m", least=0.0, most=2e4)
        checked_range("reach", reach, "m", least=0.0, most=1.0)
        checked_range("lasts", lasts, "s", least=0.1, most=LONGEST)
        self.mass, self.stiffness, self.reach, self.lasts = mass, stiffness, reach, lasts

    def prepare(self, num_envs: int) -> None:
        self._own: Array = np.ones((Arm.size, num_envs))
        self._points: Array = np.zeros((POINTS, 2, num_envs))
        self._state: Array = np.full((Hand.size, num_envs), np.inf)

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        mass, spring = draw(self.mass, rng), draw(self.stiffness, rng)
        put(self._own, lane, (mass, spring, 2 * self.DAMPING * np.sqrt(mass * spring), draw(self.lasts, rng)))
        for point in self._points:
            size, angle = draw(self.reach, rng), rng.uniform(0, 2 * math.pi)
            x, y = exact.direction(angle)
            put(point, lane, (size * x, size * y))
        Hand(self._state).time[lane] = np.inf  # it takes hold of the end effector wherever that is

    def stage(self) -> Stage:
        return Stage(_guide, np.array(self.GRIP), self._state, (self._own, self._points))


_ANYWHERE = (0.0, 2 * math.pi)

HANDS: dict[str, tuple[Callable[[], UserForce], Callable[[], UserForce]]] = {
    "steps": (AlternatingSteps, lambda: AlternatingSteps(amplitude=(10.0, 40.0), repeats=3)),
    "sine": (Sine, lambda: Sine(amplitude=(10.0, 30.0), frequency=(0.3, 2.0), angle=_ANYWHERE)),
    "noise": (Noise, lambda: Noise(rms=(8.0, 20.0))),
    "guided": (Guided, lambda: Guided(mass=(0.6, 1.6), stiffness=(150.0, 600.0), lasts=(1.5, 3.0))),
}
"""Name -> makers of a hand: as it is, and varied from episode to episode."""
