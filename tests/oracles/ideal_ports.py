"""Ports whose impedance is known in closed form: Z(s) = m s^2 + b s + K exp(-s T), the same along x and y."""

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq

from birthsim_env.physics.compiled.lanes import Array
from lab.studies.stability.rig_port import Hand

PERIOD, ANSWERS = 1e-3, 4
STEP = PERIOD / ANSWERS


class IdealPort:
    """N masses (kg) on dampers (N s/m) and springs (N/m) to ``target`` (2,), m; the springs answer ``delay`` s late.

    Solved exactly for forces that are held for 0.25 ms; a delayed spring's force is held at the mean of its two ends.
    """

    def __init__(self, mass: Array, damping: Array, stiffness: Array, delay: float = 0.0, target: Array | None = None) -> None:
        self.lanes, self.period, self.late = len(mass), PERIOD, round(delay / STEP)
        self.target = np.reshape(np.zeros(2) if target is None else target, (2, 1))
        self.stiffness = stiffness
        self.step = np.empty((self.lanes, 3, 3))
        for lane, (m, b, k) in enumerate(zip(mass, damping, stiffness, strict=True)):
            inside = 0.0 if self.late else k
            self.step[lane] = expm(STEP * np.array([[0, 1, 0], [-inside / m, -b / m, 1 / m], [0, 0, 0]]))
        self.place, self.speed = np.zeros((2, self.lanes)), np.zeros((2, self.lanes))
        self.past = [np.zeros((2, self.lanes))] * (self.late + 1)
        self.force, self.energy, self.ticks = np.zeros((2, self.lanes)), np.zeros(self.lanes), 0

    def motion(self) -> Array:
        return np.concatenate([self.place + self.target, self.speed])

    def advance(self, hand: Hand) -> None:
        now = self.ticks * PERIOD
        self.force = hand(now, self.place + self.target, self.speed)
        a = self.step
        for answer in range(ANSWERS):
            force = hand(now + (answer + 0.5) * STEP, self.place + 0.5 * STEP * self.speed + self.target, self.speed)
            spring = -self.stiffness * (self.past[0] + self.past[1]) / 2 if self.late else 0.0
            place = a[:, 0, 0] * self.place + a[:, 0, 1] * self.speed + a[:, 0, 2] * (force + spring)
            self.speed = a[:, 1, 0] * self.place + a[:, 1, 1] * self.speed + a[:, 1, 2] * (force + spring)
            self.energy = self.energy - (force * (place - self.place)).sum(axis=0)
            self.place, self.past = place, [*self.past[1:], place]
        self.ticks += 1


def impedance(frequency: Array, mass: float, damping: float, stiffness: float, delay: float = 0.0) -> Array:
    """Z(jw), N/m, at frequencies (Hz)."""
    s = 2j * np.pi * frequency
    return mass * s**2 + damping * s + stiffness * np.exp(-s * delay)


def stiffest(mass: float, damping: float, delay: float, hand: float) -> float:
    """The delayed stiffness, N/m, at which a free port, or one held by a spring ``hand`` (N/m), begins to oscillate.

    On the border -m w^2 + j w b + K exp(-j w T) + k = 0: K sin(wT) = b w and K cos(wT) = m w^2 - k.
    """

    def excess(w: float) -> float:
        return float(damping * w / np.tan(w * delay) - mass * w * w + hand)

    w = brentq(excess, 1e-3, np.pi / delay - 1e-6)
    return float(damping * w / np.sin(w * delay))
