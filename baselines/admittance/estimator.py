"""The estimator of the admittance controller: one call a control period, in the order of its functions.

- read_sensors: the hand's force and the noise of the tracker, as measured and believed or as learned;
- answer_stiff_hand: how much heavier and more damped the motion is while a stiff hand makes the head swing;
- admittance.update_motion: the motion that the hand should find;
- predict: spools, pressures and the friction along that motion;
- correct: positions and speeds of the pistons, and what accelerates them without being known;
- rest: both from candidates for the friction, where these are weighed, while the target rests;
- adapt: the level of friction from what is left unexplained, and without a force sensor the hand's force.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from baselines.admittance.rows import Estimate, EstimatorParameters, Follower, Memory, OscillationDetector
from baselines.estimation import (
    admittance,
    chamber_observer,
    disturbance_observer,
    friction_level,
    friction_observer,
    inertia,
    observers,
    reference_friction,
    stages,
    stiff_hand,
    tracker_noise,
)
from baselines.estimation.friction_level import Friction
from baselines.estimation.hand import bristle_observer, force_bias, force_observer, friction_candidates, inertial_force
from baselines.estimation.hand.friction_candidates import Bank
from baselines.estimation.inertia import Inertia
from baselines.estimation.inertial import Moving
from birthsim_env.loop.rows import POSITION, Seen
from birthsim_env.loop.signals import Point
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage import geometry
from birthsim_env.physics.rig.parameters import Parameters

BELIEVED_LIMIT, BELIEVED_HAND = 120.0, 400.0
"""N; assumed: no more than this is believed to act unseen on a piston: 2 kg of mass and 25 N of friction are below the first.
Below the second are 7 kg on a small bore and, unseen without a force sensor, the strongest hand."""

HEAVIER, MORE_DAMPED = 10.0, 2.0
"""1: what multiplies mass and damping ratio of the motion that a stiff hand finds while it is answered; found by trial. The
damping in N s/m grows by the root of the first besides."""

ARRIVAL_TIME = 0.1
"""s; assumed: in which candidates for the friction take over once the target has come to rest."""


@helper
def read_sensors(seen: Seen, memory: Memory, estimate: Estimate, constants: EstimatorParameters) -> None:
    """The hand's force and the noise of a sample. What no force sensor measures of the hand, the observers find."""
    noise, hand, lanes = estimate.inputs.noise, estimate.hand, memory.fresh.shape[0]
    inverse_mass = estimate.inputs.inverse_mass
    for i in range(lanes):
        noise[i], inverse_mass[i] = constants.model.noise, 1.0 / memory.inertia.mass[i]
        for k in range(2):
            hand[k, i] = seen.user_force[k, i] if constants.force_sensor > 0.0 else memory.hand.force[k, i]
    if constants.learns_noise > 0.0:
        tracker_noise.observe(memory.tracker, seen, constants.model.noise, memory.fresh)
        for i in range(lanes):
            noise[i] = math.sqrt(memory.tracker.variance[i])
    if constants.most_bias > 0.0:
        steady, period = force_bias.STEADY, constants.model.period
        force_bias.tare(memory.bias, seen.time, seen.user_force, constants.most_bias, steady, period, hand)
    for i in range(lanes):
        for k in range(2):
            estimate.inputs.force[k, i] = hand[k, i] if constants.force_sensor + constants.weighed > 0.0 else 0.0


@helper
def answer_stiff_hand(seen: Seen, memory: Memory, estimate: Estimate, constants: EstimatorParameters) -> None:
    """What multiplies mass and damping of the motion that the hand should find."""
    if constants.feels_stiff_hand > 0.0:
        noise, period = estimate.inputs.noise, constants.model.period
        stiff_hand.observe(memory.stiff_hand, seen, estimate.hand, noise, period, memory.fresh)
    for i in range(memory.fresh.shape[0]):
        felt, factor = memory.stiff_hand.felt[i], seen.damping_factor[i]
        estimate.heavier[i] = 1.0 + (HEAVIER - 1.0) * felt
        estimate.damping_factor[i] = max(1.0, factor) * (1.0 + (MORE_DAMPED - 1.0) * felt)


