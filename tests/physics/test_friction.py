"""Friction: LuGre (Canudas de Wit et al. 1995) and the paper's (4), against the textbook equations written afresh here.

What the elasto-plastic law shares with LuGre is tested here too; what sets it apart in ``test_elasto_plastic.py``.

The force that the plant applies is measured from its accelerations: friction is what is missing compared with a rig
without friction in the same state.
"""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from birthsim_env.physics import friction
from birthsim_env.physics.compiled.lanes import V1, V2, Z1, Z2, Array
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import linkage_by_points as by_points
from tests.physics.rigs import LAWS, NO_FRICTION

FC, FS, VS, FV = (12.0, 15.0), (12.0 * 1.33, 15.0 * 1.33), 0.015, 35.0
S0, S1 = 5e4, 150.0
"""Assumed: levels of cylinders 1 and 2, Stribeck speed, viscous friction, bristle stiffness and damping."""


def stribeck(v: float, cylinder: int) -> float:
    return FC[cylinder] + (FS[cylinder] - FC[cylinder]) / (1 + (v / VS) ** 2)


class PlantFriction:
    """Friction forces and bristle rates of both pistons in the plant, at speeds and deflections (2, N)."""

    def __init__(self, lanes: int, changes: dict[str, object] | None = None) -> None:
        rig = Parameters().replace(changes or {})
        self.rough, self.smooth = Plant(rig, lanes), Plant(rig.replace(NO_FRICTION), lanes)
        pose = by_points.pose_from_lengths(rig.geometry.k1, rig.geometry.k2, rig.geometry)
        self.apparent_mass = rig.mechanics.mass * np.array([[(rig.geometry.k2 / pose.lever) ** 2], [1.0]])
        self.idle = np.zeros((4, lanes)), np.zeros((2, lanes))

    def __call__(self, speed: Array, deflection: Array) -> tuple[Array, Array]:
        state = self.rough.state.copy()
        state[[V1, V2]], state[[Z1, Z2]] = speed, deflection
        rates = self.rough.derivatives(state, *self.idle)
        lost = self.smooth.derivatives(state, *self.idle) - rates
        return self.apparent_mass * lost[[V1, V2]], rates[[Z1, Z2]]


MOTIONS = [(0.3, 2.0), (0.02, 5.0), (0.002, 1.0)]
"""m/s and Hz, from gross sliding to presliding."""

INSTANTS = 2001
"""At which a second of motion is looked at."""

Rate = Callable[[float, float, int], float]
"""dz/dt from v, z and the cylinder."""


def along(bristle: Rate, amplitude: float, frequency: float) -> tuple[list[float], Array]:
    """A second of speeds that turn round again and again, and both bristles, (2, INSTANTS), by SciPy."""

    def speed(t: float) -> float:
        return amplitude * (math.sin(2 * math.pi * frequency * t) + 0.4 * math.sin(7 * frequency * t))

    def slopes(t: float, z: Array) -> list[float]:
        v = speed(t)
        return [bristle(v, z[k], k) for k in (0, 1)]

    times = np.linspace(0, 1, INSTANTS)
    deflection = solve_ivp(slopes, (0, 1), [0.0, 0.0], t_eval=times, rtol=1e-5, atol=1e-9, max_step=2e-3).y
    return [speed(t) for t in times], deflection


def follows(plant: PlantFriction, bristle: Rate, amplitude: float, frequency: float) -> Array:
    """Rates and forces of the plant are those of the equations at every instant; their bristles (2, INSTANTS).

    Whoever has the rates right has their integral too, so that the accuracy of SciPy's solution does not matter.
    """
    speeds, deflection = along(bristle, amplitude, frequency)
    assert np.abs(deflection).max() > 0.9 * FC[0] / S0, "the motion must reach gross sliding"
    wanted = np.array([[bristle(v, z, k) for v, z in zip(speeds, deflection[k], strict=True)] for k in (0, 1)])
    both = np.array([speeds, speeds])
    force, rates = plant(both, deflection)
    # Roundings: a dozen of speeds below 1 m/s; some of accelerations of some 100 m/s2, times some kilograms.
    np.testing.assert_allclose(rates, wanted, rtol=0, atol=1e-14)
    np.testing.assert_allclose(force, S0 * deflection + S1 * wanted + FV * both, rtol=0, atol=1e-11)
    return deflection


def textbook_rate(v: float, z: float, cylinder: int) -> float:
    return v - S0 * abs(v) / stribeck(v, cylinder) * z


@pytest.mark.parametrize(("amplitude", "frequency"), MOTIONS)
def test_lugre_follows_the_textbook_along_a_motion(amplitude: float, frequency: float) -> None:
    """Through reversals, gross sliding and presliding."""
    follows(PlantFriction(INSTANTS), textbook_rate, amplitude, frequency)


