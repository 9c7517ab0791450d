"""Friction: LuGre (Canudas de Wit et al. 1995) and the elasto-plastic law (Dupont et al. 2002) against their equations.

The plant with each of its three laws is compared with the second model in ``test_dynamics.py`` and ``test_second_model.py``.
"""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled.lanes import PRESSURES, V1, V2, Y2, Z1, Z2
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.seals import friction
from birthsim_env.physics.step import STEP
from lab.studies.accuracy.second_model import plastic_fraction
from tests.physics.rigs import LAWS, NO_FRICTION
from tests.physics.test_dynamics import anywhere

FC, FS, VS, FV = (8.7, 11.7), (8.7 * 1.33, 11.7 * 1.33), 0.015, 35.0
GROWTH, S0, S1, RATIO, MASS = 5e-6, 5e4, 150.0, 0.7, 3.0
"""Of the default rig: levels of cylinders 1 and 2 between chambers at the atmosphere's pressure, Stribeck speed, viscous
friction; growth of the levels with the pressures, bristle stiffness and damping, break-away, mass."""
FREE = {"mechanics.gravity": 0.0, "chambers.dead_volume": 10.0, "valves.leakage_ratio": 0.0}
"""No weight, and chambers of 10 m3, which act like the open air."""

bristles = pytest.mark.parametrize("law", ["lugre", "elasto_plastic"])


def stribeck(v: float, cylinder: int, gauge: float = 0.0) -> float:
    """G(v), N, where both chambers of a cylinder together are ``gauge``, Pa, above the atmosphere."""
    return (FC[cylinder] + GROWTH * gauge) * (1 + (FS[cylinder] / FC[cylinder] - 1) / (1 + (v / VS) ** 2))


def gauges(plant: Plant) -> np.ndarray:
    """Pressures, Pa, of both chambers of cylinder 1 and of cylinder 2 together above the atmosphere, (2, N)."""
    return np.asarray(plant.pressures.reshape(2, 2, -1).sum(axis=1) - 2 * Parameters().air.atmospheric_pressure)


def rate(law: str, v: float, z: float, level: float, ratio: float = RATIO) -> float:
    """dz/dt = v - alpha s0 |v| z / G, alpha = 1 of LuGre."""
    alpha = 1.0 if law == "lugre" else plastic_fraction(z, v, level / S0, ratio)
    return v - alpha * S0 * abs(v) * z / level


@given(v=st.floats(-10, 10), z=st.floats(-4e-4, 4e-4), level=st.floats(0.01, 40))
def test_rate_of_lugre_is_the_textbooks_below_the_limit_and_limited_above(v: float, z: float, level: float) -> None:
    found = friction.bristle_rate(v, z, level, S0)
    if S0 * abs(v) <= STEP.relaxation_limit * level:
        assert found == pytest.approx(rate("lugre", v, z, level), rel=1e-12, abs=1e-12)
    else:
        toward = math.copysign(level / S0, v) - z
        assert found == pytest.approx(STEP.relaxation_limit * toward, rel=1e-6, abs=1e-9)


@given(v=st.floats(-10, 10), z=st.floats(-6e-4, 6e-4), level=st.floats(0.5, 40), ratio=st.floats(0.01, 0.9))
def test_elasto_plastic_rate_is_the_papers_below_the_limit_and_held_above(
    v: float, z: float, level: float, ratio: float
) -> None:
    found = friction.bristle_rate_by_law(v, z, 1 / level, S0, False, ratio, 1 / (1 - ratio))
    held = min(1.0, STEP.elasto_plastic_limit * level / (S0 * abs(v))) if v != 0 else 1.0
    assert found == pytest.approx(rate("elasto_plastic", v, z, level, ratio) * held, rel=1e-9, abs=1e-9)


@given(s=st.floats(-1, 2))
def test_cubic_is_within_a_hundredth_of_the_papers_sine(s: float) -> None:
    sine = 0.5 * math.sin(math.pi * (min(1.0, max(0.0, s)) - 0.5)) + 0.5
    assert friction.sliding_fraction(RATIO + s * (1 - RATIO), RATIO, 1 / (1 - RATIO)) == pytest.approx(sine, abs=0.0101)


