"""Multisine hand forces, and the impedance that they meet.

A multisine is a sum of sines at whole multiples of one frequency. Over whole periods of a steady response the discrete Fourier
transform gives force and motion at each line without leakage. Only odd multiples are used: squares of the motion, as of the
geometry, then fall between the lines (Pintelon and Schoukens, System Identification, 2nd ed. 2012, chapters 2 and 4).
"""

import numpy as np

from baselines.bench.statistics import number
from baselines.impedance import Complex
from birthsim_env.physics.compiled.lanes import Array
from lab.studies.haptics.recording import Recording
from lab.studies.stability.rig_port import Hand

FUNDAMENTAL = 0.2
"""Hz: 5 s a period."""

MULTIPLES = (1, 3, 5, 7, 11, 15, 21, 29, 39, 51, 67, 87, 113, 149)
"""Odd, about 1.3 times the one before from 1 Hz on: 0.2 to 29.8 Hz."""

FREQUENCIES: Array = FUNDAMENTAL * np.array(MULTIPLES, dtype=np.float64)
"""Hz, (F,)."""

SETTLING, MEASURED = 1, 2
"""Periods that die away, and that are measured; assumed."""

FADE = 0.5
"""s over which the force comes in; assumed, so that no valve saturates from the start."""

DRAWS = 300
"""Sets of random phases of which the one with the lowest peak is taken."""

SECONDS = (SETTLING + MEASURED) / FUNDAMENTAL


def unit_multisine(seed: int, frequency: Array = FREQUENCIES, period: float = 1 / FUNDAMENTAL) -> tuple[float, Array]:
    """Size of the equal sines of ``frequency`` (F,), Hz, whose sum has a peak of 1, and their phases (F,), rad.

    The phases are the best of ``DRAWS`` random sets; every line is a whole multiple of 1/``period``.
    """
    drawn = np.random.default_rng(seed).uniform(0, 2 * np.pi, (DRAWS, len(frequency)))
    time = np.arange(0, period, 4e-3)
    peaks = [np.abs(sines(time, frequency, one)).max() for one in drawn]
    chosen = np.asarray(drawn[int(np.argmin(peaks))])
    return 1 / float(np.abs(sines(np.arange(0, period, 1e-3), frequency, chosen)).max()), chosen


def words(peak: float, seed: int) -> str:
    """What tables say of the multisine of ``FREQUENCIES`` that reaches ``peak``, N: how many lines, and the newtons of each."""
    return f"{len(FREQUENCIES)} lines of {number(peak * unit_multisine(seed)[0])} N, {peak:g} N at most"


def multisine_hand(direction: Array, peak: Array, seed: int) -> Hand:
    """A hand that pushes and pulls along unit vectors ``direction`` (2, N) with at most ``peak`` (N,), N."""
    size, chosen = unit_multisine(seed)
    force = direction * peak * size

    def hand(now: float, position: Array, velocity: Array) -> Array:
        return np.asarray(force * min(now / FADE, 1.0) * sines(np.array([now]), FREQUENCIES, chosen)[0])

    return hand


def measured_part(recording: Recording) -> Recording:
    """The whole periods that are measured."""
    return recording.part(SETTLING / FUNDAMENTAL, SECONDS)


def impedance_felt(recording: Recording, direction: Array) -> Complex:
    """Z(jw) = Fu/(x - xt) along ``direction`` (2, N), N/m, (F, N), from the measured part of a recording.

    The target rests, so that it changes no line.
    """
    part = measured_part(recording)
    turns = np.exp(-2j * np.pi * FREQUENCIES[:, None] * part.time)
    motion, force = (np.einsum("tin,in->tn", rows, direction) for rows in (part.position - part.position[0], part.force))
    return np.asarray((turns @ force) / (turns @ motion))


def sines(time: Array, frequency: Array, angles: Array) -> Array:
    """Sum of unit sines of ``frequency`` (F,), Hz, with phases ``angles`` (F,), rad, at times (T,), s: (T,)."""
    return np.asarray(np.sin(2 * np.pi * frequency * time[:, None] + angles).sum(axis=1))
