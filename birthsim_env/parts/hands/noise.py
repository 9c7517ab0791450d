"""The hand ``noise``."""

import math
from typing import Self

import numpy as np

from birthsim_env.parts.drawn.seeding import Range, draw, put, vectorised
from birthsim_env.parts.hands.user_forces import STRONGEST
from birthsim_env.parts.hands.waves import FASTEST, Waves
from birthsim_env.physics.rig.values import checked_range, shown
from birthsim_env.registry import register

WAVES = 16
"""Sines that noise is made of, per axis."""


@register(hand="noise", about="A random force of all frequencies of a band.", order=3)
class Noise(Waves):
    """Random force of ``rms`` N, the root mean square of its size, with all frequencies of ``band`` (low, high), Hz, alike."""

    waves = WAVES

    def __init__(self, rms: Range = 15.0, band: tuple[float, float] = (0.1, 3.0)) -> None:
        checked_range("rms", rms, "N", least=0.0, most=STRONGEST)
        if not isinstance(band, tuple) or checked_range("band", band, "Hz", above=0.0, most=FASTEST)[0] == band[1]:
            raise ValueError(f"band = {shown(band)}; allowed: (low, high), 0 < low < high (Hz)")
        self.rms, self.band = rms, band

    @classmethod
    def varied(cls) -> Self:
        return cls(rms=(8.0, 20.0))

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