@given(v=st.floats(-3, 3), coulomb=st.floats(0, 40), extra=st.floats(0, 20), stribeck_speed=st.floats(1e-3, 0.1))
def test_level_and_its_inverse(v: float, coulomb: float, extra: float, stribeck_speed: float) -> None:
    level = coulomb + extra / (1 + (v / stribeck_speed) ** 2)
    assert friction.stribeck_level(v, coulomb, coulomb + extra, stribeck_speed) == pytest.approx(level, rel=1e-13)
    weakness = friction.inverse_level(v, coulomb, coulomb + extra, stribeck_speed)
    assert weakness == pytest.approx(1 / max(level, friction.SMALLEST_LEVEL), rel=1e-12)


@pytest.mark.parametrize("law", LAWS)
def test_no_friction_when_switched_off(law: str) -> None:
    """An acceleration is 1e-7 N over some kilograms off at most."""
    (smooth, command, push), rig = anywhere(Parameters().replace(NO_FRICTION), 8, 0), Parameters()
    smooth.state[[Z1, Z2]] = 0.0
    off = Plant(rig.replace({**NO_FRICTION, "friction.law": law}), 8)
    rates = [plant.derivatives(smooth.state, command, push)[[V1, V2]] for plant in (smooth, off)]
    np.testing.assert_allclose(*rates, rtol=0, atol=1e-6)


@bristles
def test_bristle_stays_bounded_by_the_breakaway_deflection(law: str) -> None:
    """Of each lane, at the highest pressures that it has had every 2 ms."""
    lanes, rng = 200, np.random.default_rng(7)
    plant = Plant(Parameters().replace({"friction.law": law}), lanes)
    largest, pressed = np.zeros((2, lanes)), gauges(plant)
    for _ in range(100):
        command, pushes = rng.uniform(-1, 1, (4, lanes)), rng.uniform(-150, 150, (5, 2, lanes))
        for push in pushes:
            plant.advance(command, push, 0.002)
            largest, pressed = np.maximum(largest, np.abs(plant.state[[Z1, Z2]])), np.maximum(pressed, gauges(plant))
    share = np.array([largest[k] * S0 / stribeck(0.0, k, pressed[k]) for k in range(2)])
    assert share.max() <= 1 + 1e-9
    assert np.all(share.max(axis=1) > 1 / 1.33), "some lane must have come near the bound"


@given(v=st.floats(-5, 5), cylinder=st.sampled_from([0, 1]))
@example(v=0.0, cylinder=0)
def test_steady_friction_takes_energy_at_every_speed(v: float, cylinder: int) -> None:
    level = friction.stribeck_level(v, FC[cylinder], FS[cylinder], VS)
    z = friction.steady_deflection(v, level, S0)
    assert z == pytest.approx(math.copysign(stribeck(v, cylinder) / S0, v) if v else 0.0)
    lugre = friction.lugre_force(v, z, friction.bristle_rate(v, z, level, S0), S0, S1, FV)
    coulomb = friction.coulomb_force(v, FC[cylinder], FV, 1 / 0.002)
    least = FV * v * v
    assert lugre * v >= least
    assert coulomb * v >= least
    assert v == 0 or lugre * v > least


@given(law=st.sampled_from(LAWS), v=st.floats(0.002, 0.3), bar=st.floats(0, 6), way=st.sampled_from([1, -1]))
@settings(max_examples=20)
def test_a_seal_rubs_by_the_pressures_and_the_way(law: str, v: float, bar: float, way: int) -> None:
    """Sliding at a constant speed: (3 N + 0.6 N/bar (p + 2 bar)) (1 +- 0.2) by G(v)/Fc, and Fv v."""
    changes = {"coulomb_friction": 3.0, "pressure_friction": 6e-6, "direction_asymmetry": 0.2}
    rig = Parameters().replace({**{f"cylinder2.{name}": value for name, value in changes.items()}, "friction.law": law})
    level = (3.0 + 0.6 * (bar + 2.0)) * (1.2 if way > 0 else 0.8)
    steady = level if law == "coulomb" else level * (1.0 + 0.33 / (1.0 + (v / VS) ** 2))
    plant, air = Plant(rig), rig.air.atmospheric_pressure
    plant.state[[PRESSURES[2], PRESSURES[3], V2, Z2]] = [[air + 1e5 * bar], [air + 2e5], [way * v], [way * steady / S0]]
    force, rate = dynamics.piston_friction(plant.state, plant.lane_parameters, 0, 1)
    assert force == pytest.approx(way * (steady + FV * v), rel=1e-12)
    assert rate == pytest.approx(0.0, abs=1e-12)