@given(v=st.floats(-10, 10), z=st.floats(-4e-4, 4e-4), level=st.floats(0.01, 40))
def test_rate_is_textbook_below_the_limit_and_limited_above(v: float, z: float, level: float) -> None:
    rate = friction.bristle_rate(v, z, level, S0)
    if S0 * abs(v) <= 8000 * level:
        assert rate == pytest.approx(v - S0 * abs(v) * z / level, rel=1e-12, abs=1e-12)
    else:
        toward = math.copysign(level / S0, v) - z
        assert rate == pytest.approx(8000 * toward, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("law", ["lugre", "elasto_plastic"])
def test_bristle_stays_bounded_by_the_breakaway_deflection(law: str) -> None:
    lanes, rng = 200, np.random.default_rng(7)
    plant, largest = Plant(Parameters().replace({"friction.law": law}), lanes), 0.0
    for _ in range(100):
        plant.advance(rng.uniform(-1, 1, (4, lanes)), rng.uniform(-150, 150, (5, 2, lanes)), 0.01)
        largest = np.maximum(largest, np.abs(plant.state[[Z1, Z2]]).max(axis=1))
    assert np.all(largest <= np.array(FS) / S0 * (1 + 1e-9)), largest
    assert np.all(largest > np.array(FC) / S0), "some lane must have come near the bound"


def test_coulomb_law_is_fc_and_fv_v_with_a_line_through_rest() -> None:
    speeds = np.array([0.5, 0.02, 0.002, 0.0, -0.001, -0.02, -0.5])
    plant = PlantFriction(7, {"friction.law": "coulomb", "friction.sign_speed": 0.004})
    force, rate = plant(np.array([speeds, speeds]), np.full((2, 7), 1e-4))
    expected = [fc * np.clip(speeds / 0.004, -1, 1) + FV * speeds for fc in FC]
    np.testing.assert_allclose(force, expected, rtol=1e-10, atol=1e-10)
    assert np.all(rate == 0), "no bristle in (4)"


@pytest.mark.parametrize("law", LAWS)
def test_no_friction_when_switched_off(law: str) -> None:
    plant = PlantFriction(3, {**NO_FRICTION, "friction.law": law})
    force, _ = plant(np.array([[-0.7, 0.0, 2.5]] * 2), np.zeros((2, 3)))
    assert np.abs(force).max() <= (0.0 if law == "coulomb" else 1e-7)


@given(v=st.floats(-5, 5), cylinder=st.sampled_from([0, 1]))
def test_steady_friction_takes_energy_at_every_speed(v: float, cylinder: int) -> None:
    level = friction.stribeck_level(v, FC[cylinder], FS[cylinder], VS)
    z = friction.steady_deflection(v, level, S0)
    lugre = friction.lugre_force(v, z, friction.bristle_rate(v, z, level, S0), S0, S1, FV)
    coulomb = friction.coulomb_force(v, FC[cylinder], FV, 1 / 0.002)
    least = FV * v * v
    assert lugre * v >= least
    assert coulomb * v >= least
    assert v == 0 or lugre * v > least


@pytest.mark.parametrize("law", ["lugre", "elasto_plastic"])
def test_friction_takes_energy_over_a_cycle(law: str) -> None:
    """Work of both pistons over closed cycles of position is positive, from presliding to gross sliding."""
    plant = PlantFriction(6, {"friction.law": law})
    amplitude = np.array([1e-5, 1e-4, 4e-4, 1e-3, 1e-2, 1e-1])
    z, work, step, turn = np.zeros((2, 6)), np.zeros((2, 6)), 1e-4, 5000
    for k in range(2 * turn):
        v = np.repeat((amplitude * 4 * math.pi * math.cos(4 * math.pi * k * step))[None], 2, axis=0)
        force, rate = plant(v, z)
        z, work = z + step * rate, work + (step * force * v if k >= turn else 0.0)
    assert np.all(work > 0)
    assert np.all(work[0, 4:] > 4 * amplitude[4:] * FC[0]), "at least Coulomb's rectangle once it slides"


@given(v=st.floats(-3, 3), coulomb=st.floats(0, 40), extra=st.floats(0, 20), stribeck_speed=st.floats(1e-3, 0.1))
def test_inverse_level_is_one_over_the_level(v: float, coulomb: float, extra: float, stribeck_speed: float) -> None:
    level = friction.stribeck_level(v, coulomb, coulomb + extra, stribeck_speed)
    weakness = friction.inverse_level(v, coulomb, coulomb + extra, stribeck_speed)
    assert weakness == pytest.approx(1 / max(level, friction.SMALLEST_LEVEL), rel=1e-13)
