"""What the hand does while a bandwidth is measured: pushes by name, and how many newtons each of their sines has.

A bandwidth belongs to its stimulus. Of a multisine every line has a part of the force alone, and friction hides from a line
what it does not hide from a lone sine of the whole force.
"""

import re
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cache, cached_property
from typing import ClassVar, NamedTuple

import numpy as np

from baselines.bench.statistics import number
from baselines.impedance import Complex
from birthsim_env.physics.compiled.lanes import Array
from lab.engine.study import Options
from lab.studies.haptics.multisine import unit_multisine


class Push(NamedTuple):
    """Sines that a hand does at once: their frequencies, Hz, complex amplitudes, N, (F,) each, s after which they repeat, and
    how many periods are measured."""

    frequency: Array
    force: Complex
    period: float
    periods: int


BANDS = ((0.1, 0.95, 80.0, 1), (1.0, 20.0, 20.0, 2))
"""Hz from and to; s of a period, and periods that are measured. Two multisines, so that a line has a force worth feeling."""

SLOW, SLOW_PERIOD = np.arange(1, 10) / 10.0, 10.0
"""Hz of the lines of a slow push, and s of its period; two are measured."""

SINE_STEP, SINE_TIME = 2, 2.0
"""Which lines of the grid are pushed one at a time, and s that each is measured at least, over two periods or more."""


def lines(low: float, high: float, period: float) -> Array:
    """Frequencies (F,), Hz: 20 a decade (ISO 3, R 20), to the nearest whole multiple of 1/``period``."""
    steps = np.arange(np.floor(20 * np.log10(low)), np.ceil(20 * np.log10(high)) + 1)
    exact = 10 ** (steps / 20)
    kept = exact[(exact > 0.99 * low) & (exact < 1.01 * high)]
    return np.asarray(np.unique(np.round(kept * period)) / period)


def grid() -> Array:
    """All lines of ``BANDS``, Hz."""
    return np.concatenate([lines(low, high, period) for low, high, period, _ in BANDS])


def hand_lines(peak: float, seed: int, frequency: Array, period: float) -> Complex:
    """Complex amplitudes (F,), N, of a multisine with a peak of ``peak``, N: the force is the real part of their sum."""
    size, phases = unit_multisine(seed, frequency, period)
    return np.asarray(peak * size * np.exp(1j * (phases - np.pi / 2)))


@dataclass(frozen=True)
class Stimulus(ABC):
    """A kind of push with its size, N, and the seed of its phases. Results call it by ``form`` and its size."""

    form: ClassVar[str]

    size: float
    seed: int

    @property
    def name(self) -> str:
        """What results call it."""
        return self.form.format(f"{self.size:g}")

    @cached_property
    @abstractmethod
    def pushes(self) -> list[Push]:
        """One after the other."""

    @property
    @abstractmethod
    def words(self) -> str:
        """What tables say: how many sines at once, and the newtons of each."""

    def together(self, frequency: float) -> float:
        """N, root mean square, of what a hand does at once of its lines up to ``frequency``, Hz."""
        own = [np.abs(push.force[push.frequency <= 1.001 * frequency]) for push in self.pushes]
        return float(max(np.sqrt((size**2).sum() / 2) for size in own))


@dataclass(frozen=True)
class Multisine(Stimulus):
    """Two multisines over ``BANDS`` that reach ``size``."""

    form = "{} N"

    @cached_property
    def pushes(self) -> list[Push]:
        found = []
        for low, high, period, periods in BANDS:
            own = lines(low, high, period)
            found.append(Push(own, hand_lines(self.size, self.seed, own, period), period, periods))
        return found

    @property
    def words(self) -> str:
        parts = [f"{len(one.frequency)} lines of {number(float(np.abs(one.force[0])))} N" for one in self.pushes]
        return f"{' and then '.join(parts)}, {self.size:g} N at most"


@dataclass(frozen=True)
class SlowLines(Stimulus):
    """The lines ``SLOW`` at once, of ``size`` each."""

    form = "slow lines of {} N"

    @cached_property
    def pushes(self) -> list[Push]:
        most = self.size / unit_multisine(self.seed, SLOW, SLOW_PERIOD)[0]
        return [Push(SLOW, hand_lines(most, self.seed, SLOW, SLOW_PERIOD), SLOW_PERIOD, 2)]

    @property
    def words(self) -> str:
        return f"{len(SLOW)} lines of {self.size:g} N to {SLOW[-1]:g} Hz"


@dataclass(frozen=True)
class LoneSines(Stimulus):
    """One sine at a time."""

    form = "one sine of {} N"

    @cached_property
    def pushes(self) -> list[Push]:
        force = np.array([-1j * self.size])
        return [Push(own, force, 1 / own[0], max(2, round(SINE_TIME * own[0]))) for own in grid()[::SINE_STEP, None]]

    @property
    def words(self) -> str:
        return f"a lone sine of {self.size:g} N"


KINDS: dict[str, type[Stimulus]] = {"peak": Multisine, "slow": SlowLines, "sine": LoneSines}
"""Option of studies that has sizes, N -> the kind of push."""


def stimuli(options: Options) -> dict[str, Stimulus]:
    """Name -> push, of all sizes that the options of ``KINDS`` have; ``seed`` is that of the phases."""
    every = [kind(size, options.seed) for option, kind in KINDS.items() for size in getattr(options, option)]
    return {one.name: one for one in every}


@cache
def words_of(name: str, seed: int) -> str:
    """What tables call the push that results call ``name``."""
    for kind in KINDS.values():
        if found := re.fullmatch(kind.form.format(r"([\d.e+-]+)"), name):
            return kind(float(found[1]), seed).words
    raise ValueError(f"push = {name!r}; allowed: {', '.join(kind.form.format('5') for kind in KINDS.values())}")
