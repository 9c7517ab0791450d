"""Sensors at the cylinders as data: encoders of the pistons and force gauges in the rods."""

from dataclasses import dataclass

from birthsim_env.physics.rig.declaration import Prior, Section, parameter

EITHER_WAY = "an episode draws up to this either way"


@dataclass(frozen=True)
class JointSensors(Section, plant=False, shared=True):
    """What sensor models with ``encoders`` or ``gauges`` in their names measure at each cylinder.

    Amplifier, converter and bus of a gauge are those of the force sensor: ``force_bandwidth``, ``adc_bits``, ``force_latency``.
    """

    encoder_resolution: float = parameter(
        "m",
        "distance between two counts of an encoder; 0 is a continuous one",
        default=5e-6,
        source="data sheets of magnetostrictive rod encoders with SSI (Temposonics R-Series), 1 to 100 um",
        least=0,
        most=0.01,
        range=(1e-6, 2e-5),
        option=True,
    )
    encoder_rate: float = parameter(
        "Hz",
        "samples per second of an encoder",
        default=1000.0,
        source="data sheets of the same, 0.5 to 4 kHz by their length",
        least=1,
        most=1e5,
        option=True,
    )
    encoder_latency: float = parameter(
        "s",
        "from the sample of an encoder to the board",
        default=5e-4,
        source="assumed, half a measuring cycle; 0 is a counter that the board latches",
        least=0,
        most=0.05,
        range=(0, 1e-3),
        identified=Prior(1.0, scale=0.001),
        option=True,
    )
    encoder_noise: float = parameter(
        "m",
        "standard deviation of an encoder's noise",
        default=2.5e-6,
        source="data sheets of the same, repeatability",
        least=0,
        most=0.01,
        range=(0, 5e-6),
        option=True,
    )
    encoder_offset: float = parameter(
        "m",
        f"error of an encoder's zero after homing; {EITHER_WAY}",
        default=1e-4,
        source="assumed",
        least=0,
        most=0.1,
        range=(0, 5e-4),
        option=True,
    )

    gauge_noise: float = parameter(
        "N",
        "standard deviation of a rod gauge's noise per period",
        default=0.1,
        source="assumed, strain gauges of 500 N",
        least=0,
        most=100,
        range=(0.03, 0.3),
        option=True,
    )
    gauge_bias: float = parameter(
        "N",
        f"drift of a rod gauge since it was tared; {EITHER_WAY}",
        default=0.5,
        source="assumed, 0.1 % of 500 N",
        least=0,
        most=1e3,
        range=(0, 2),
        option=True,
    )
    gauge_gain_error: float = parameter(
        "-",
        f"uncertainty of a rod gauge's calibration; {EITHER_WAY}",
        default=0.005,
        source="assumed",
        least=0,
        most=0.9,
        range=(0, 0.02),
        option=True,
    )
    gauge_range: float = parameter(
        "N",
        "full scale of a rod gauge, either way",
        default=500.0,
        source="assumed, above the rods' 295 N",
        above=0,
        most=1e6,
        option=True,
    )
