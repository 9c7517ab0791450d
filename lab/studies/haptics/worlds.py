"""The rigs, targets and laws that the measurements share."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from baselines.bench.probes import board_limit
from baselines.bench.resting import RestingRigs
from baselines.controller import Controller
from baselines.named import LIMITED, make_controller
from birthsim_env.loop.signals import REFERENCES, Mask, Reference
from birthsim_env.parts.drawn.randomization import documented_ranges, draw_parameters
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from lab.studies.stability.maps import PNEUMATIC
from lab.studies.stability.rig_port import RigPort, no_hand, takes_damping_factor

POSES = ((0.5, 0.0), (0.4, 0.05), (0.62, -0.1))
"""m: the middle of the workspace and two corners, of those of ``baselines.bench.probes``."""

DIRECTIONS = ((1.0, 0.0), (0.0, 1.0))
"""A hand pushes along x or along y."""


@dataclass(frozen=True)
class Condition:
    """A law as JSON names it: ``controller`` and the ``rig`` as it believes it; sensors and their first seed; the number of
    rigs drawn, 0 for the one that is believed; ``force_sensor`` False hides the hand's force."""

    controller: str
    rig: Parameters
    sensors: str
    seed: int
    rigs: int
    force_sensor: bool

    def law(self) -> Controller:
        """A new one."""
        return make_controller(self.controller, self.rig)

    def drawn(self) -> list[Parameters]:
        """The rigs: world k has the seed ``seed + k``."""
        ranges = documented_ranges(self.rig)
        drawn = [draw_parameters(self.rig, ranges, stream(self.seed + k, 0, "parameters")) for k in range(self.rigs)]
        return drawn or [self.rig]

    def port(self, law: Controller, rigs: Sequence[Parameters], reference: Reference) -> RigPort:
        """Lanes with these rigs under this condition."""
        return RigPort(rigs, reference, law, self.sensors, self.seed, force_sensor=self.force_sensor)

    def refusal(self, stiffness: float, damping_factor: float | None = None) -> str | None:
        """Why the law refuses a stiffness setpoint, N/m, and a damping factor, in words; None where it takes them."""
        factor = None if damping_factor is None else np.array([damping_factor])
        try:
            port = RigPort(
                [self.rig], resting([POSES[0]], [stiffness]), self.law(), self.sensors, self.seed, damping_factor=factor
            )
            port.advance(no_hand)
        except ValueError as error:
            return str(error)
        return None


def condition_of(
    controller: str, source: str, rig: dict[str, Any], sensors: str, seed: int, rigs: int, force_sensor: bool
) -> Condition:
    """From the settings of a piece; ``source`` only tells controllers of different files apart."""
    return Condition(controller, Parameters.from_dict(rig), sensors, seed, rigs, force_sensor)


def resting(poses: Sequence[Sequence[float]], stiffness: Sequence[float]) -> Reference:
    """Resting targets at poses (m) with the same stiffness along x and y (N/m), a lane each."""
    rows = np.zeros((REFERENCES, len(poses)))
    rows[:2], rows[8:10], rows[10:12] = np.transpose(poses), np.asarray(stiffness), np.transpose([PNEUMATIC])
    return Reference(rows)


def lost_lanes(port: RigPort, rigs: Sequence[Parameters]) -> Mask:
    """Lanes (N,) that left the range of numbers or ran into an end stop."""
    return np.asarray(~np.isfinite(port.motion()).all(axis=0) | (port.impacts > board_limit(rigs)))


def varies_damping(law: Controller) -> bool:
    """Whether the law's damping can be asked for: ``RigPort`` can hand it a factor."""
    return takes_damping_factor(law)


def uses_force(condition: Condition) -> bool:
    """Whether the law does anything else when its force sensor says 1 N, where two lanes differ in nothing more.

    The limits of a ``PortLimiter`` always read the sensor.
    """
    if not condition.force_sensor or condition.controller.startswith(LIMITED):
        return condition.force_sensor
    loop = RestingRigs([condition.rig] * 2, resting([POSES[0]] * 2, [2000.0] * 2), condition.law())
    loop.pushed[0, 1] = 1.0
    answers: list[Array] = []
    loop.close([], [lambda _: answers.append(loop.openings)], [loop.moves])
    loop.run(20)
    return any((answer[:, 0] != answer[:, 1]).any() for answer in answers)