@helper
def predict(seen: Seen, memory: Memory, estimate: Estimate, constants: EstimatorParameters) -> None:
    """Valves and chambers, and the friction that is there along the motion."""
    p, period = constants.model.rig, constants.model.period
    chamber_observer.observe(memory.chambers, seen.pressure, memory.joints, p, period, constants.trust, memory.fresh)
    pressures = memory.chambers.pressure
    reference_friction.update_bristle(estimate.motion, pressures, p, period, memory.bristle, estimate.drag)
    for i in range(memory.fresh.shape[0]):
        for k in range(2):
            level = constants.friction_fraction * memory.friction.level[k, i]
            estimate.inputs.believed[k, i] = -level * estimate.drag[k, i]


@helper
def correct(seen: Seen, memory: Memory, bank: Bank, estimate: Estimate, constants: EstimatorParameters) -> None:
    """The pistons, and what accelerates them unseen."""
    joints, pistons = memory.joints, memory.pistons
    inputs, assumed = estimate.inputs, constants.model
    lanes, place, p = memory.fresh.shape[0], int(constants.place), assumed.rig
    if constants.sampled > 0.0:
        pressures = memory.chambers.pressure
        observers.observe(pistons, seen, pressures, inputs, assumed)
        if constants.weighs_friction > 0.0:
            levels, fresh = memory.friction.level, memory.fresh
            friction_observer.observe(bank, seen, joints, pressures, levels, inputs, assumed, estimate.found, fresh)
        for k in range(2):
            for i in range(lanes):
                joints.position[k, i], joints.speed[k, i] = pistons.position[k, i], pistons.speed[k, i]
    else:
        point = Point(seen.rows[place : place + Point.size])
        disturbance_observer.observe(pistons, point, memory.chambers.pressure, inputs, assumed, joints, lanes)
    for i in range(lanes):
        _, _, _, _, _, kappa, sine, cosine = geometry.pose(
            joints.position[0, i],
            joints.position[1, i],
            p.k1,
            p.k2,
            p.d_squares,
            p.d_product,
            p.sin_gamma3,
            p.cos_gamma3,
        )
        mass = memory.inertia.mass[i]
        for k in range(2):
            found = (mass * kappa * kappa if k == 0 else mass) * pistons.disturbance[k, i]
            estimate.unexplained[k, i] = inputs.believed[k, i] + found
            estimate.unseen[k, i] = inputs.believed[k, i] + max(-constants.believed_limit, min(constants.believed_limit, found))
        if constants.learns_mass > 0.0:
            pose, pressures = (kappa, sine, cosine), memory.chambers.pressure
            inertia.learn(memory.inertia, i, pose, pistons, pressures, inputs, assumed, memory.fresh)


@helper
def rest(seen: Seen, memory: Memory, estimate: Estimate, constants: EstimatorParameters) -> None:
    """Pistons of a target that rests, as candidates for their friction have them; those of one that moves stay as they are."""
    joints, found, most = memory.joints, estimate.found, constants.believed_limit
    kept = exact.exp(-constants.model.period / ARRIVAL_TIME)
    for i in range(memory.fresh.shape[0]):
        going = admittance.goes(seen.asked.velocity[0, i], seen.asked.velocity[1, i])
        memory.travels[i] = max(going, kept * memory.travels[i])
        resting = 1.0 - memory.travels[i]
        for k in range(2):
            unseen = max(-most, min(most, found.unseen[k, i]))
            joints.position[k, i] += resting * (found.position[k, i] - joints.position[k, i])
            joints.speed[k, i] += resting * (found.speed[k, i] - joints.speed[k, i])
            estimate.unseen[k, i] += resting * (unseen - estimate.unseen[k, i])


