"""What the admittance law knows at one instant, in the order in which it comes to know it.

- sense: the hand's force and the noise of the tracker, as measured and believed or as learned;
- give way: the motion that the hand should find;
- predict: spools, pressures and the friction along that motion;
- correct: positions and speeds of the pistons, and what accelerates them without being known;
- learn: the level of friction from what is left unexplained, and without a force sensor the hand's force.
"""

import math
from collections.abc import Mapping
from typing import Any

from baselines.admittance.rows import Beliefs, Follower, Known, Memory, Watch
from baselines.estimation import (
    admittance,
    chamber_observer,
    disturbance_observer,
    friction_level,
    inertia,
    observers,
    reference_friction,
    stages,
    tracker_noise,
)
from baselines.estimation.friction_level import Friction
from baselines.estimation.hand import bristle_observer, force_bias, force_observer, inertial_force
from baselines.estimation.inertia import Inertia
from baselines.estimation.inertial import Moving
from birthsim_env.loop.rows import POSITION, Seen
from birthsim_env.loop.signals import Point
from birthsim_env.physics import geometry
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters

BELIEVED_LIMIT, BELIEVED_HAND = 120.0, 400.0
"""N; assumed: no more than this is believed to act unseen on a piston: 2 kg of mass and 25 N of friction are below the first.
Below the second are 7 kg on a small bore and, unseen without a force sensor, the strongest hand."""


@helper
def sense(seen: Seen, memory: Memory, known: Known, about: Beliefs) -> None:
    """The hand's force and the noise of a sample. What no force sensor measures of the hand, the observers find."""
    noise, hand, lanes = known.given.noise, known.hand, memory.fresh.shape[0]
    inverse_mass = known.given.inverse_mass
    for i in range(lanes):
        noise[i], inverse_mass[i] = about.belief.noise, 1.0 / memory.inertia.mass[i]
        for k in range(2):
            hand[k, i] = seen.user_force[k, i] if about.force_sensor > 0.0 else memory.hand.force[k, i]
    if about.learns_noise > 0.0:
        tracker_noise.observe(memory.tracker, seen, about.belief.noise, memory.fresh)
        for i in range(lanes):
            noise[i] = math.sqrt(memory.tracker.variance[i])
    if about.most_bias > 0.0:
        steady, period = force_bias.STEADY, about.belief.period
        force_bias.tare(memory.bias, seen.time, seen.user_force, about.most_bias, steady, period, hand)
    for i in range(lanes):
        for k in range(2):
            known.given.force[k, i] = hand[k, i] if about.force_sensor + about.weighed > 0.0 else 0.0


@helper
def predict(seen: Seen, memory: Memory, known: Known, about: Beliefs) -> None:
    """Valves and chambers, and the friction that is there along the motion."""
    p, period = about.belief.rig, about.belief.period
    chamber_observer.observe(memory.chambers, seen.pressure, memory.joints, p, period, about.trust, memory.fresh)
    reference_friction.rub(known.motion, p, period, memory.bristle, known.drag)
    for i in range(memory.fresh.shape[0]):
        for k in range(2):
            level = about.friction_fraction * memory.friction.level[k, i]
            known.given.believed[k, i] = -level * known.drag[k, i]


@helper
def correct(seen: Seen, memory: Memory, known: Known, about: Beliefs) -> None:
    """The pistons, and what accelerates them unseen."""
    joints, pistons = memory.joints, memory.pistons
    given, belief = known.given, about.belief
    lanes, place, p = memory.fresh.shape[0], int(about.place), belief.rig
    if about.sampled > 0.0:
        observers.observe(pistons, seen, memory.chambers.pressure, given, belief)
        for k in range(2):
            for i in range(lanes):
                joints.position[k, i], joints.speed[k, i] = pistons.position[k, i], pistons.speed[k, i]
    else:
        point = Point(seen.rows[place : place + Point.size])
        disturbance_observer.observe(pistons, point, memory.chambers.pressure, given, belief, joints, lanes)
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
            known.unexplained[k, i] = given.believed[k, i] + found
            known.unseen[k, i] = given.believed[k, i] + max(-about.believed_limit, min(about.believed_limit, found))
        if about.learns_mass > 0.0:
            pose, pressures = (kappa, sine, cosine), memory.chambers.pressure
            inertia.learn(memory.inertia, i, pose, pistons, pressures, given, belief, memory.fresh)


