"""Control board and sensors as data: what the sensor models compute with; ``joint_sensors`` has those at the cylinders."""

from dataclasses import dataclass

from birthsim_env.physics.linkage.joint_sensors import EITHER_WAY, JointSensors
from birthsim_env.physics.rig.declaration import Prior, parameter

SLOWEST = 40.0
"""Hz, of an acceleration sensor. In eight drawn circles with ``honest`` sensors ``admittance-adaptive`` is as good with 40 Hz
as with 300, to 0.2 mm; with 20 Hz its settled error is 1.9 instead of 0.7 mm, and with 10 Hz 9.6 mm."""


@dataclass(frozen=True)
class Electronics(JointSensors, plant=False, shared=True):
    """Control board and the sensors of a laboratory.

    The first five parameters, bandwidth and noise of the acceleration are those of the sensor models ``lab`` and ``honest``,
    all others those of ``honest`` alone: 0 switches an error off (of ``force_bandwidth``: the low-pass; of bits: the
    converter). The tracker is registered to the rig at one point, where its distortion and scale do no harm and its noise is
    ``position_noise``. Encoders and gauges are those of sensor models that are named after them, which have the errors of
    ``honest`` otherwise. Ranges are drawn from with all of these.
    """

    control_period: float = parameter("s", "control period", default=0.001, source="assumed", least=0.00025, most=0.01)
    position_rate: float = parameter(
        "Hz", "samples per second of the tracker", default=240.0, source="trakSTAR, assumed", least=0.1, most=4000
    )
    position_noise: float = parameter(
        "m",
        "standard deviation of the tracker's noise per axis",
        default=1e-4,
        source="assumed",
        least=0,
        most=1,
        range=(5e-5, 3e-4),
    )
    position_latency: float = parameter(
        "s",
        "latency of the tracker",
        default=0.004,
        source="assumed",
        least=0,
        most=0.05,
        range=(0.002, 0.015),
        identified=Prior(1.0, scale=0.005),
    )
    pressure_noise: float = parameter(
        "Pa",
        "standard deviation of a pressure cell's noise",
        default=500.0,
        source="assumed",
        least=0,
        most=1e6,
        range=(200, 1000),
    )

    force_noise: float = parameter(
        "N",
        "standard deviation of the force sensor's noise per axis and period",
        default=0.1,
        source="assumed, six-axis strain gauges of 300 N",
        least=0,
        most=100,
        range=(0.03, 0.3),
        option=True,
    )
    force_bias: float = parameter(
        "N",
        f"drift of the force sensor since it was tared; {EITHER_WAY}",
        default=1.0,
        source="assumed",
        least=0,
        most=1e3,
        range=(0, 2),
        option=True,
    )
    force_gain_error: float = parameter(
        "-",
        f"uncertainty of the force sensor's calibration; {EITHER_WAY}",
        default=0.01,
        source="assumed",
        least=0,
        most=0.9,
        range=(0, 0.05),
        option=True,
    )
    force_crosstalk: float = parameter(
        "-",
        f"share of the other axis in a force; {EITHER_WAY}",
        default=0.01,
        source="assumed, below 2 % in good six-axis sensors",
        least=0,
        most=0.9,
        range=(0, 0.03),
        option=True,
    )
    force_bandwidth: float = parameter(
        "Hz",
        "-3 dB of the force sensor's first-order low-pass",
        default=200.0,
        source="assumed",
        least=0,
        most=1e5,
        range=(100, 500),
        option=True,
    )
    force_latency: float = parameter(
        "s",
        "conversion of a force, and bus",
        default=0.001,
        source="assumed",
        least=0,
        most=0.05,
        range=(0, 0.004),
        option=True,
    )
    force_range: float = parameter(
        "N",
        "full scale of the force sensor per axis, either way",
        default=300.0,
        source="assumed",
        above=0,
        most=1e6,
        option=True,
    )

    position_noise_growth: float = parameter(
        "-",
        "power of the distance from the transmitter with which the tracker's noise grows",
        default=4.0,
        source="of a magnetic dipole, whose gradient falls so",
        least=0,
        most=6,
        range=(2, 4),
        option=True,
    )
    position_distortion: float = parameter(
        "m",
        "of metal nearby, RMS per axis of a smooth field that an episode draws",
        default=1e-3,
        source="assumed",
        least=0,
        most=0.1,
        range=(0, 2e-3),
        option=True,
    )
    distortion_length: float = parameter(
        "m", "wavelength of that field", default=0.6, source="assumed", least=0.05, most=100, range=(0.4, 1.0), option=True
    )
    position_scale_error: float = parameter(
        "-",
        f"error of the tracker's scale; {EITHER_WAY}",
        default=0.005,
        source="assumed",
        least=0,
        most=0.5,
        range=(0, 0.02),
        option=True,
    )
    position_dropout: float = parameter(
        "-",
        "fraction of the tracker's samples that are lost",
        default=0.005,
        source="assumed",
        least=0,
        most=1,
        range=(0, 0.02),
        option=True,
    )
    transmitter_x: float = parameter(
        "m", "where the tracker's transmitter stands", default=0.5, source="assumed", least=-10, most=10, option=True
    )
    transmitter_y: float = parameter(
        "m", "where the tracker's transmitter stands", default=-0.3, source="assumed", least=-10, most=10, option=True
    )
    registration_x: float = parameter(
        "m", "where the tracker is registered to the rig", default=0.5, source="assumed", least=-10, most=10, option=True
    )
    registration_y: float = parameter(
        "m", "where the tracker is registered to the rig", default=0.0, source="assumed", least=-10, most=10, option=True
    )

    pressure_bias: float = parameter(
        "Pa",
        f"bias of a pressure cell; {EITHER_WAY}",
        default=2000.0,
        source="assumed, 0.2 % of a cell of 10 bar",
        least=0,
        most=1e6,
        range=(0, 5000),
        option=True,
    )
    pressure_range: float = parameter(
        "Pa", "full scale of a pressure cell, absolute", default=1e6, source="assumed", above=0, most=1e8, option=True
    )

    adc_bits: float = parameter(
        "-",
        "bits of the converter of force and pressures",
        default=14.0,
        source="assumed, boards have 12 to 16",
        least=0,
        most=32,
        range=(12, 16),
        option=True,
    )
    dac_bits: float = parameter(
        "-",
        "bits of the converter of the valves' voltages",
        default=14.0,
        source="assumed, boards have 12 to 16",
        least=0,
        most=32,
        range=(12, 16),
        option=True,
    )
    missed_periods: float = parameter(
        "-",
        "fraction of control periods in which the board neither reads nor writes",
        default=0.001,
        source="assumed",
        least=0,
        most=0.9,
        range=(0, 0.01),
        option=True,
    )

    clock_jitter: float = parameter(
        "-",
        "the valves' voltages are late by up to this fraction of a period; 0 is a steady clock",
        default=0.0,
        source="up to 0.5 assumed of boards without a real-time system",
        least=0,
        most=1,
        option=True,
        range=(0, 0.5),
        on_request=True,
    )

    acceleration_bandwidth: float = parameter(
        "Hz",
        "-3 dB of the acceleration sensor's first-order low-pass; 0 is a head without one",
        default=0.0,
        source="200 to 400 assumed of a micromechanical one",
        least=0,
        most=1e5,
        option=True,
    )
    acceleration_noise: float = parameter(
        "m/s2",
        "standard deviation of the acceleration sensor's noise per axis and period",
        default=0.02,
        source="assumed, 100 ug/sqrt(Hz) over 400 Hz",
        least=0,
        most=100,
        option=True,
    )
    acceleration_bias: float = parameter(
        "m/s2",
        f"bias of the acceleration sensor, and of gravity that was taken off; {EITHER_WAY}",
        default=0.1,
        source="assumed",
        least=0,
        most=100,
        option=True,
    )
    acceleration_gain_error: float = parameter(
        "-",
        f"error of the acceleration sensor's gain per axis; {EITHER_WAY}",
        default=0.01,
        source="assumed",
        least=0,
        most=0.9,
        option=True,
    )

    def _check_together(self) -> None:
        if 0.0 < self.acceleration_bandwidth < SLOWEST:
            raise ValueError(
                f"Electronics.acceleration_bandwidth = {self.acceleration_bandwidth!r} is impossible; allowed: 0, which is no "
                f"sensor, or at least {SLOWEST:g} Hz"
            )
        if (self.transmitter_x, self.transmitter_y) == (self.registration_x, self.registration_y):
            raise ValueError(
                f"Electronics.transmitter_x = {self.transmitter_x!r}, transmitter_y = {self.transmitter_y!r} is impossible; "
                f"allowed: another place than that of the registration, ({self.registration_x!r}, {self.registration_y!r}) m"
            )
