"""How near the impedance felt is to the one declared: bandwidth, just noticeable differences, passivity.

Impedances are complex, N/m, (F, N) over frequencies (F,), Hz, and lanes.
"""

import numpy as np

from baselines.impedance import Complex
from birthsim_env.loop.signals import Mask
from birthsim_env.physics.compiled.lanes import Array

MAGNITUDE, PHASE = 0.10, 10.0
"""Fraction and degrees within which the impedance felt is the one declared; assumed, see docs/laboratory/haptics.md."""

WEBER, WEBER_WITHOUT_WORK = 0.15, 0.22
"""Fractions of compliance that people just notice: 15 % (Bergmann Tiest and Kappers 2009); 22 % where the work done tells
nothing (Tan et al. 1995)."""


def magnitude_error(felt: Complex, declared: Complex) -> Array:
    """``|felt| / |declared| - 1``, (F, N)."""
    return np.asarray(np.abs(felt) / np.abs(declared) - 1)


def phase_error(felt: Complex, declared: Complex) -> Array:
    """Degrees by which the force felt leads that declared, (F, N), -180 to 180."""
    return np.asarray(np.degrees(np.angle(felt / declared)))


def bandwidth(felt: Complex, declared: Complex, frequency: Array) -> Array:
    """Hz, (N,): the last line up to which, and including which, all are within ``MAGNITUDE`` and ``PHASE``; 0 if none is."""
    within = (np.abs(magnitude_error(felt, declared)) <= MAGNITUDE) & (np.abs(phase_error(felt, declared)) <= PHASE)
    return last_before(within, frequency)


def noticeable_differences(felt: Complex, declared: Complex, weber: float = WEBER) -> Array:
    """Difference of the compliances' sizes, in just noticeable differences of the one declared, (F, N)."""
    return np.asarray(np.abs(np.abs(declared) / np.abs(felt) - 1) / weber)


def unnoticed_up_to(felt: Complex, declared: Complex, frequency: Array, weber: float = WEBER) -> Array:
    """Hz, (N,): as ``bandwidth``, of lines that are less than one just noticeable difference off."""
    return last_before(noticeable_differences(felt, declared, weber) <= 1.0, frequency)


def port_damping(felt: Complex, frequency: Array) -> Array:
    """Re(Fu/v) = Im(Z)/w, N s/m, (F, N): what the port takes from a hand at a frequency; negative where it gives."""
    return np.asarray(felt.imag / (2 * np.pi * np.asarray(frequency)[:, None]))


def passivity_shortage(felt: Complex, frequency: Array) -> Array:
    """N s/m, (F, N): the damping that is missing for the port to be passive at a frequency; 0 where it is."""
    return np.maximum(-port_damping(felt, frequency), 0.0)


def last_before(holds: Mask, frequency: Array) -> Array:
    """The last frequency of the first unbroken run of what ``holds`` (F, N), from the first line on, (N,); 0 if none."""
    count = np.cumprod(holds, axis=0).sum(axis=0)
    return np.asarray(np.concatenate([[0.0], frequency])[count])