def test_a_level_below_zero_is_none() -> None:
    """Suction of 0.6 bar on a seal that only pressure makes rub."""
    assert friction.pressed_level(0.0, 9e-6, 0.7e5, 0.7e5, 1e5) == 0.0
    assert friction.pressed_level(1.0, 9e-6, 0.7e5, 0.7e5, 1e5) == pytest.approx(1.0 - 9e-6 * 0.6e5)


@bristles
@pytest.mark.parametrize("amplitude", [1e-5, 1e-4, 4e-4, 1e-3, 1e-2, 1e-1])
def test_friction_takes_energy_over_a_cycle(amplitude: float, law: str) -> None:
    """Work over a closed cycle of position is positive, from presliding to gross sliding."""
    z, work, step, turn = 0.0, 0.0, 1e-4, 5000
    for k in range(2 * turn):
        v = amplitude * 4 * math.pi * math.cos(4 * math.pi * k * step)
        weakness = friction.inverse_level(v, FC[0], FS[0], VS)
        slope = friction.bristle_rate_by_law(v, z, weakness, S0, law == "lugre", RATIO, 1 / (1 - RATIO))
        work += step * v * friction.lugre_force(v, z, slope, S0, S1, FV) if k >= turn else 0.0
        z += step * slope
    assert work > 0
    assert amplitude < 1e-2 or work > 4 * amplitude * FC[0], "at least Coulomb's rectangle once it slides"


def test_presliding_is_a_spring_without_drift_where_lugre_drifts() -> None:
    """4.5 N with 4 N at 5 Hz on it, below break-away, for 4 s; m y'' + (s1 + Fv) y' + s0 y = F has a known answer to a sine."""
    omega, ends = 2 * math.pi * 5, {}
    spring = 4.5 / S0 + (4 / (S0 - MASS * omega**2 + 1j * omega * (S1 + FV))).imag
    push = np.zeros((16000, 2, 1))
    push[:, 0, 0] = 4.5 + 4 * np.sin(omega * (np.arange(16000) + 0.5) * 2.5e-4)
    for law in ("elasto_plastic", "lugre"):

        def motion(t: float, s: np.ndarray, law: str = law) -> list[float]:
            dz = rate(law, s[1], s[2], stribeck(s[1], 1))
            return [s[1], (4.5 + 4 * math.sin(omega * t) - S0 * s[2] - S1 * dz - FV * s[1]) / MASS, dz]

        ends[law] = solve_ivp(motion, (0, 4.0), [0.0] * 3, method="DOP853", rtol=1e-8, atol=1e-11).y[0, -1]
        plant = Plant(Parameters().replace({**FREE, "friction.law": law}))
        plant.state[list(PRESSURES)] = Parameters().air.atmospheric_pressure
        plant.advance(np.zeros((4, 1)), push, 4.0)
        assert plant.state[Y2, 0] == pytest.approx(ends[law], rel=1e-3, abs=1e-8)
    assert ends["elasto_plastic"] == pytest.approx(spring, abs=1e-9)
    assert ends["lugre"] > 10 * spring


@pytest.mark.parametrize("ratio", [0.05, 0.7, 0.9])
def test_bristle_settles_at_every_speed_with_the_plants_steps(ratio: float) -> None:
    """Pistons too heavy to be braked, bristles leaning the wrong way: 6 ms later they lean the right way, at G(v)/s0."""
    speeds = np.array([1.0, 1.5, 2.0, 3.0, 5.0, 8.0])
    law = {"friction.law": "elasto_plastic", "friction.breakaway_ratio": ratio}
    plant = Plant(Parameters().replace({**FREE, **law, "mechanics.mass": 1e6}), 6)
    plant.state[V1], plant.state[V2] = -speeds, speeds
    plant.state[[Z1, Z2]] = np.array([[FS[0]], [-FS[1]]]) / S0
    plant.advance(np.zeros((4, 6)), np.zeros((2, 6)), 0.006)
    pressed = gauges(plant)
    assert pressed.min() > 5e5
    for k, (row, v) in enumerate(((Z1, plant.state[V1]), (Z2, plant.state[V2]))):
        expected = [math.copysign(stribeck(s, k, gauge), s) / S0 for s, gauge in zip(v, pressed[k], strict=True)]
        np.testing.assert_allclose(plant.state[row], expected, rtol=1e-3)
