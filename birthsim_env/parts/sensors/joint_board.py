"""A board with sensors at the cylinders: their errors, and how an episode draws them."""

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from birthsim_env.parts.drawn.seeding import vectorised
from birthsim_env.parts.sensors.honest import HonestBoard
from birthsim_env.parts.sensors.sensor_errors import SENSOR_PARAMETERS, Shared
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, number, part, row, rows
from birthsim_env.physics.electronics import Electronics
from birthsim_env.physics.linkage.joint_sensors import JointSensors

_DRAWN = {name: one for name, one in JointSensors.parameters.items() if one.range}
ENCODER_PARAMETERS = tuple(name for name in _DRAWN if name.startswith("encoder"))
GAUGE_PARAMETERS = tuple(name for name in _DRAWN if name.startswith("gauge"))
TRACKER_PARAMETERS = tuple(name for name in SENSOR_PARAMETERS if name.startswith(("position", "distortion")))
FORCE_PARAMETERS = ("force_noise", "force_bias", "force_gain_error", "force_crosstalk")
"""Parameters in which lanes may differ: of encoders, of rod gauges, of what either replaces."""

JointParameters: Any = type("JointParameters", (Rows,), {name: row(one.unit, one.about) for name, one in _DRAWN.items()})
"""Those of encoders and gauges as rows."""


class JointErrors(Rows):
    """What is wrong with the sensors at the cylinders of a lane."""

    parameters = part(JointParameters, "of the sensors")
    offset = rows("1 2", "m", "of an encoder")
    bias = rows("1 2", "N", "of a gauge")
    gain = rows("1 2", "1", "error of a gauge's gain")


class JointShared(Shared):
    """Constants that all lanes share."""

    encoder_rate = number("Hz", "of the encoders")
    encoder_stamped = number("s", "the latency of the encoders that their samples are stamped with")
    gauge_range = number("N", "full scale")
    counted = number("1", "1 where encoders take the tracker's place")


def drawn_without(*replaced: str, also: tuple[str, ...]) -> tuple[str, ...]:
    """Dotted names of what ``honest`` sensors draw but for what is ``replaced``, and ``also``."""
    return tuple(f"electronics.{name}" for name in (*SENSOR_PARAMETERS, *also) if name not in replaced)


class JointBoard(HonestBoard):
    """``HonestBoard`` with what sensors at the cylinders need."""

    counted: ClassVar[bool] = False
    """Whether encoders take the tracker's place."""

    def __init__(self, electronics: Electronics, num_envs: int) -> None:
        self._joint_errors: Array = np.zeros((JointErrors.size, num_envs))
        super().__init__(electronics, num_envs)
        # An encoder faster than the control board is read once a period.
        self._encoder_rate = min(electronics.encoder_rate, 1 / electronics.control_period)
        of_joints = self._encoder_rate, electronics.encoder_latency, electronics.gauge_range, float(self.counted)
        self._joint_shared: Array = np.concatenate([self._shared, of_joints])

    @vectorised
    def begin(self, lane: int, rng: np.random.Generator) -> None:
        super().begin(lane, rng)
        lanes: NDArray[Any] = np.atleast_1d(lane)
        unit = np.asanyarray(rng.uniform(-1.0, 1.0, 6)).reshape(6, -1)
        errors = JointErrors(np.empty_like(unit, shape=(JointErrors.size, len(lanes))))
        own = errors.parameters
        for name in _DRAWN:
            getattr(own, name)[:] = getattr(self._electronics, name)
        for name, (low, high) in self._ranges.items():
            if name in _DRAWN:
                getattr(own, name)[:] = rng.uniform(low, high)
        errors.offset[:] = own.encoder_offset * unit[:2]
        errors.bias[:], errors.gain[:] = own.gauge_bias * unit[2:4], own.gauge_gain_error * unit[4:]
        self._joint_errors[:, lanes] = errors.rows

    @property
    def parameters(self) -> dict[str, Array]:
        joint = JointErrors(self._joint_errors).parameters.rows
        return {**super().parameters, **dict(zip(_DRAWN, joint, strict=True))}

    @property
    def _tables(self) -> tuple[NDArray[Any], ...]:
        return (*super()._tables, self._joint_errors)
