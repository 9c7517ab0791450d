"""The elasto-plastic friction law (Dupont et al. 2002) against its equations written afresh here, case by case.

Below break-away it is a spring: nothing drifts, where LuGre does. A single piston is the plant's cylinder 2 without weight, its
chambers so large that they act like the open air.
"""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from birthsim_env.physics import friction
from birthsim_env.physics.compiled.lanes import PRESSURES, V1, V2, Y2, Z1, Z2, Array
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from tests.physics.test_friction import FS, FV, INSTANTS, MOTIONS, S0, S1, PlantFriction, along, follows, stribeck

LAW = {"friction.law": "elasto_plastic"}
MASS, RATIO = 3.0, 0.7
FREE = {"mechanics.gravity": 0.0, "chambers.dead_volume": 10.0, "valves.leakage_ratio": 0.0}
"""No weight, and chambers of 10 m3."""


def fraction(z: float, v: float, steady: float, ratio: float = RATIO, sine: bool = False) -> float:
    """alpha(z, v): the paper's cases, with its sine or with the cubic that stands for it in the plant."""
    if z * v <= 0 or abs(z) <= ratio * steady:
        return 0.0
    if abs(z) >= steady:
        return 1.0
    s = (abs(z) - ratio * steady) / (steady * (1 - ratio))
    return 0.5 * math.sin(math.pi * (s - 0.5)) + 0.5 if sine else 3 * s**2 - 2 * s**3


def rate(v: float, z: float, level: float, ratio: float = RATIO, sine: bool = False) -> float:
    """dz/dt = v (1 - alpha s0 z sgn(v) / G)."""
    return v * (1 - fraction(z, v, level / S0, ratio, sine) * S0 * z * math.copysign(1, v) / level)


@given(v=st.floats(-10, 10), z=st.floats(-6e-4, 6e-4), level=st.floats(0.5, 40), ratio=st.floats(0.01, 0.9))
def test_rate_is_the_papers_below_the_limit_and_held_above(v: float, z: float, level: float, ratio: float) -> None:
    got = friction.bristle_rate_by_law(v, z, 1 / level, S0, False, ratio, 1 / (1 - ratio))
    held = min(1.0, 5000 * level / (S0 * abs(v))) if v != 0 else 1.0
    assert got == pytest.approx(rate(v, z, level, ratio) * held, rel=1e-9, abs=1e-9)


@given(s=st.floats(-1, 2))
def test_cubic_is_within_a_hundredth_of_the_papers_sine(s: float) -> None:
    sine = 0.5 * math.sin(math.pi * (min(1.0, max(0.0, s)) - 0.5)) + 0.5
    assert friction.sliding_fraction(RATIO + s * (1 - RATIO), RATIO, 1 / (1 - RATIO)) == pytest.approx(sine, abs=0.0101)


def cubic_rate(v: float, z: float, cylinder: int) -> float:
    return rate(v, z, stribeck(v, cylinder))


def sine_rate(v: float, z: float, cylinder: int) -> float:
    return rate(v, z, stribeck(v, cylinder), sine=True)


@pytest.mark.parametrize(("amplitude", "frequency"), MOTIONS)
def test_force_follows_the_equations_along_a_motion(amplitude: float, frequency: float) -> None:
    """Through reversals, sliding and presliding; with the paper's sine the force differs by under 1 %."""
    deflection = follows(PlantFriction(INSTANTS, LAW), cubic_rate, amplitude, frequency)
    sine = along(sine_rate, amplitude, frequency)[1]
    assert S0 * np.abs(sine - deflection).max() < 0.01 * FS[1]


def one_piston(law: str, **changes: float) -> Plant:
    """Cylinder 2 alone at rest, pressures atmospheric."""
    rig = Parameters().replace({**FREE, "friction.law": law, **{f"friction.{name}": value for name, value in changes.items()}})
    plant = Plant(rig)
    plant.state[list(PRESSURES)] = rig.air.atmospheric_pressure
    return plant


def pushed(plant: Plant, push: Array, seconds: float) -> float:
    """Position of piston 2 after the pushes (K,) along x, each held for its fraction of ``seconds``, m."""
    plant.advance(np.zeros((4, 1)), np.stack([push, np.zeros_like(push)], axis=1)[:, :, None], seconds)
    return float(plant.state[Y2, 0])


def mass_by_scipy(law: str, push, seconds: float) -> float:
    """Position after ``seconds`` of m dv/dt = push(t) - Ff from rest, by SciPy on the equations above, m."""

    def motion(t: float, s: Array) -> list[float]:
        _, v, z = s
        level = stribeck(v, 1)
        dz = rate(v, z, level) if law == "elasto_plastic" else v - S0 * abs(v) * z / level
        return [v, (push(t) - S0 * z - S1 * dz - FV * v) / MASS, dz]

    solution = solve_ivp(motion, (0, seconds), [0.0] * 3, method="DOP853", rtol=1e-8, atol=1e-11)
    return float(solution.y[0, -1])


def test_presliding_is_a_spring_without_drift_where_lugre_drifts() -> None:
    """6 N with 5 N swinging at 5 Hz on it, below the 14 N of break-away, for 4 s, by SciPy and by the plant.

    The spring is linear: m y'' + (s1 + Fv) y' + s0 y = F, whose steady answer to a sine of whole periods is known.
    """

    def push(t: float) -> float:
        return 6 + 5 * math.sin(2 * math.pi * 5 * t)

    omega = 2 * math.pi * 5
    spring = 6 / S0 + (5 / (S0 - MASS * omega**2 + 1j * omega * (S1 + FV))).imag
    samples = np.array([push((k + 0.5) * 2.5e-4) for k in range(16000)])
    ends = {}
    for law in ("elasto_plastic", "lugre"):
        ends[law] = mass_by_scipy(law, push, 4.0)
        assert pushed(one_piston(law), samples, 4.0) == pytest.approx(ends[law], rel=1e-3, abs=1e-8)
    assert ends["elasto_plastic"] == pytest.approx(spring, abs=1e-9)
    assert ends["lugre"] > 10 * spring


@pytest.mark.parametrize("ratio", [0.05, 0.7, 0.9])
def test_bristle_settles_at_every_speed_with_the_plants_steps(ratio: float) -> None:
    """Pistons too heavy to be braked, bristles leaning the wrong way: 6 ms later they lean the right way, at G(v)/s0."""
    speeds = np.array([1.0, 1.5, 2.0, 3.0, 5.0, 8.0])
    plant = Plant(Parameters().replace({**FREE, **LAW, "mechanics.mass": 1e6, "friction.breakaway_ratio": ratio}), 6)
    plant.state[V1], plant.state[V2] = -speeds, speeds
    plant.state[[Z1, Z2]] = np.array([[FS[0]], [-FS[1]]]) / S0
    plant.advance(np.zeros((4, 6)), np.zeros((2, 6)), 0.006)
    for k, (row, v) in enumerate(((Z1, plant.state[V1]), (Z2, plant.state[V2]))):
        np.testing.assert_allclose(plant.state[row], [math.copysign(stribeck(s, k), s) / S0 for s in v], rtol=1e-3)
