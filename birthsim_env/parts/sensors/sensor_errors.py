"""What is wrong with the ``honest`` sensors of each lane in one episode: figures of the sensors and the errors drawn from them.

The tracker's distortion is a sum of ``WAVES`` plane waves per axis whose directions and phases an episode draws, less its
value where the tracker was registered: smooth, with the wavelength ``distortion_length`` and the given RMS over phases.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from birthsim_env.parts.sensors import acceleration
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.electronics import Electronics

FIGURES = tuple(
    field.name for field in dataclasses.fields(Electronics) if field.metadata["randomized"] or field.metadata["worth"]
)
"""Figures in which lanes may differ, in the order of their fields."""
(
    POSITION_NOISE, POSITION_LATENCY, PRESSURE_NOISE, FORCE_NOISE, FORCE_BIAS, FORCE_GAIN, FORCE_CROSSTALK, FORCE_BANDWIDTH,
    FORCE_LATENCY, GROWTH, DISTORTION, LENGTH, SCALE, DROPOUT, PRESSURE_BIAS, ADC_BITS, DAC_BITS, MISSED, JITTER,
) = range(len(FIGURES))  # fmt: skip

WAVES = 3

UNIT = 11 + 4 * WAVES
"""Numbers in [-1, 1) that an episode draws: gain, crosstalk and bias of the force per axis, pressure bias per chamber, scale,
direction and phase of every wave."""

GAIN = len(FIGURES)
"""First of the rows that are worked out from figures and draws; those before it are the figures themselves."""
CROSSTALK = GAIN + 2
BIAS = CROSSTALK + 2
CELLS = BIAS + 2
"""Bias of each pressure cell, Pa."""
SCALED = CELLS + 4
PASSED = SCALED + 1
"""Fraction of a force's change that passes the low-pass in a control period."""
DELAY = PASSED + 1
"""Control periods by which the force is late."""
FORCE_STEP, PRESSURE_STEP, OPENING_STEP = DELAY + 1, DELAY + 2, DELAY + 3
"""Least steps of the converters, N, Pa and of openings; 0 where there is none."""
WAVE = DELAY + 4
"""Wave numbers along x and y, 1/m, and phase, rad, of each wave of each axis."""
HEIGHT = WAVE + 6 * WAVES
"""Amplitude of a wave, m."""
REGISTERED = HEIGHT + 1
"""The field where the tracker was registered, m."""
ACCELERATION_BIAS = REGISTERED + 2
"""Of each axis, m/s2, and then its error of gain. ``work_out`` leaves them."""
ACCELERATION_GAIN = ACCELERATION_BIAS + 2
ROWS = ACCELERATION_GAIN + 2

PERIOD, RATE, AT_X, AT_Y, FROM_X, FROM_Y, FORCE_RANGE, PRESSURE_RANGE, STAMPED, FEELS, ACCELERATION_NOISE = range(11)
"""Constants that all lanes share: control period, rate of the tracker, places of registration and transmitter, full scales,
the latency of the tracker that its samples are stamped with, what passes the low-pass of an acceleration sensor in a period
(0: there is none), and its noise."""
CONSTANTS = 11


def shared(electronics: Electronics, rate: float) -> Array:
    """The constants (CONSTANTS,), SI units; ``rate`` is the tracker's, Hz."""
    e = electronics
    places = (e.registration_x, e.registration_y, e.transmitter_x, e.transmitter_y)
    felt = acceleration.passed(e.acceleration_bandwidth, e.control_period), e.acceleration_noise
    return np.array((e.control_period, rate, *places, e.force_range, e.pressure_range, e.position_latency, *felt))


@helper
def _step(span: float, bits: float) -> float:
    """Least step of a converter with a whole number of bits over a span; 0 without one."""
    return span / exact.exp2(math.floor(bits + 0.5)) if bits >= 0.5 else 0.0


@helper
def field(errors: Array, i: int, axis: int, x: float, y: float) -> float:
    """The distortion of one axis of lane ``i`` at a place, m, before that at the registration is taken off."""
    total = 0.0
    for wave in range(WAVES):
        row = WAVE + 3 * (axis * WAVES + wave)
        total += exact.sine(errors[row, i] * x + errors[row + 1, i] * y + errors[row + 2, i])
    distortion: float = errors[HEIGHT, i] * total
    return distortion


@kernel
def work_out(figures: Array, unit: Array, constants: Array, errors: Array) -> None:
    """Fill ``errors`` (ROWS, L) from ``figures`` (FIGURES, L) and what an episode has drawn, ``unit`` (UNIT, L) in [-1, 1)."""
    period = constants[PERIOD]
    for i in range(figures.shape[1]):
        for k in range(GAIN):
            errors[k, i] = figures[k, i]
        for axis in range(2):
            errors[GAIN + axis, i] = figures[FORCE_GAIN, i] * unit[axis, i]
            errors[CROSSTALK + axis, i] = figures[FORCE_CROSSTALK, i] * unit[2 + axis, i]
            errors[BIAS + axis, i] = figures[FORCE_BIAS, i] * unit[4 + axis, i]
        for chamber in range(4):
            errors[CELLS + chamber, i] = figures[PRESSURE_BIAS, i] * unit[6 + chamber, i]
        errors[SCALED, i] = figures[SCALE, i] * unit[10, i]
        turns = -2.0 * math.pi * figures[FORCE_BANDWIDTH, i] * period
        errors[PASSED, i] = 1.0 - exact.exp(turns) if turns < 0.0 else 1.0
        errors[DELAY, i] = figures[FORCE_LATENCY, i] / period
        errors[FORCE_STEP, i] = _step(2.0 * constants[FORCE_RANGE], figures[ADC_BITS, i])
        errors[PRESSURE_STEP, i] = _step(constants[PRESSURE_RANGE], figures[ADC_BITS, i])
        errors[OPENING_STEP, i] = _step(2.0, figures[DAC_BITS, i])
        number = 2.0 * math.pi / figures[LENGTH, i]
        for wave in range(2 * WAVES):
            direction, row = math.pi * unit[11 + 2 * wave, i], WAVE + 3 * wave
            errors[row, i], errors[row + 1, i] = number * exact.cosine(direction), number * exact.sine(direction)
            errors[row + 2, i] = math.pi * unit[12 + 2 * wave, i]
        # Each sine has a mean square of a half.
        errors[HEIGHT, i] = figures[DISTORTION, i] * math.sqrt(2.0 / WAVES)
        for axis in range(2):
            errors[REGISTERED + axis, i] = field(errors, i, axis, constants[AT_X], constants[AT_Y])


def shift(errors: Array, constants: Array, place: Array) -> Array:
    """By how much scale and distortion move what the tracker shows of the true ``place``, both (2, N), m."""
    waves = errors[WAVE:HEIGHT].reshape(2, WAVES, 3, -1)
    total = np.sin(waves[:, :, 0] * place[0] + waves[:, :, 1] * place[1] + waves[:, :, 2]).sum(axis=1)
    scaled = errors[SCALED] * (place - constants[AT_X : AT_Y + 1, None])
    moved: Array = errors[HEIGHT] * total - errors[REGISTERED : REGISTERED + 2] + scaled
    return moved
