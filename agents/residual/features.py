"""What the admittance controller would know, for a policy that has no memory of its own.

Its observers run beside whatever drives the valves: they see the same measurements, and the openings as they were put out.
"""

import numpy as np

from agents.residual.pistons import ObservedPistons
from baselines.admittance import estimator
from baselines.admittance.controller import AdmittanceController
from baselines.admittance.rows import Estimate, EstimatorParameters
from baselines.staged import ControllerStage
from birthsim_env.loop.rows import Seen
from birthsim_env.loop.signals import Reference, compliance
from birthsim_env.loop.stage import block, scratch
from birthsim_env.observation import Entry
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Rig
from birthsim_env.physics.compiled.records import Rows, rows
from birthsim_env.physics.linkage import geometry
from birthsim_env.physics.rig.parameters import Parameters


class EstimatorFeatures(Rows):
    """What is shown. The motion is the one that the hand should find, with the controller's mass and damping."""

    error = rows("x y", "m", "end effector, estimated, from the motion, {}")
    error_rate = rows("x y", "m/s", "rate of that error, {}")
    lag = rows("x y", "m", "motion from the compliant target, {}")
    velocity = rows("x y", "m/s", "velocity of the motion, from the target's, {}")
    acceleration = rows("x y", "m/s2", "acceleration of the motion, from the target's, {}")
    unseen = rows("1 2", "N", "force unseen on piston {}: friction believed, and what is observed besides")
    friction = rows("1 2", "N", "friction along the motion of piston {}, as believed")


SCALES = np.repeat([1e-3, 0.02, 5e-3, 0.1, 2.0, 20.0, 20.0], 2)
"""What maps to 1."""

VECTORS = EstimatorFeatures.unseen.first
"""Rows of vectors; each piston has one of those that follow."""


def entries_of(rig: Parameters) -> tuple[str, ...]:
    """What is shown of a rig: on a rail one entry of each pair, along it or of its cylinder."""
    every = [(k, name, unit, about) for k, (name, unit, about, _) in enumerate(EstimatorFeatures.entries())]
    if rig.linkage.is_rail:
        every = [(k, "along the rail" if k < VECTORS else name, unit, about) for k, name, unit, about in every[1::2]]
    return tuple(str(Entry(about.format(name), unit, SCALES[k])) for k, name, unit, about in every)


@helper
def told_of(seen: Seen, k: int, first: int, p: Rig, i: int) -> float:
    """Entry ``k`` of ``entries_of`` a rig whose ``first`` cylinder is 0, or 1 on a rail, in lane i."""
    pair = ObservedPistons.size + (1 + first) * k
    if first == 0:
        return float(seen.intermediate[pair, i])
    if 2 * k >= VECTORS:
        return float(seen.intermediate[pair + 1, i])
    # The direction of the rail, whose inclination is gamma3 less a right angle.
    return float(p.sin_gamma3 * seen.intermediate[pair, i] - p.cos_gamma3 * seen.intermediate[pair + 1, i])


class Constants(EstimatorParameters):
    """Constants of the stage."""

    scales = rows(EstimatorFeatures.size, "SI", "what maps to 1")


@kernel
def _estimate(world: int, seen: Seen, memory: int, constants: Constants, tables: int, lane: int, n: int) -> int:
    signals, estimate, p = Seen(seen.rows[:, :n]), Estimate(scratch(Estimate.size)[:, :n]), constants.model.rig
    own, bank = estimator.parts(block(memory, int(constants.rows_of_memory))[:, :n], constants)
    for i in range(n):
        for valve in range(4):
            own.chambers.opening[valve, i] = signals.opening[valve, i]
        for k in range(Reference.size):
            signals.asked.rows[k, i] = signals.reference.rows[k, i]
        signals.damping_factor[i] = 0.0
    missed = estimator.estimate(signals, own, bank, estimate, constants)
    found, told = (
        ObservedPistons(signals.intermediate[: ObservedPistons.size]),
        EstimatorFeatures(signals.intermediate[ObservedPistons.size : ObservedPistons.size + EstimatorFeatures.size]),
    )
    motion, target = estimate.motion, signals.reference
    for i in range(n):
        y1, y2 = own.joints.position[0, i], own.joints.position[1, i]
        v1, v2 = own.joints.speed[0, i], own.joints.speed[1, i]
        _, r2, _, _, _, kappa, sine, cosine = geometry.pose(
            y1, y2, p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3
        )
        x, y = r2 * sine, -r2 * cosine
        vx, vy = v2 * sine - kappa * v1 * cosine, -v2 * cosine - kappa * v1 * sine
        hand, stiffness = estimate.inputs.force, target.stiffness
        offset = compliance(hand[0, i], hand[1, i], stiffness[0, i], stiffness[1, i], target.stiffness_coupling[i])
        told.error[0, i], told.error[1, i] = x - motion.position[0, i], y - motion.position[1, i]
        told.error_rate[0, i], told.error_rate[1, i] = vx - motion.velocity[0, i], vy - motion.velocity[1, i]
        for axis in range(2):
            told.lag[axis, i] = motion.position[axis, i] - target.position[axis, i] - offset[axis]
            told.velocity[axis, i] = motion.velocity[axis, i] - target.velocity[axis, i]
            told.acceleration[axis, i] = motion.acceleration[axis, i] - target.acceleration[axis, i]
        mass = own.inertia.mass[i]
        for k in range(2):
            found.joints.position[k, i], found.joints.speed[k, i] = own.joints.position[k, i], own.joints.speed[k, i]
            found.disturbance[k, i] = estimate.unexplained[k, i] / (mass * kappa * kappa if k == 0 else mass)
            told.unseen[k, i], told.friction[k, i] = estimate.unseen[k, i], estimate.drag[k, i]
        for k in range(EstimatorFeatures.size):
            told.rows[k, i] /= constants.scales[k]
    return missed


def informed(rig: Parameters, sampled: bool, force_sensor: bool) -> list[ControllerStage]:
    """The stages of the estimator, in place of ``pistons.observed``.

    ``EstimatorFeatures``, over its ``SCALES``, follows ``ObservedPistons``.
    """
    *before, law = AdmittanceController(rig, force_sensor).controller_stages(sampled)
    return [*before, ControllerStage(_estimate, np.concatenate([law.constants[: EstimatorParameters.size], SCALES]), law.fresh)]
