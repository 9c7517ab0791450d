"""The elasto-plastic friction law (Dupont et al. 2002) against its equations written afresh here, case by case.

Below break-away it is a spring: nothing drifts, where LuGre does. A single piston is the plant's cylinder 2 without weight, its
chambers so large that they act like the open air.
"""

import math
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from birthsim_env.physics import friction
from birthsim_env.physics.compiled.lanes import ELASTO_PLASTIC, PRESSURES, V1, V2, Y2, Z1, Z2, Array
from birthsim_env.physics.equilibrium import balanced_state
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


def slow_push(portion: float, ratio: float = RATIO) -> tuple[float, float]:
    """Way of the piston under ``portion`` of Fs, reached slowly, m: spring, and integral of alpha q/(1 - alpha q) dz."""
    full = FS[1] / S0

    def creep(z: float) -> float:
        q = fraction(z, 1.0, full, ratio) * z / full
        return q / (1 - q)

    return portion * full, quad(creep, min(ratio, portion) * full, portion * full)[0]


@pytest.mark.parametrize("portion", [0.5, 0.69, 0.8, 0.9])
def test_what_a_slow_push_leaves_behind(portion: float) -> None:
    """Up to the break-away deflection nothing, beyond it the plastic part."""
    plant, ramp = one_piston("elasto_plastic"), np.linspace(0, portion * FS[1], 4000)
    spring, plastic = slow_push(portion)
    assert pushed(plant, ramp, 20.0) == pytest.approx(spring + plastic, rel=2e-3)
    assert pushed(plant, np.append(ramp[::-1], np.zeros(100)), 20.5) == pytest.approx(plastic, rel=1e-2, abs=1e-9)


@pytest.mark.parametrize("ratio", [0.1, 0.7, 0.9])
def test_it_breaks_away_at_the_static_level(ratio: float) -> None:
    """0.5 N/s: still held 5 % below Fs, gone by millimetres 3 % above."""
    plant, level = one_piston("elasto_plastic", breakaway_ratio=ratio), FS[1]
    below = pushed(plant, np.linspace(0, 0.95 * level, 8000), 0.95 * level / 0.5)
    assert below == pytest.approx(sum(slow_push(0.95, ratio)), rel=0.01)
    assert pushed(plant, np.linspace(0.95 * level, 1.03 * level, 800), 0.08 * level / 0.5) > 5e-3


def test_held_by_friction_nothing_creeps_for_ten_seconds() -> None:
    """The whole rig, valves shut, 3 N on both axes, constant or with 4 N of dither at 10 Hz on x.

    For the first 5 s the chambers, compressed by the push, still cool down.
    """
    laws = ("elasto_plastic", "elasto_plastic", "lugre", "lugre")
    plant = Plant([Parameters().replace({"friction.law": law, "valves.leakage_ratio": 0.0}) for law in laws], 4)
    push, seen = np.full((5000, 2, 4), 3.0), [plant.end_effector()[:2]]
    push[:, 0, 1::2] += 4 * np.sin(2 * math.pi * 10 * np.arange(5000) / 1000)[:, None]
    for _ in range(3):
        plant.advance(np.zeros((4, 4)), push, 5.0)
        seen.append(plant.end_effector()[:2])
    moved, crept = np.linalg.norm(seen[1] - seen[0], axis=0), np.linalg.norm(seen[3] - seen[1], axis=0)
    assert np.all((moved[:2] > 5e-5) & (moved[:2] < 5e-4)), moved
    assert np.all(crept[:2] < 1e-9), crept
    assert crept[2] < 1e-8, "constant, the push moves LuGre no further either"
    assert crept[3] > 5e-4, crept


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


def test_balance_while_moving_is_steady_sliding() -> None:
    plant = Plant(Parameters().replace(LAW), 3)
    speed = np.array([[0.12, -0.01, 0.0], [-0.2, 0.5, 0.0]])
    state = balanced_state(plant.lane_parameters, np.zeros((2, 3)), speed)
    expected = [[math.copysign(stribeck(v, k), v) / S0 if v else 0.0 for v in speed[k]] for k in (0, 1)]
    np.testing.assert_allclose(state[[Z1, Z2]], expected, rtol=1e-12)
    like_lugre = balanced_state(Plant(num_envs=3).lane_parameters, np.zeros((2, 3)), speed)
    np.testing.assert_array_equal(state, like_lugre, "sliding steadily, the laws are one, and so are the pressures")
    rates = plant.derivatives(state, np.zeros((4, 3)), np.zeros((2, 3)))
    assert np.abs(rates[[Z1, Z2]]).max() < 1e-12


def test_an_environment_takes_it_from_parameters_and_from_a_file(tmp_path: Path) -> None:
    rig, path = Parameters().replace({**LAW, "friction.breakaway_ratio": 0.6}), tmp_path / "rig.toml"
    path.write_text("[friction]\nlaw = 'elasto_plastic'\nbreakaway_ratio = 0.6\n")
    observations = []
    for parameters in (rig, str(path), None):
        env = gymnasium.make("BirthSIM/Probe-v2", parameters=parameters)
        env.reset(seed=3)
        for _ in range(30):
            observation, *_ = env.step(np.array([0.3, -0.3, 0.3, -0.3], dtype=np.float32))
        observations.append(observation)
        assert env.unwrapped.simulation.plant.lane_parameters[ELASTO_PLASTIC, 0] == (parameters is not None)
    np.testing.assert_array_equal(observations[0], observations[1])
    assert np.any(observations[0] != observations[2])
