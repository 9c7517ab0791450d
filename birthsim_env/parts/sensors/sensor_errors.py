"""What is wrong with the ``honest`` sensors of each lane in one episode: figures of the sensors and the errors drawn from them.

The tracker's distortion is a sum of ``WAVES`` plane waves per axis whose directions and phases an episode draws, less its
value where the tracker was registered: smooth, with the wavelength ``distortion_length`` and the given RMS over phases.
"""

import math
from typing import Any

import numpy as np

from birthsim_env.parts.sensors import acceleration
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Numbers, Rows, number, part, row, rows
from birthsim_env.physics.electronics import Electronics
from birthsim_env.physics.linkage.joint_sensors import JointSensors

_DRAWN = {name: one for name, one in Electronics.parameters.items() if one.range and name not in JointSensors.parameters}
SENSOR_PARAMETERS = tuple(_DRAWN)
"""Parameters of the sensors of ``honest`` in which lanes may differ, in the order of their fields."""

SensorParameters: Any = type("SensorParameters", (Rows,), {name: row(one.unit, one.about) for name, one in _DRAWN.items()})
"""``SENSOR_PARAMETERS`` as rows."""

WAVES = 3


class Wave(Rows):
    """A plane wave of the tracker's distortion."""

    number = rows("x y", "1/m", "wave numbers")
    phase = row("rad", "at the origin")


class Unit(Rows):
    """Numbers in [-1, 1) that an episode draws."""

    gain = rows("x y", "1", "of the force")
    crosstalk = rows("x y", "1", "of the force")
    bias = rows("x y", "1", "of the force")
    cells = rows("P1 N1 P2 N2", "1", "bias of each pressure cell")
    scale = row("1", "of the tracker")
    waves = rows(4 * WAVES, "1", "direction and phase of every wave of both axes")


class Errors(Rows):
    """What is wrong with the sensors of a lane: the figures, and what is worked out from them and from what was drawn."""

    parameters = part(SensorParameters, "of the sensors")
    gain = rows("x y", "1", "error of the force's gain")
    crosstalk = rows("x y", "1", "of the other axis of the force")
    bias = rows("x y", "N", "of the force")
    cells = rows("P1 N1 P2 N2", "Pa", "bias of each pressure cell")
    scaled = row("1", "error of the tracker's scale")
    passed = row("1", "fraction of a force's change that passes the low-pass in a control period")
    delay = row("1", "control periods by which the force is late")
    force_step = row("N", "least step of the converter; 0 where there is none")
    pressure_step = row("Pa", "likewise")
    opening_step = row("1", "likewise, of openings")
    waves = rows(2 * WAVES * Wave.size, "SI", "each wave of the x axis, then of the y axis")
    height = row("m", "amplitude of a wave")
    registered = rows("x y", "m", "the field where the tracker was registered")
    acceleration_bias = rows("x y", "m/s2", "of an acceleration sensor; ``work_out`` leaves it")
    acceleration_gain = rows("x y", "1", "error of its gain; ``work_out`` leaves it")


class Shared(Numbers):
    """Constants that all lanes share."""

    period = number("s", "control period")
    rate = number("Hz", "of the tracker")
    registration = rows("x y", "m", "where the tracker is registered")
    transmitter = rows("x y", "m", "where its transmitter stands")
    force_range = number("N", "full scale")
    pressure_range = number("Pa", "full scale")
    stamped = number("s", "the latency of the tracker that its samples are stamped with")
    share = number("1", "what passes the low-pass of an acceleration sensor in a period; 0: there is none")
    acceleration_noise = number("m/s2", "of that sensor")


def shared(electronics: Electronics, rate: float) -> Array:
    """``Shared``; ``rate`` is the tracker's, Hz."""
    e = electronics
    return Shared.numbers(
        period=e.control_period,
        rate=rate,
        registration=(e.registration_x, e.registration_y),
        transmitter=(e.transmitter_x, e.transmitter_y),
        force_range=e.force_range,
        pressure_range=e.pressure_range,
        stamped=e.position_latency,
        share=acceleration.passed(e.acceleration_bandwidth, e.control_period),
        acceleration_noise=e.acceleration_noise,
    )


@helper
def _step(span: float, bits: float) -> float:
    """Least step of a converter with a whole number of bits over a span; 0 without one."""
    return span / exact.exp2(math.floor(bits + 0.5)) if bits >= 0.5 else 0.0


@helper
def field(errors: Errors, i: int, axis: int, x: float, y: float) -> float:
    """The distortion of one axis of lane ``i`` at a place, m, before that at the registration is taken off."""
    total = 0.0
    for k in range(WAVES):
        first = (axis * WAVES + k) * Wave.size
        wave = Wave(errors.waves[first : first + Wave.size])
        total += exact.sine(wave.number[0, i] * x + wave.number[1, i] * y + wave.phase[i])
    distortion: float = errors.height[i] * total
    return distortion


@kernel
def work_out(parameters: Any, unit: Unit, shared: Shared, errors: Errors) -> None:
    """Fill the ``errors`` of L lanes from ``parameters`` and what an episode has drawn, ``unit`` in [-1, 1)."""
    for i in range(parameters.rows.shape[1]):
        for k in range(parameters.rows.shape[0]):
            errors.parameters.rows[k, i] = parameters.rows[k, i]
        for axis in range(2):
            errors.gain[axis, i] = parameters.force_gain_error[i] * unit.gain[axis, i]
            errors.crosstalk[axis, i] = parameters.force_crosstalk[i] * unit.crosstalk[axis, i]
            errors.bias[axis, i] = parameters.force_bias[i] * unit.bias[axis, i]
        for chamber in range(4):
            errors.cells[chamber, i] = parameters.pressure_bias[i] * unit.cells[chamber, i]
        errors.scaled[i] = parameters.position_scale_error[i] * unit.scale[i]
        turns = -2.0 * math.pi * parameters.force_bandwidth[i] * shared.period
        errors.passed[i] = 1.0 - exact.exp(turns) if turns < 0.0 else 1.0
        errors.delay[i] = parameters.force_latency[i] / shared.period
        errors.force_step[i] = _step(2.0 * shared.force_range, parameters.adc_bits[i])
        errors.pressure_step[i] = _step(shared.pressure_range, parameters.adc_bits[i])
        errors.opening_step[i] = _step(2.0, parameters.dac_bits[i])
        number = 2.0 * math.pi / parameters.distortion_length[i]
        for k in range(2 * WAVES):
            direction, wave = math.pi * unit.waves[2 * k, i], Wave(errors.waves[k * Wave.size : (k + 1) * Wave.size])
            wave.number[0, i], wave.number[1, i] = number * exact.cosine(direction), number * exact.sine(direction)
            wave.phase[i] = math.pi * unit.waves[2 * k + 1, i]
        # Each sine has a mean square of a half.
        errors.height[i] = parameters.position_distortion[i] * math.sqrt(2.0 / WAVES)
        for axis in range(2):
            errors.registered[axis, i] = field(errors, i, axis, shared.registration[0], shared.registration[1])


def shift(errors: Errors, shared: Shared, place: Array) -> Array:
    """By how much scale and distortion move what the tracker shows of the true ``place``, both (2, N), m."""
    waves = errors.waves.reshape(2, WAVES, Wave.size, -1)
    total = np.sin(waves[:, :, 0] * place[0] + waves[:, :, 1] * place[1] + waves[:, :, 2]).sum(axis=1)
    scaled = errors.scaled * (place - shared.registration[:, None])
    return np.asarray(errors.height * total - errors.registered + scaled)
