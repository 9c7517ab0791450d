"""The stiffness test: from rest ramp a force to its size, hold, and see how far the end effector has given way.

Every lane is one case with a pose, a force, a stiffness and a rig of its own. Design section 6.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from baselines.bench.statistics import penalize_lost
from baselines.controller import Controller
from birthsim_env.loop.signals import REFERENCES, Mask, Measurement, Reference
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.parts.sensors.sensors import SENSORS, put_out
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.physics.geometry import inverse_geometry
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters

REST, RISE, HOLD = 2.0, 1.0, 3.0
"""s, assumed: before the push, of the ramp, and at full force."""

WINDOW = 1.0
"""s at the end of rest and hold over which positions are averaged and hunting is measured."""

POSES = ((0.5, 0.0), (0.4, 0.05), (0.6, 0.05), (0.4, -0.08), (0.62, -0.1))
"""m; assumed: the middle and four corners of the workspace where every setpoint is feasible."""


@dataclass(frozen=True)
class StiffnessTest:
    """N cases: ``position`` (2, N) m, ``force`` (2, N) N, ``stiffness`` (3, N) N/m as Kclx, Kcly, Kclxy, pneumatic stiffness
    ``pneumatic`` (2,) or (2, N) N/m, and ``rigs``, the plant for all or one per lane."""

    position: Array
    force: Array
    stiffness: Array
    rigs: Parameters | Sequence[Parameters]
    pneumatic: tuple[float, float] | Array = (4400.0, 2200.0)

    @property
    def size(self) -> int:
        """N."""
        return int(self.position.shape[1])

    def reference(self) -> Reference:
        """What is asked for: a resting target."""
        rows = np.zeros((REFERENCES, self.size))
        rows[0:2], rows[8:10], rows[14] = self.position, self.stiffness[:2], self.stiffness[2]
        rows[10:12] = np.reshape(self.pneumatic, (2, -1))
        return Reference(rows)


@dataclass(frozen=True)
class StiffnessResult:
    """What the rigs did in the last second at rest and in the last second at full force.

    - ``displacement`` (2, N), m: mean of the latter less mean of the former;
    - ``expected`` (2, N), m: the displacement that the stiffness asked for gives;
    - ``hunting`` (2, N), m: largest peak to peak in these seconds;
    - ``lost`` (N,): lanes that left the range of numbers or ran into an end stop;
    - ``offset`` (2, N), m: distance of the mean at rest from the target.
    """

    displacement: Array
    expected: Array
    hunting: Array
    lost: Mask
    offset: Array

    def stiffness_error(self, force: Array) -> Array:
        """Rendered stiffness along the force over the one asked for, less 1, (N,)."""
        along = np.einsum("in,in->n", self.displacement, force)
        asked = np.einsum("in,in->n", self.expected, force)
        with np.errstate(divide="ignore"):
            return penalize_lost(asked / along - 1, self.lost, applies=True)


def run_stiffness_test(
    probes: StiffnessTest, controller: Controller, sensors: str = "ideal", seed: int = 0, force_sensor: bool = True
) -> StiffnessResult:
    """Push in every lane. ``force_sensor`` False shows the controller a force of zero."""
    rigs, lanes = probes.rigs, probes.size
    board = (rigs if isinstance(rigs, Parameters) else rigs[0]).electronics
    reference, plant = probes.reference(), Plant(rigs, lanes)
    piston = inverse_geometry(probes.position, rigs if isinstance(rigs, Parameters) else rigs[0])
    plant.state = balanced_state(plant.lane_parameters, piston, np.zeros((2, lanes)), reference.pneumatic_stiffness)
    model = SENSORS[sensors](board, lanes)
    for lane in range(lanes):
        model.begin(lane, stream(seed + lane, 0, "sensors"))
    controller.reset()
    period = board.control_period
    impacts, rest, held = np.zeros(lanes), Window(lanes), Window(lanes)
    for tick in range(round((REST + RISE + HOLD) / period)):
        now = tick * period
        clock, ticks = np.full(lanes, now), np.full(lanes, tick)
        force = probes.force * min(max((now - REST) / RISE, 0.0), 1.0)
        motion = plant.end_effector()
        if REST - WINDOW < now <= REST:
            rest.add(motion[:2])
        if now > REST + RISE + HOLD - WINDOW:
            held.add(motion[:2])
        seen: Measurement = model.measure(ticks, clock, motion, plant.pressures, force)
        if not force_sensor:
            seen = replace(seen, user_force=np.zeros_like(force))
        plant.advance_unchecked(put_out(model, ticks, controller.command(seen, reference)), force[None], period)
        np.maximum(impacts, plant.impacts.max(axis=0), out=impacts)
    displacement = held.mean() - rest.mean()
    lost = ~np.isfinite(displacement).all(axis=0) | (impacts > board_limit(rigs))
    expected, hunting = reference.compliant_target(probes.force) - probes.position, np.maximum(held.span(), rest.span())
    return StiffnessResult(displacement, expected, hunting, lost, rest.mean() - probes.position)


def board_limit(rigs: Parameters | Sequence[Parameters]) -> float:
    """The impact speed, m/s, above which a collision counts as a loss."""
    return (rigs if isinstance(rigs, Parameters) else rigs[0]).mechanics.impact_speed


class Window:
    """Mean and span of positions (2, N) over a stretch of time."""

    def __init__(self, lanes: int) -> None:
        self._sum, self._count = np.zeros((2, lanes)), 0
        self._low, self._high = np.full((2, lanes), np.inf), np.full((2, lanes), -np.inf)

    def add(self, position: Array) -> None:
        """Take one instant."""
        self._sum += position
        self._count += 1
        self._low, self._high = np.minimum(self._low, position), np.maximum(self._high, position)

    def mean(self) -> Array:
        """m, (2, N)."""
        return np.asarray(self._sum / self._count)

    def span(self) -> Array:
        """Peak to peak, m, (2, N)."""
        return np.asarray(self._high - self._low)
