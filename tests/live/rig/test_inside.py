"""Friction and flows of a frame, against the plant's own equations of motion and of mass."""

import numpy as np
import pytest

from birthsim_env import Parameters, Plant
from birthsim_env.physics.compiled import lanes
from birthsim_env.physics.linkage.geometry import amplification
from birthsim_live.rig.stages import INSIDE, look_inside

FRICTION = [getattr(lanes, name) for name in ("FC1", "FC2", "FP1", "FP2", "FV1", "FV2", "S0", "S1")]


def moving_plant(law):
    plant = Plant(Parameters().replace({"friction.law": law}))
    plant.advance(np.array([[0.6], [-0.6], [-0.4], [0.4]]), np.array([[20.0], [-10.0]]), 0.2)
    assert (np.abs(plant.piston_speed) > 0.01).all()
    return plant


def inside(plant):
    rows = np.empty((INSIDE, 1))
    look_inside(plant.state, plant.lane_parameters, np.zeros((4, plant.num_envs)), rows)
    return rows[:, 0]


@pytest.mark.parametrize("law", ["lugre", "elasto_plastic", "coulomb"])
def test_friction_is_what_the_pistons_lack_of_acceleration(law):
    plant = moving_plant(law)
    still = np.zeros((4, 1)), np.zeros((2, 1))
    with_friction = plant.derivatives(plant.state, *still)
    g, y1, y2 = Parameters().geometry, *plant.piston[:, 0]
    w = (y1 + g.k1) ** 2 - g.d3**2 - g.d6**2
    kappa = amplification(y2 + g.k2, y1 + g.k1, 1 / np.sqrt((2 * g.d3 * g.d6) ** 2 - w**2))
    found = inside(plant)[:2]
    plant.lane_parameters[FRICTION] = 0.0
    free = plant.derivatives(plant.state, *still)
    lack = (free - with_friction)[[lanes.V1, lanes.V2], 0] * plant.lane_parameters[lanes.MASS, 0] * [kappa**2, 1.0]
    assert found == pytest.approx(lack, rel=1e-9)
    assert (np.abs(found) > 5).all()


def test_flows_are_those_that_fill_the_chambers():
    """The ideal gas: a chamber's mass P V / (R T) grows by what flows in."""
    plant = moving_plant("lugre")
    rig = Parameters()
    flows, step = inside(plant)[2:], 1e-6

    def masses():
        halves = np.repeat([rig.cylinder1.stroke / 2, rig.cylinder2.stroke / 2], 2)
        lengths = halves + np.repeat(plant.piston[:, 0], 2) * [1, -1, 1, -1]
        areas = [rig.cylinder1.area_p, rig.cylinder1.area_n, rig.cylinder2.area_p, rig.cylinder2.area_n]
        volumes = rig.chambers.dead_volume + areas * lengths
        return plant.pressures[:, 0] * volumes / (rig.air.gas_constant * plant.temperatures[:, 0])

    before = masses()
    plant.advance(plant.state[-4:].copy(), np.zeros((2, 1)), step)
    assert (masses() - before) / step == pytest.approx(flows, rel=1e-3, abs=1e-8)
