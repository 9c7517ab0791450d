"""What pushes the end effector: the scenario's hand and the person's, a spring to the pointer."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from birthsim_env.parts.hands.user_forces import UserForce
from birthsim_env.physics.compiled.lanes import Array
from birthsim_live.rig.bridge import Fade

DRAG_LIMIT = 100.0
"""N, assumed: the person's hand pulls no harder, however far the pointer is. At 120 N downwards, more than cylinder 1 can
hold, it slams into its end stop so fast that the pressure there leaves what the model describes; at 100 N it never did."""

PATIENCE = 3.0
"""s of wall time, assumed: a hand that has not been heard of for longer lets go; the page tells of one that rests every 0.3 s.
A window that is frozen would pull for ever."""

DRAG_DAMPING = 20.0
"""N s/m, assumed: a hand is no bare spring; it acts only while the pointer holds."""

TRANSITION = 0.1
"""s, assumed: in which a scenario's hand takes hold and lets go where it would jump."""


def drag_force(pointer: Array, position: Array, velocity: Array, stiffness: float) -> Array:
    """Force of the person's hand, N: spring and damper from ``position`` to ``pointer``, m, no more than ``DRAG_LIMIT``."""
    return limited(stiffness * (pointer - position) - DRAG_DAMPING * velocity)


def limited(pull: Array) -> Array:
    """A force (2,), N, shortened to ``DRAG_LIMIT`` where it is larger."""
    size = math.sqrt(pull[0] * pull[0] + pull[1] * pull[1])  # as the page without a server: hypot rounds otherwise
    return np.asarray(pull * (DRAG_LIMIT / size) if size > DRAG_LIMIT else pull)


@dataclass(frozen=True)
class Hold:
    """The person's hand is at ``position`` (2,), m, since the message ``id``: several rigs feel one place of the hand."""

    position: Array
    id: int

    def force(self, position: Array, velocity: Array, stiffness: float) -> Array:
        """What an end effector feels, N, (2,)."""
        return drag_force(self.position, position, velocity, stiffness)

    def pointer(self, position: Array, stiffness: float) -> Array:
        """Where the spring from an end effector ends, m, (2,)."""
        return self.position


@dataclass(frozen=True)
class Push:
    """The person's hand pushes with ``newtons`` (2,) since the message ``id``: several rigs feel one force."""

    newtons: Array
    id: int

    def force(self, position: Array, velocity: Array, stiffness: float) -> Array:
        """What an end effector feels, N, (2,)."""
        return limited(self.newtons)

    def pointer(self, position: Array, stiffness: float) -> Array:
        """Where a spring with this force would end, m, (2,)."""
        return np.asarray(position + self.newtons / stiffness)


class Hands(UserForce):
    """The scenario's force, where it is wanted, and the person's, on one lane.

    ``hold`` is what the person's hand does, or None, and may be set from another thread; ``stiffness``, N/m, is that of its
    spring. ``scenario_now`` and ``drag_now`` (2,) are the two forces as last asked for, N, the latter of the hold ``felt``;
    ``used`` is the last hold's id.
    """

    closed_loop = True

    def __init__(self, force: UserForce, wanted: bool, stiffness: float) -> None:
        self._force, self.wanted, self.stiffness = force, wanted, stiffness
        self.jump_rate = force.jump_rate
        self.begins = 0.0
        self.hold: Hold | Push | None = None
        self.felt: Hold | Push | None = None
        self.used: int | None = None
        self.scenario_now: Array = np.zeros(2)
        self.drag_now: Array = np.zeros(2)
        self._fade: Fade | None = None
        self._motion: tuple[Array, Array] = np.zeros((2, 1)), np.zeros((2, 1))

    def prepare(self, num_envs: int) -> None:
        self._force.prepare(num_envs)

    def begin(self, lane: int, rng: np.random.Generator) -> None:
        self._force.begin(lane, rng)
        self.begins, self._fade = 0.0, None

    def force(self, time: Array, position: Array, velocity: Array) -> Array:
        self._motion = position, velocity
        now = float(time[0, 0])
        forces = self._scenario_at(now)
        if self._fade is not None and not self._fade.over(now):
            forces[0, :, 0] += self._fade.sample(now)[0]
        self.scenario_now = forces[0, :, 0].copy()
        hold = self.felt = self.hold
        if hold is None:
            self.drag_now = np.zeros(2)
        else:
            self.drag_now, self.used = hold.force(position[:, 0], velocity[:, 0], self.stiffness), hold.id
            forces[0, :, 0] += self.drag_now
        return forces

    def follow(self, force: UserForce, rng: np.random.Generator, now: float) -> None:
        """From ``now``, s, on let another scenario's hand push (or the same one anew)."""
        force.prepare(1)
        force.begin(0, rng)
        self._force, self.begins, self.jump_rate = force, now, force.jump_rate
        self._pass_over(now)

    def want(self, wanted: bool, now: float) -> None:
        """From ``now``, s, on keep or drop the scenario's hand."""
        self.wanted = wanted
        self._pass_over(now)

    def _scenario_at(self, now: float) -> Array:
        """The scenario's force where the end effector was last seen, N, (1, 2, 1)."""
        if not self.wanted:
            return np.zeros((1, 2, 1))
        instant = np.full((1, 1), now - self.begins)
        return np.array(self._force.force(instant, *self._motion))

    def _pass_over(self, now: float) -> None:
        self._fade = Fade(now, TRANSITION, self.scenario_now - self._scenario_at(now)[0, :, 0])
