"""The sensor model ``lab``: a magnetic tracker and pressure cells with noise and latency, and an ideal force sensor."""

from dataclasses import replace
from typing import Any

from birthsim_env.parts.sensors.board import BoardSensors
from birthsim_env.physics.electronics import Electronics
from birthsim_env.registry import register

ACCELEROMETER = ("acceleration_bandwidth", "acceleration_noise")
"""Parameters besides those of tracker and pressure cells that ``lab`` has too."""


@register(sensors="lab", about="A tracker that samples, is late and noisy, and noisy pressure cells.", order=2)
class LabSensors(BoardSensors):
    """A tracker with a rate of its own, noise and latency; noisy pressure cells read at every control period, and so is an
    acceleration sensor where the rig has one.

    No velocity is measured: in its place stands the low-passed difference of samples. The user's force is that of an ideal
    force sensor.
    """

    def __init__(self, electronics: Electronics, num_envs: int) -> None:
        errors = [name for name, one in electronics.parameters.items() if one.option and one.least == 0]
        no_errors: dict[str, Any] = {name: 0.0 for name in errors if name not in ACCELEROMETER}
        super().__init__(replace(electronics, **no_errors), num_envs)
