"""Control board and sensors as data: what the sensor models ``lab`` and ``honest`` take their figures from."""

from dataclasses import dataclass

from birthsim_env.physics.rig.quantities import Part, quantity

NO_LARGER = "an episode draws within +-"

SLOWEST = 40.0
"""Hz, of an acceleration sensor. In eight drawn circles with ``honest`` sensors ``admittance-adaptive`` is as good with 40 Hz
as with 300, to 0.2 mm; with 20 Hz its settled error is 1.9 instead of 0.7 mm, and with 10 Hz 9.6 mm."""


@dataclass(frozen=True)
class Electronics(Part):
    """Control board and the sensors of a laboratory.

    The first five figures, bandwidth and noise of the acceleration are those of the sensor models ``lab`` and ``honest``, all
    others those of ``honest`` alone: 0 switches an error off (of ``force_bandwidth``: the low-pass; of bits: the converter).
    ``acceleration_bandwidth`` is 0 where the head has no acceleration sensor. The tracker is registered to the rig
    at one point, where its distortion and scale do no harm and its noise is ``position_noise``. Ranges are drawn from with
    ``honest`` sensors.
    """

    control_period: float = quantity(0.001, "s", "assumed", least=0.00025, most=0.01)
    position_rate: float = quantity(240.0, "Hz", "trakSTAR, assumed", least=0.1, most=4000)
    position_noise: float = quantity(
        1e-4, "m", "assumed; standard deviation per axis", least=0, most=1, randomized=(5e-5, 3e-4)
    )
    position_latency: float = quantity(0.004, "s", "assumed", least=0, most=0.05, randomized=(0.002, 0.015))
    pressure_noise: float = quantity(
        500.0, "Pa", "assumed; standard deviation per chamber", least=0, most=1e6, randomized=(200, 1000)
    )

    force_noise: float = quantity(
        0.1,
        "N",
        "assumed; standard deviation per axis and period, six-axis strain gauges of 300 N",
        least=0,
        most=100,
        randomized=(0.03, 0.3),
        option=True,
    )
    force_bias: float = quantity(
        1.0, "N", f"assumed, drift since it was tared; {NO_LARGER}", least=0, most=1e3, randomized=(0, 2), option=True
    )
    force_gain_error: float = quantity(
        0.01, "-", f"assumed, uncertainty of calibration; {NO_LARGER}", least=0, most=0.9, randomized=(0, 0.05), option=True
    )
    force_crosstalk: float = quantity(
        0.01,
        "-",
        f"assumed, below 2 % in good six-axis sensors; of the other axis, {NO_LARGER}",
        least=0,
        most=0.9,
        randomized=(0, 0.03),
        option=True,
    )
    force_bandwidth: float = quantity(
        200.0, "Hz", "assumed; -3 dB of a first-order low-pass", least=0, most=1e5, randomized=(100, 500), option=True
    )
    force_latency: float = quantity(
        0.001, "s", "assumed; conversion and bus", least=0, most=0.05, randomized=(0, 0.004), option=True
    )
    force_range: float = quantity(300.0, "N", "assumed; full scale per axis, either way", above=0, most=1e6, option=True)

    position_noise_growth: float = quantity(
        4.0,
        "-",
        "of a magnetic dipole, whose gradient falls so; power of the distance from the transmitter",
        least=0,
        most=6,
        randomized=(2, 4),
        option=True,
    )
    position_distortion: float = quantity(
        1e-3,
        "m",
        "assumed; of metal nearby, RMS per axis of a smooth field that an episode draws",
        least=0,
        most=0.1,
        randomized=(0, 2e-3),
        option=True,
    )
    distortion_length: float = quantity(
        0.6, "m", "assumed; wavelength of that field", least=0.05, most=100, randomized=(0.4, 1.0), option=True
    )
    position_scale_error: float = quantity(
        0.005, "-", f"assumed; {NO_LARGER}", least=0, most=0.5, randomized=(0, 0.02), option=True
    )
    position_dropout: float = quantity(
        0.005,
        "-",
        "assumed; fraction of the tracker's samples that are lost",
        least=0,
        most=1,
        randomized=(0, 0.02),
        option=True,
    )
    transmitter_x: float = quantity(
        0.5, "m", "assumed; where the tracker's transmitter stands", least=-10, most=10, option=True
    )
    transmitter_y: float = quantity(-0.3, "m", "assumed", least=-10, most=10, option=True)
    registration_x: float = quantity(
        0.5, "m", "assumed; where the tracker is registered to the rig", least=-10, most=10, option=True
    )
    registration_y: float = quantity(0.0, "m", "assumed", least=-10, most=10, option=True)

    pressure_bias: float = quantity(
        2000.0,
        "Pa",
        f"assumed, 0.2 % of a cell of 10 bar; per chamber, {NO_LARGER}",
        least=0,
        most=1e6,
        randomized=(0, 5000),
        option=True,
    )
    pressure_range: float = quantity(1e6, "Pa", "assumed; full scale, absolute", above=0, most=1e8, option=True)

    adc_bits: float = quantity(
        14.0, "-", "assumed; of force and pressures, boards have 12 to 16", least=0, most=32, randomized=(12, 16), option=True
    )
    dac_bits: float = quantity(
        14.0, "-", "assumed; of the valves' voltages, boards have 12 to 16", least=0, most=32, randomized=(12, 16), option=True
    )
    missed_periods: float = quantity(
        0.001,
        "-",
        "assumed; fraction of control periods in which the board neither reads nor writes",
        least=0,
        most=0.9,
        randomized=(0, 0.01),
        option=True,
    )

    clock_jitter: float = quantity(
        0.0,
        "-",
        "0 is a steady clock; the valves' voltages are late by up to this fraction of a period, up to 0.5 assumed of "
        "boards without a real-time system",
        least=0,
        most=1,
        option=True,
        worth=(0, 0.5),
    )

    acceleration_bandwidth: float = quantity(
        0.0,
        "Hz",
        "0 is a head without an acceleration sensor; -3 dB of a first-order low-pass, 200 to 400 assumed of a "
        "micromechanical one",
        least=0,
        most=1e5,
        option=True,
    )
    acceleration_noise: float = quantity(
        0.02,
        "m/s2",
        "assumed; standard deviation per axis and period, 100 ug/sqrt(Hz) over 400 Hz",
        least=0,
        most=100,
        option=True,
    )
    acceleration_bias: float = quantity(
        0.1, "m/s2", f"assumed, of the sensor and of gravity that was taken off; {NO_LARGER}", least=0, most=100, option=True
    )
    acceleration_gain_error: float = quantity(0.01, "-", f"assumed, per axis; {NO_LARGER}", least=0, most=0.9, option=True)

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