@helper
def learn(seen: Seen, memory: Memory, known: Known, about: Beliefs) -> None:
    """The level of friction and, without a force sensor, the hand's force, for the next period."""
    fresh, belief, joints = memory.fresh, about.belief, memory.joints
    if about.friction_rate > 0.0:
        friction_level.learn(memory.friction, known.drag, joints, known.unexplained, about.friction_rate, belief, fresh)
    pressures, noise, hand, felt = memory.chambers.pressure, known.given.noise, memory.hand, memory.felt
    if about.weighed > 0.0:
        place = int(about.place)
        moving = Moving(seen.rows[place : place + Moving.size])
        inertial_force.observe(hand, felt, memory.hold, seen, moving, joints, pressures, noise, belief, fresh)
    elif about.identified > 0.0:
        bristle_observer.observe(hand, felt, seen, joints, pressures, noise, belief, fresh)
    elif about.force_sensor == 0.0:
        force_observer.observe(hand, seen.time, joints, known.unexplained, belief.rig, belief.period, fresh)


@helper
def know(seen: Seen, memory: Memory, known: Known, about: Beliefs) -> int:
    """Carries ``memory`` on by one control period and writes ``known``, over the lanes of a block.

    Returns how many stiffness setpoints are not positive definite.
    """
    sense(seen, memory, known, about)
    missed = admittance.give_way(memory.offset, seen.asked, known.hand, about.compliance, seen.damping_factor, known.motion)
    admittance.mark_moving(known.motion, known.given.moving)
    predict(seen, memory, known, about)
    correct(seen, memory, known, about)
    learn(seen, memory, known, about)
    for i in range(memory.fresh.shape[0]):
        memory.fresh[i] = 0.0
    return missed


def fresh_memory(rig: Parameters, sampled: bool) -> Array:
    """``Memory`` of a lane that starts."""
    whole, pistons = Watch.lane(fraction=1.0), observers.fresh_memory(rig, sampled)
    follower = Follower.lane(across=whole, along=whole, calm_across=whole, calm_along=whole)
    mass, friction = Inertia.lane(mass=rig.mechanics.mass), Friction.lane(level=1.0)
    return Memory.lane(fresh=1.0, friction=friction, inertia=mass, follower=follower, pistons=pistons)


def beliefs(rig: Parameters, sampled: bool, noisy: bool, gains: Mapping[str, float], **others: float) -> dict[str, Any]:
    """``Beliefs`` in a rig by name: with a force sensor and nothing learned, where ``others`` do not say otherwise.

    ``gains`` has bandwidth and friction_fraction and, where cells are ``noisy``, pressure_bandwidth, 1/s.
    """
    width = gains["pressure_bandwidth"] if noisy else math.inf
    return {
        **{"belief": observers.belief(rig, gains["bandwidth"]), "compliance": stages.compliance(rig), "place": POSITION},
        **{"sampled": sampled, "force_sensor": True, "learns_noise": False, "rows_of_memory": len(fresh_memory(rig, sampled))},
        **{"trust": 1.0 - exact.number("exp", -width * rig.electronics.control_period)},
        **{
            "friction_fraction": gains["friction_fraction"],
            "friction_rate": 0.0,
            "most_bias": 0.0,
            "weighed": False,
            "identified": False,
        },
        **{"learns_mass": False, "believed_limit": BELIEVED_LIMIT, **others},
    }
