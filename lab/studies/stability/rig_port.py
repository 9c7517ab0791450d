"""A rig with its law and sensors, as a hand at the end effector finds it.

The hand answers at the integrator's steps, not at those of the control board. Its force is held for such a step, at the value
that it takes half a step ahead: else a spring would gain energy. A mass of the hand moves with the end effector and carries
its own weight.
"""

import inspect
from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from baselines.bench.resting import RestingRigs
from baselines.controller import Controller
from birthsim_env.loop.signals import Reference
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.dynamics import INTEGRATION_STEP
from birthsim_env.physics.rig.parameters import Parameters

Hand = Callable[[float, Array, Array], Array]
"""Time (s), position (2, N) (m) and velocity (2, N) (m/s) -> force of the hand (2, N), N, without that of its mass."""


class Port(Protocol):
    """What a hand can hold: N lanes, carried on by one ``period`` (s) at a time.

    ``force`` (2, N), N, is what passed through the port at the start of the last period; ``energy`` (N,), J, is what the port
    has given to the hand since the start, - integral of Fu . v dt.
    """

    period: float
    lanes: int
    force: Array
    energy: Array

    def motion(self) -> Array:
        """Position and velocity now, (4, N): x, y (m), vx, vy (m/s)."""
        ...

    def advance(self, hand: Hand) -> None:
        """Go on by one period with this hand."""
        ...


class RigPort:
    """N rigs at rest on their targets, one control period at a time.

    ``rigs`` has a rig per lane, ``reference`` a resting target in every lane. ``sensors`` is the name of a sensor model; lane i
    seeds it with ``seed`` + i. ``hand_mass`` (N,) is in kg. ``damping_factor`` (N,) is for laws whose ``command`` takes one.
    With ``force_sensor`` False the law sees a force of zero. Raises ``ValueError`` for a target outside the workspace.

    Besides what ``Port`` has: ``air`` (N,), kg from the supply; ``saturated`` (N,), periods with a valve at its limit;
    ``impacts`` (N,), m/s, the fastest collision with an end stop; ``openings`` (4, N), those last commanded.
    """

    def __init__(
        self,
        rigs: Sequence[Parameters],
        reference: Reference,
        controller: Controller,
        sensors: str = "ideal",
        seed: int = 0,
        hand_mass: Array | None = None,
        damping_factor: Array | None = None,
        force_sensor: bool = True,
    ) -> None:
        self.lanes = len(rigs)
        self._hand_mass = np.zeros(self.lanes) if hand_mass is None else np.asarray(hand_mass, dtype=np.float64)
        pairs = zip(rigs, self._hand_mass, strict=True)
        heavy = [rig.replace({"mechanics.mass": rig.mechanics.mass + float(more)}) if more else rig for rig, more in pairs]
        told = {} if damping_factor is None else {"damping_factor": damping_factor}
        self._loop = RestingRigs(rigs, reference, controller, sensors, seed, force_sensor, heavy, None, told)
        self._weight = np.array([np.zeros(self.lanes), self._hand_mass * [rig.mechanics.gravity for rig in rigs]])
        self._motion, self._acceleration, self.force = self._loop.motion, np.zeros((2, self.lanes)), self._loop.pushed
        self.period = self._loop.period
        self._answers = max(1, round(self.period / INTEGRATION_STEP))
        self.energy, self.air = np.zeros(self.lanes), np.zeros(self.lanes)
        self.saturated, self.impacts = np.zeros(self.lanes), np.zeros(self.lanes)
        self._hand: Hand = no_hand
        self.openings = self._loop.opened
        self._loop.close([self._push], carry=[self._answer])

    def motion(self) -> Array:
        """Position and velocity of the end effector now, (4, N): x, y (m), vx, vy (m/s)."""
        return self._motion

    def advance(self, hand: Hand) -> None:
        """Measure, command, and let the plant go on by one control period."""
        self._hand = hand
        self._loop.run(1)

    def _push(self, _: int) -> None:
        force = self._hand(float(self._loop.time[0]), self._motion[:2], self._motion[2:])
        self.force[:] = force - self._hand_mass * self._acceleration

    def _answer(self, _: int) -> None:
        plant, openings, step, now = self._loop.plant, self._loop.opened, self.period / self._answers, self._loop.time[0]
        for answer in range(self._answers):
            place, speed = self._motion[:2], self._motion[2:]
            force = self._hand(float(now + (answer + 0.5) * step), place + 0.5 * step * speed, speed)
            plant.advance_unchecked(openings, np.ascontiguousarray((force + self._weight)[None]), step)
            self._motion = plant.end_effector()
            gained = self._motion[2:] ** 2 - speed**2
            self._acceleration = (self._motion[2:] - speed) / step
            self.energy += (0.5 * self._hand_mass * gained - force * (self._motion[:2] - place)).sum(axis=0)
            np.maximum(self.impacts, plant.impacts.max(axis=0), out=self.impacts)
        self.air += plant.mass_flows()[:4].sum(axis=0) * self.period
        self.saturated += np.abs(openings).max(axis=0) >= 1.0
        self._loop.moves()


def no_hand(now: float, position: Array, velocity: Array) -> Array:
    """Nobody holds the end effector."""
    return np.zeros_like(position)


def takes_damping_factor(controller: Controller) -> bool:
    """Whether a law's damping can be varied from outside."""
    return "damping_factor" in getattr(controller, "COMMAND_OPTIONS", inspect.signature(controller.command).parameters)
