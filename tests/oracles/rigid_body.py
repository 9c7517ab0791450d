"""The end effector as a point of mass on the linkage made of points, with the valves of ``derived_law``.

What acceleration and jerk a law's openings give it: an independent truth for laws that ask for a jerk. Arrays are (rows, N).
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.signals import Measurement
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import derived_law
from tests.oracles import linkage_by_points as by_points

STEP = 1e-6
"""s; half the distance of the central difference along the motion."""


class Instant(NamedTuple):
    """Pistons (2, N), m and m/s, pressures (4, N), Pa, and pneumatic stiffnesses (2, N), N/m."""

    piston: Array
    speed: Array
    pressures: Array
    stiffness: Array


def pose_of(piston: Array, rig: Parameters) -> by_points.Pose:
    return by_points.pose_from_lengths(piston[0] + rig.geometry.k1, piston[1] + rig.geometry.k2, rig.geometry)


def jacobians(piston: Array, rig: Parameters) -> Array:
    """(N, 2, 2): velocity of the end effector per unit speed of each piston."""
    pose, r2 = pose_of(piston, rig), piston[1] + rig.geometry.k2
    columns = [by_points.cartesian_velocity(pose, r2, 1.0 - i, float(i))[0] for i in range(2)]
    return np.stack(columns, axis=1).transpose(2, 0, 1)


def rendered(openings: Array, rig: Parameters) -> NDArray[np.bool_]:
    """Lanes, (N,), whose ``openings`` (4, N) give the forces that a law asks for.

    One valve of a cylinder that saturates takes from the pneumatic stiffness alone; one amid its overlap lets less through.
    """
    sizes, crossed = np.abs(openings), rig.valves.supply_overlap + rig.valves.crossing
    has_force = sizes.reshape(2, 2, -1).min(axis=1) < 1 - 1e-9
    return np.asarray(has_force.all(axis=0) & ((sizes > crossed) | (sizes < 1e-9)).all(axis=0))


def rod_forces(rig: Parameters) -> Array:
    """Of the atmosphere on the rods' sections, (2, 1), N."""
    areas = [derived_law.areas(cylinder) for cylinder in (rig.cylinder1, rig.cylinder2)]
    return -rig.air.atmospheric_pressure * np.diff(areas)


def near_balance(rig: Parameters, lanes: int, seed: int, speed: float, push: float) -> Instant:
    """Random positions, speeds up to ``speed`` m/s and forces within ``push`` N of those that carry the weight."""
    rng = np.random.default_rng(seed)
    piston = rng.uniform([[-0.06], [-0.12]], [[0.06], [0.12]], (2, lanes))
    weight = np.array([0.0, rig.mechanics.mass * rig.mechanics.gravity])
    stiffness = rng.uniform([[3500.0], [1800.0]], [[4500.0], [2300.0]], (2, lanes))
    needed = (jacobians(piston, rig).transpose(0, 2, 1) @ weight).T + rng.uniform(-push, push, (2, lanes))
    pressures = derived_law.air_for(needed + rod_forces(rig), stiffness, piston, rig)
    return Instant(piston, rng.uniform(-speed, speed, (2, lanes)), pressures, stiffness)


def seen(now: Instant, rig: Parameters, user_force: Array) -> Measurement:
    """What exact sensors say."""
    return replace(derived_law.seen(now.piston, now.speed, now.pressures, rig), user_force=user_force)


def forces(pressures: Array, rig: Parameters) -> Array:
    """Of the chambers less that of the atmosphere, (2, N), N."""
    return np.array(derived_law.forces(pressures, rig)) - rod_forces(rig)


def force_rates(openings: Array, now: Instant, rig: Parameters) -> Array:
    """dF/dt of both cylinders, (2, N), by the control model (6)."""
    rates = np.empty((2, openings.shape[1]))
    for lane, opening in enumerate(openings.T):
        for i, cylinder in enumerate((rig.cylinder1, rig.cylinder2)):
            air = now.pressures[2 * i : 2 * i + 2, lane]
            flow = [derived_law.net_flow(s, p, rig) for s, p in zip(opening[2 * i : 2 * i + 2], air, strict=True)]
            y, v = now.piston[i, lane], now.speed[i, lane]
            rates[i, lane] = derived_law.force_and_stiffness_rates(air, flow, y, v, cylinder, rig)[0]
    return rates


def acceleration(piston: Array, speed: Array, force: Array, rig: Parameters, constant: Array, user_force: Array) -> Array:
    """Of the end effector, under ``force``, viscous friction and a ``constant`` force along the pistons, (2, N) each."""
    viscous = np.array([[rig.cylinder1.viscous_friction], [rig.cylinder2.viscous_friction]])
    along = force - viscous * speed + constant
    r2 = piston[1] + rig.geometry.k2
    push = by_points.newton_force(pose_of(piston, rig), r2, *along) + user_force
    return np.asarray(push / rig.mechanics.mass - np.array([[0.0], [rig.mechanics.gravity]]))


def joint_acceleration(piston: Array, speed: Array, wanted: Array, rig: Parameters) -> Array:
    """Of the pistons, (2, N), where the end effector's is ``wanted``: linear, so from three evaluations."""
    r4, r2 = piston[0] + rig.geometry.k1, piston[1] + rig.geometry.k2

    def cartesian(a1: float, a2: float) -> Any:
        return by_points.cartesian_acceleration(pose_of(piston, rig), r4, r2, *speed, a1, a2)

    still = cartesian(0.0, 0.0)
    matrix = np.stack([cartesian(1.0, 0.0) - still, cartesian(0.0, 1.0) - still], axis=1).transpose(2, 0, 1)
    return np.linalg.solve(matrix, (wanted - still).T[..., None])[..., 0].T


def acceleration_and_jerk(
    openings: Array, now: Instant, rig: Parameters, constant: Array, user_force: Array
) -> tuple[Array, Array]:
    """Of the end effector, (2, N) each; the jerk as the acceleration's derivative along the motion, the user's force held."""
    force, rate = forces(now.pressures, rig), force_rates(openings, now, rig)
    here = acceleration(now.piston, now.speed, force, rig, constant, user_force)
    bend = joint_acceleration(now.piston, now.speed, here, rig)

    def at(time: float) -> Array:
        piston = now.piston + time * now.speed + 0.5 * time**2 * bend
        return acceleration(piston, now.speed + time * bend, force + time * rate, rig, constant, user_force)

    return here, (at(STEP) - at(-STEP)) / (2 * STEP)
