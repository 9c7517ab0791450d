"""How much of the rig's strength an episode asks for: by virtual work on the linkage made of points, and by trying it."""

import gymnasium
import numpy as np
import pytest

from baselines.admittance.controller import AdmittanceController
from baselines.bench.feasibility import required_strength_ratio
from birthsim_env import Circle, FixedTarget, ForceProfile, Parameters, StiffnessSchedule, UserForce
from tests.oracles import derived_law as derived
from tests.oracles import linkage_by_points as by_points
from tests.oracles import rigid_body
from tests.oracles.closed_loop import FRICTIONLESS

PROBE = "BirthSIM/Probe-v3"
RIG = Parameters()
STIFF = StiffnessSchedule(closed_loop=(1e5,))
"""The hand moves the place that it acts at by less than 3 mm."""


class Steady(UserForce):
    """One constant force (2, N), N, per lane, fading in over half a second."""

    def __init__(self, forces):
        self.forces = np.asarray(forces, dtype=float)

    def force(self, time, position, velocity):
        return np.clip(time / 0.5, 0, 1)[:, None, :] * self.forces


def made(lanes=1, **arguments):
    env = gymnasium.make_vec(PROBE, num_envs=lanes, **{"stiffness": STIFF, "user_force": ForceProfile(), **arguments})
    env.reset(seed=0)
    return env


def columns_at(place, rig=RIG):
    """Velocity of the end effector at ``place`` (2,) per unit speed of each piston: (2 axes, 2 cylinders)."""
    r4, r2 = by_points.lengths(by_points.pose_from_point(place[:, None], rig.geometry))
    piston = np.array([r4 - rig.geometry.k1, r2 - rig.geometry.k2])
    return rigid_body.jacobians(piston, rig)[0]


def fraction(needed, rig=RIG):
    """The larger fraction of both cylinders' strength, full against empty chambers, for the forces ``needed`` (2,), N."""
    full, empty, found = rig.air.supply_pressure, rig.air.atmospheric_pressure, []
    for force, cylinder in zip(needed, (rig.cylinder1, rig.cylinder2), strict=True):
        ap, an = derived.areas(cylinder)
        rod = empty * (ap - an)
        found.append(max(force / (full * ap - empty * an - rod), -force / (full * an - empty * ap + rod)))
    return max(found)


def test_what_the_hand_asks_for_is_its_work_against_the_pistons_and_grows_with_its_force():
    place, weight = np.array([0.5, 0.0]), np.array([0.0, RIG.mechanics.mass * 9.81])
    for angle in np.linspace(0, 2 * np.pi, 8, endpoint=False):
        sizes = np.linspace(0, 300, 13)
        pushes = sizes * np.array([[np.cos(angle)], [np.sin(angle)]])
        found = required_strength_ratio(made(13, reference=FixedTarget(tuple(place)), user_force=Steady(pushes)))
        expected = []
        for push in pushes.T:
            # The most of the whole episode: the weight alone at its start, or the hand's full force.
            whole = [fraction(columns_at(place + s * push / 1e5).T @ (weight - s * push)) for s in np.linspace(0, 1, 11)]
            expected.append(max(whole))
        np.testing.assert_allclose(found, expected, rtol=1e-6)
        assert np.all(np.diff(found) >= 0)
        assert found[-1] > 1 > found[0]


def test_moving_takes_inertia_and_friction():
    """Seals are pressed as at full strength: by the supply's pressure in one chamber."""
    rig = RIG.replace({"cylinder2.viscous_friction": 60.0, "mechanics.mass": 4.0})
    env = made(1, reference=Circle(radius=0.06, period=2.0), parameters=rig, duration=2.0)
    centre, rate, most = np.array([0.5, 0.0]), 2 * np.pi / 2.0, 0.0
    supply, atmosphere = rig.air.supply_pressure, rig.air.atmospheric_pressure
    pressures = [supply, atmosphere, supply, atmosphere]
    for time in np.arange(0.0, 2.0, 0.05):
        way = np.array([np.cos(rate * time), np.sin(rate * time)])
        columns = columns_at(centre + 0.06 * way, rig)
        speed = np.linalg.solve(columns, 0.06 * rate * np.array([-way[1], way[0]]))
        needed = columns.T @ (4.0 * (-0.06 * rate**2 * way + [0.0, 9.81]))
        friction = np.array(derived.coulomb_levels(pressures, speed, rig))
        needed += [35.0, 60.0] * speed + friction * np.sign(speed)
        most = max(most, fraction(needed, rig))
    np.testing.assert_allclose(required_strength_ratio(env), most, rtol=1e-9)


def test_a_compliant_target_out_of_reach_is_infinite_in_its_lane_alone():
    """At 500 N/m 200 N ask for 0.4 m."""
    soft = StiffnessSchedule(closed_loop=(500.0,))
    pushes = np.array([[10.0, 200.0, -10.0], [0.0, 0.0, 5.0]])
    found = required_strength_ratio(made(3, stiffness=soft, user_force=Steady(pushes)))
    np.testing.assert_array_equal(np.isinf(found), [False, True, False])
    alone = required_strength_ratio(made(2, stiffness=soft, user_force=Steady(pushes[:, [0, 2]])))
    np.testing.assert_array_equal(found[[0, 2]], alone)


def test_below_one_a_strong_law_holds_and_above_it_none_can():
    """The hand's force, either way along both axes, is scaled to 0.9 and 1.12 of what the air can bear, and held for 2 s."""
    sizes, forces = np.linspace(20.0, 400.0, 200), []
    for unit in np.array([[[1.0], [0.0]], [[-1.0], [0.0]], [[0.0], [1.0]], [[0.0], [-1.0]]]):
        asked = required_strength_ratio(made(200, user_force=Steady(unit * sizes), parameters=FRICTIONLESS))
        forces.append(unit * np.interp([0.9, 1.12], asked, sizes))
    env = made(8, user_force=Steady(np.hstack(forces)), parameters=FRICTIONLESS, policy_period=1e-3, duration=2.5)
    np.testing.assert_allclose(required_strength_ratio(env), np.tile([0.9, 1.12], 4), atol=0.01)
    law, lost = AdmittanceController(FRICTIONLESS, learn=False), np.zeros(8, dtype=np.bool_)
    for _ in range(2400):
        _, _, terminated, _, infos = env.step(law.command(env.measurement, env.reference).T)
        lost |= terminated
    error = np.hypot(*infos["tracking_error"].T)
    assert not lost[::2].any()
    assert np.all(error[::2] < 1e-3)
    assert np.all(lost[1::2] | (error[1::2] > 0.01))


@pytest.mark.parametrize(
    ("name", "arguments"),
    [("BirthSIM/Descent-v2", {"randomize": True}), ("BirthSIM/Circle-v2", {"user_force": "guided", "duration": 2.0})],
    ids=["randomised", "a hand with a memory"],
)
def test_looking_ahead_changes_nothing(name, arguments):
    one, other = (gymnasium.make_vec(name, num_envs=2, **arguments) for _ in range(2))
    one.reset(seed=1), other.reset(seed=1)
    required_strength_ratio(one)
    for _ in range(150):
        np.testing.assert_array_equal(one.step(np.zeros((2, 4)))[0], other.step(np.zeros((2, 4)))[0])
