"""The hand ``guided``: with mass, damper and spring, it holds the end effector and guides it."""

import math
from typing import Self

import numpy as np

from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.signals import Point
from birthsim_env.loop.stage import Stage, table2, table3
from birthsim_env.parts.drawn.seeding import Range, draw, put, vectorised
from birthsim_env.parts.hands.user_forces import CompiledForce
from birthsim_env.parts.references import LONGEST, minimum_jerk
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Numbers, Rows, number, row, rows
from birthsim_env.physics.rig.values import checked_range
from birthsim_env.registry import register

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


@register(hand="guided", about="A hand with mass, damper and spring that leads the head from place to place.", order=4)
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

    @classmethod
    def varied(cls) -> Self:
        return cls(mass=(0.6, 1.6), stiffness=(150.0, 600.0), lasts=(1.5, 3.0))

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