@helper
def adapt(seen: Seen, memory: Memory, bank: Bank, estimate: Estimate, constants: EstimatorParameters) -> None:
    """The level of friction and, without a force sensor, the hand's force, for the next period."""
    fresh, assumed, joints, pressures = memory.fresh, constants.model, memory.joints, memory.chambers.pressure
    noise, hand, contact = estimate.inputs.noise, memory.hand, memory.contact
    if constants.friction_rate > 0.0:
        friction_level.learn(
            memory.friction, estimate.drag, joints, pressures, estimate.unexplained, constants.friction_rate, assumed, fresh
        )
    if constants.weighed > 0.0:
        place = int(constants.place)
        moving = Moving(seen.rows[place : place + Moving.size])
        inertial_force.observe(hand, memory.rest_detector, bank, seen, moving, joints, pressures, noise, assumed, fresh)
    elif constants.identified > 0.0:
        bristle_observer.observe(hand, contact, seen, joints, pressures, noise, assumed, fresh)
    elif constants.force_sensor == 0.0:
        force_observer.observe(hand, seen.time, joints, pressures, estimate.unexplained, assumed.rig, assumed.period, fresh)


@helper
def estimate(seen: Seen, memory: Memory, bank: Bank, estimate: Estimate, constants: EstimatorParameters) -> int:
    """Carries ``memory`` and ``bank`` on by one control period and writes ``estimate``, over the lanes of a block.

    Returns how many stiffness setpoints are not positive definite.
    """
    read_sensors(seen, memory, estimate, constants)
    answer_stiff_hand(seen, memory, estimate, constants)
    missed = admittance.update_motion(
        memory.offset,
        seen.asked,
        estimate.hand,
        constants.compliance,
        estimate.damping_factor,
        estimate.heavier,
        estimate.motion,
    )
    admittance.mark_moving(estimate.motion, estimate.inputs.moving)
    predict(seen, memory, estimate, constants)
    correct(seen, memory, bank, estimate, constants)
    if constants.weighs_friction > 0.0:
        rest(seen, memory, estimate, constants)
    adapt(seen, memory, bank, estimate, constants)
    for i in range(memory.fresh.shape[0]):
        memory.fresh[i] = 0.0
    return missed


@helper
def parts(whole: Array, constants: EstimatorParameters) -> tuple[Memory, Bank]:
    """What a block of rows holds: the memory, and the bank of candidates for the friction, of which there may be none."""
    rows = whole.shape[0] - int(constants.rows_of_bank)
    return Memory(whole[:rows]), Bank(whole[rows:])


def fresh_memory(rig: Parameters, sampled: bool, candidates: int = 0) -> Array:
    """``Memory`` of a lane that starts, and behind it its ``Bank`` with so many candidates for the friction."""
    whole, pistons = OscillationDetector.lane(fraction=1.0), observers.fresh_memory(rig, sampled)
    follower = Follower.lane(across=whole, along=whole, rest_across=whole, rest_along=whole)
    mass, friction = Inertia.lane(mass=rig.mechanics.mass), Friction.lane(level=1.0)
    memory = Memory.lane(fresh=1.0, friction=friction, inertia=mass, follower=follower, pistons=pistons)
    return np.concatenate([memory, friction_candidates.fresh_bank(candidates)])


def estimator_parameters(
    rig: Parameters, sampled: bool, noisy: bool, gains: Mapping[str, float], **others: float
) -> dict[str, Any]:
    """``EstimatorParameters`` in a rig by name: with a force sensor and nothing learned, where ``others`` do not say otherwise.

    ``gains`` has bandwidth and friction_fraction and, where cells are ``noisy``, pressure_bandwidth, 1/s.
    """
    width = gains["pressure_bandwidth"] if noisy else math.inf
    return {
        "model": observers.assumed_parameters(rig, gains["bandwidth"]),
        "compliance": stages.compliance(rig),
        "place": POSITION,
        "sampled": sampled,
        "force_sensor": True,
        "learns_noise": False,
        "rows_of_memory": len(fresh_memory(rig, sampled)),
        "rows_of_bank": len(friction_candidates.fresh_bank(0)),
        "trust": 1.0 - exact.number("exp", -width * rig.electronics.control_period),
        "friction_fraction": gains["friction_fraction"],
        "friction_rate": 0.0,
        "most_bias": 0.0,
        "weighed": False,
        "identified": False,
        "learns_mass": False,
        "feels_stiff_hand": False,
        "weighs_friction": False,
        "believed_limit": BELIEVED_LIMIT,
        **others,
    }
