"""The stiffness test: from rest ramp a force to its size, hold, and see how far the end effector has given way.

Every lane is one case with a pose, a force, a stiffness and a rig of its own.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from baselines.bench.resting import RestingRigs
from baselines.bench.statistics import penalize_lost
from baselines.controller import Controller
from birthsim_env.loop.signals import REFERENCES, Mask, Reference
from birthsim_env.parts.hands.user_forces import ForceProfile
from birthsim_env.physics.compiled.lanes import Array
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
    rigs = [probes.rigs] * probes.size if isinstance(probes.rigs, Parameters) else probes.rigs
    reference, end = probes.reference(), REST + RISE + HOLD
    loop = RestingRigs(rigs, reference, controller, sensors, seed, force_sensor)
    times = np.arange(round(end / loop.period)) * loop.period
    loop.close([RampedForces(probes.force).stage()])
    # The last second of rest, with its end, and that of the hold, without its beginning.
    begun, rested, held = np.searchsorted(times, [REST - WINDOW, REST, end - WINDOW], "right").tolist()
    loop.run(begun)
    paths = [loop.path(rested - begun)]
    loop.run(held - rested)
    paths.append(loop.path(len(times) - held))
    rest, pushed = (path.mean(axis=0) for path in paths)
    displacement = pushed - rest
    lost = ~np.isfinite(displacement).all(axis=0) | (loop.impacts.max(axis=0) > board_limit(rigs))
    expected = reference.compliant_target(probes.force) - probes.position
    hunting = np.max([np.ptp(path, axis=0) for path in paths], axis=0)
    return StiffnessResult(displacement, expected, hunting, lost, rest - probes.position)


def board_limit(rigs: Parameters | Sequence[Parameters]) -> float:
    """The impact speed, m/s, above which a collision counts as a loss."""
    return (rigs if isinstance(rigs, Parameters) else rigs[0]).mechanics.impact_speed


class RampedForces(ForceProfile):
    """From ``REST`` on forces (2, N), N, a lane each, rise over ``RISE`` s, and stay."""

    def __init__(self, force: Array) -> None:
        super().__init__()
        self._knots, self._counts = np.zeros((3, 3, force.shape[1])), np.full(force.shape[1], 3.0)
        self._knots[1:, 0], self._knots[2, 1:] = np.transpose([[REST, REST + RISE]]), force
