"""The state to start from: forces in balance on both pistons, pneumatic stiffness as asked for, pressures that can be."""

import numpy as np
import pytest

from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import rigid_body
from tests.physics.rigs import LAWS, MOVED, PRESSED
from tests.physics.test_mechanics import bore_force

LANES = 30
CHAMBERS = ((at.PP1, at.PN1), (at.PP2, at.PN2))


def situation(rig: Parameters, seed: int) -> tuple[Array, Array]:
    """Pistons anywhere inside their strokes, at rest and at speeds of both signs."""
    rng = np.random.default_rng(seed)
    half = np.array([[rig.cylinder1.stroke / 2], [rig.cylinder2.stroke / 2]])
    return 0.7 * half * rng.uniform(-1, 1, (2, LANES)), rng.choice([0.0, 0.004, -0.004, 0.3, -0.3], (2, LANES))


def friction(rig: Parameters, speed: Array, pressures: Array) -> Array:
    """Friction of steady sliding, N, (2, N), between chambers at ``pressures`` (4, N), Pa; none at rest."""
    rows = []
    for k, (cylinder, v) in enumerate(zip((rig.cylinder1, rig.cylinder2), speed, strict=True)):
        pressed = cylinder.pressure_friction * (pressures[2 * k : 2 * k + 2] - rig.air.atmospheric_pressure).sum(axis=0)
        level = (cylinder.coulomb_friction + pressed) * (1 + cylinder.direction_asymmetry * np.sign(v))
        if rig.friction.law != "coulomb":
            level = level * (1 + (rig.friction.static_ratio - 1) / (1 + (v / rig.friction.stribeck_speed) ** 2))
        rows.append(np.sign(v) * level + cylinder.viscous_friction * v)
    return np.array(rows)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("changes", [MOVED, {**MOVED, **PRESSED}], ids=["moved", "pressed"])
def test_forces_balance_at_rest_and_in_motion(changes: dict[str, object], law: str) -> None:
    """Pressures carry weight, by virtual work, and the friction of steady sliding, at the stiffness (9) asked for."""
    rig = Parameters().replace({**changes, "friction.law": law})
    plant, (piston, speed) = Plant(rig, LANES), situation(rig, 1)
    asked = np.random.default_rng(2).uniform([[3600], [2500]], [[4400], [3200]], (2, LANES))
    s = balanced_state(plant.lane_parameters, piston, speed, asked)
    np.testing.assert_array_equal(s[[at.Y1, at.Y2]], piston)
    np.testing.assert_array_equal(s[[at.V1, at.V2]], speed)
    np.testing.assert_array_equal(s[list(at.TEMPERATURES)], rig.air.temperature)
    np.testing.assert_array_equal(s[list(at.SPOOLS)], 0.0)
    weight = np.array([0.0, -rig.mechanics.mass * rig.mechanics.gravity])
    carried = -(rigid_body.jacobians(piston, rig).transpose(0, 2, 1) @ weight).T
    inside = np.all((s[list(at.PRESSURES)] > 1.1e5) & (s[list(at.PRESSURES)] < 6.9e5), axis=0)
    assert inside.sum() > LANES / 3
    rubbed = friction(rig, speed, s[list(at.PRESSURES)])
    for i, cylinder in enumerate((rig.cylinder1, rig.cylinder2)):
        pp, pn = s[CHAMBERS[i][0]], s[CHAMBERS[i][1]]
        pushed = bore_force(cylinder, pp, pn, rig.air.atmospheric_pressure)
        np.testing.assert_allclose(pushed, carried[i] + rubbed[i], rtol=0, atol=1e-9)
        length_p, length_n = cylinder.stroke / 2 + piston[i], cylinder.stroke / 2 - piston[i]
        stiffness = rig.air.polytropic_index * (pp * cylinder.area_p / length_p + pn * cylinder.area_n / length_n)
        np.testing.assert_allclose(stiffness[inside], asked[i, inside], rtol=1e-12)
        if law == "coulomb":
            np.testing.assert_array_equal(s[at.Z1 + i], 0.0)
        else:
            dry = rubbed[i] - cylinder.viscous_friction * speed[i]
            np.testing.assert_allclose(s[at.Z1 + i], dry / rig.friction.bristle_stiffness, rtol=1e-12)


@pytest.mark.parametrize("mass", [2.5, 7.0])
def test_a_stiffness_out_of_reach_is_approached_between_atmosphere_and_supply(mass: float) -> None:
    """The load decides which chamber of a cylinder is the first to be empty or full."""
    rig = Parameters().replace({**MOVED, "mechanics.mass": mass})
    plant, (piston, speed) = Plant(rig, LANES), situation(rig, 3)
    low, high = rig.air.atmospheric_pressure, rig.air.supply_pressure
    for asked, edge in ((100.0, low), (1e5, high)):
        s = balanced_state(plant.lane_parameters, piston, 4 * speed, np.full((2, LANES), asked))
        for pp, pn in CHAMBERS:
            assert np.all(np.minimum(s[pp], s[pn]) > low * (1 - 1e-12))
            assert np.all(np.maximum(s[pp], s[pn]) < high * (1 + 1e-12))
            nearest = (np.minimum if edge == low else np.maximum)(s[pp], s[pn])
            np.testing.assert_allclose(nearest, edge, rtol=1e-12)


def test_what_hardly_moves_starts_without_friction_and_the_stiffness_is_46_and_23() -> None:
    rig = Parameters()
    plant, nowhere = Plant(rig, 3), np.zeros((2, 3))
    s = balanced_state(plant.lane_parameters, nowhere, np.array([[0.0, 0.95e-9, 1.05e-9]] * 2))
    assert s[at.Z1, 0] == s[at.Z1, 1] == 0.0
    assert s[at.Z1, 2] > 0
    np.testing.assert_array_equal(s[list(at.PRESSURES), 0], s[list(at.PRESSURES), 1])
    index, c1, c2 = rig.air.polytropic_index, rig.cylinder1, rig.cylinder2
    assert index * (s[at.PP1, 0] * c1.area_p + s[at.PN1, 0] * c1.area_n) / 0.1 == pytest.approx(4600)
    assert index * (s[at.PP2, 0] * c2.area_p + s[at.PN2, 0] * c2.area_n) / 0.2 == pytest.approx(2300)
    np.testing.assert_array_equal(balanced_state(plant.lane_parameters, nowhere)[:, 0], s[:, 0])
