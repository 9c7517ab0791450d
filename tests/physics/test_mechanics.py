"""Mechanics (3), (5), (14), (17) and the end stops: against Newton's law between points, and energy."""

import math

import numpy as np
import pytest

from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled.lanes import PN1, PN2, PP1, PP2, V1, V2, Y1, Y2, Array
from birthsim_env.physics.linkage import mechanics
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Cylinder, Parameters
from tests.oracles import linkage_by_points as by_points
from tests.physics.rigs import NO_FRICTION, each_rig
from tests.physics.test_dynamics import anywhere


def bore_force(cylinder: Cylinder, pp: Array, pn: Array, atmosphere: float) -> Array:
    """(3): what both chambers and, on the rod's section, the atmosphere exert on the piston."""
    bore, rod = math.pi * cylinder.piston_diameter**2 / 4, math.pi * cylinder.rod_diameter**2 / 4
    return pp * bore - pn * (bore - rod) - atmosphere * rod


@each_rig
def test_newtons_law_holds_at_the_end_effector(rig: Parameters) -> None:
    """m a = rod forces along the rods of the linkage made of points + weight + user force."""
    rig = rig.replace(NO_FRICTION)
    plant, command, user = anywhere(rig, 300, 1)
    s = plant.state
    rates = plant.derivatives(s, command, user)
    r4, r2 = s[Y1] + rig.geometry.k1, s[Y2] + rig.geometry.k2
    pose = by_points.pose_from_lengths(r4, r2, rig.geometry)
    acceleration = by_points.cartesian_acceleration(pose, r4, r2, s[V1], s[V2], rates[V1], rates[V2])
    force1 = bore_force(rig.cylinder1, s[PP1], s[PN1], rig.air.atmospheric_pressure)
    force2 = bore_force(rig.cylinder2, s[PP2], s[PN2], rig.air.atmospheric_pressure)
    force = by_points.newton_force(pose, r2, force1, force2) + user
    force[1] -= rig.mechanics.mass * rig.mechanics.gravity
    np.testing.assert_allclose(rig.mechanics.mass * acceleration, force, rtol=0, atol=1e-11 * 1000)
    assert np.array_equal(rates[[Y1, Y2]], s[[V1, V2]])


def test_stop_force_is_zero_inside_a_spring_damper_past_it_and_never_pulls() -> None:
    stiffness, damping, half = 5e6, 1.0, 0.1
    force = mechanics.stop_force
    for y in np.linspace(-half, half, 41):
        assert force(y, 3.0, half, stiffness, damping) == 0 == force(y, -3.0, half, stiffness, damping)
    # 0.1 mm deep: 500 N held, 600 N driven in at 0.2 m/s, 400 N on the way back; mirrored at the near stop.
    for outward, newtons in ((0.0, 500.0), (0.2, 600.0), (-0.2, 400.0), (-1.0, 0.0), (-30.0, 0.0)):
        assert force(half + 1e-4, outward, half, stiffness, damping) == pytest.approx(newtons, abs=1e-8)
        assert force(-half - 1e-4, -outward, half, stiffness, damping) == pytest.approx(-newtons, abs=1e-8)


def free_flight(speed: float, stop_damping: float = 1.0) -> Plant:
    """Cylinder 2 without weight, friction or pressure difference, 1 mm before the stop that ``speed`` runs into."""
    changes = {"mechanics.gravity": 0.0, "valves.leakage_ratio": 0.0, "mechanics.stop_damping": stop_damping}
    rig = Parameters().replace({**NO_FRICTION, **changes})
    plant = Plant(rig, 1)
    plant.state[[PP1, PN1, PP2, PN2]] = rig.air.atmospheric_pressure
    plant.state[Y2], plant.state[V2] = math.copysign(0.199, speed), speed
    return plant


@pytest.mark.parametrize("speed", [0.2, 0.6, -0.6])
@pytest.mark.parametrize("stop_damping", [0.0, 1.0])
def test_rebound_keeps_the_energy_that_hunt_and_crossley_leave(speed: float, stop_damping: float) -> None:
    """Integrating m v dv/dp = -k p (1 + c v) from contact to release relates the speeds by v/c - ln(1 + c v)/c^2."""
    plant, none = free_flight(speed, stop_damping), (np.zeros((4, 1)), np.zeros((1, 2, 1)))
    outward, depth = [], []
    for _ in range(1500):
        dynamics.advance(plant.state, *none, plant.lane_parameters, 5, 2e-6, plant.impacts)
        outward.append(plant.state[V2, 0] * math.copysign(1, speed))
        depth.append(abs(plant.state[Y2, 0]) - 0.2)
    touching = np.flatnonzero(np.array(depth) > 0)
    into, rebound = outward[touching[0]], -outward[touching[-1]]
    assert depth[-1] < 0
    assert into == pytest.approx(abs(speed), rel=0.02)
    if stop_damping == 0:
        assert rebound == pytest.approx(into, rel=0.005)
    else:
        assert rebound < 0.95 * into
        assert -rebound - math.log1p(-rebound) == pytest.approx(into - math.log1p(into), rel=0.01)
