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
from birthsim_env.physics.compiled.lanes import PRESSURES, V1, V2, Y1, Y2, Z1, Z2, Array
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import linkage_by_points as by_points

FC, FS, VS, FV = (12.0, 15.0), (12.0 * 1.33, 15.0 * 1.33), 0.015, 35.0
S0, S1 = 5e4, 150.0
"""Assumed: levels of cylinders 1 and 2, Stribeck speed, viscous friction, bristle stiffness and damping."""

NO_FRICTION = {
    **{f"cylinder{k}.{name}_friction": 0.0 for k in (1, 2) for name in ("coulomb", "viscous")},
    "friction.law": "coulomb",
}


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


@pytest.mark.parametrize("law", ["lugre", "elasto_plastic"])
def test_steady_sliding_is_on_the_stribeck_curve(law: str) -> None:
    """Including speeds above the rate limit of the bristle, which must not change the steady force."""
    speeds = np.concatenate([-np.geomspace(1e-3, 6, 25), np.geomspace(1e-3, 6, 25)])
    plant, z = PlantFriction(50, {"friction.law": law}), np.zeros((2, 50))
    v = np.stack([speeds, speeds])
    step = 0.05 / np.maximum(S0 * np.abs(v) / FS[0], 1.0)
    for _ in range(1500):
        z = z + step * plant(v, z)[1]
    expected = np.array([[math.copysign(stribeck(s, k), s) + FV * s for s in speeds] for k in (0, 1)])
    force, rate = plant(v, z)
    np.testing.assert_allclose(force, expected, rtol=0, atol=1e-6)
    assert np.abs(rate).max() < 1e-9
    for k in (0, 1):
        assert max(expected[k, speeds > 0]) > expected[k, speeds > 0][13], "the curve dips: fast enough, friction falls"
        ends = [friction.steady_deflection(s, stribeck(s, k), S0) for s in speeds]
        np.testing.assert_allclose(z[k], ends, rtol=1e-9)
    assert friction.steady_deflection(0.0, FS[0], S0) == 0


@given(v=st.floats(-10, 10), z=st.floats(-4e-4, 4e-4), level=st.floats(0.01, 40))
def test_rate_is_textbook_below_the_limit_and_limited_above(v: float, z: float, level: float) -> None:
    rate = friction.bristle_rate(v, z, level, S0)
    if S0 * abs(v) <= 8000 * level:
        assert rate == pytest.approx(v - S0 * abs(v) * z / level, rel=1e-12, abs=1e-12)
    else:
        toward = math.copysign(level / S0, v) - z
        assert rate == pytest.approx(8000 * toward, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("law", ["lugre", "elasto_plastic"])
def test_presliding_stiffness_is_s0(law: str) -> None:
    """A tenth of a micrometre at 1 um/s: the first stretch of the spring, without noticeable damping."""
    plant, speed, z = PlantFriction(1, {"friction.law": law}), np.full((2, 1), 1e-6), np.zeros((2, 1))
    for _ in range(100):
        z = z + 1e-3 * plant(speed, z)[1]
    force, _ = plant(speed, z)
    damping = (S1 + FV) * 1e-6
    np.testing.assert_allclose((force - damping) / 1e-7, S0, rtol=1e-3)


def test_a_push_below_the_breakaway_force_gives_and_springs_back() -> None:
    """5 N put slowly on the stuck cylinder 2 and taken off again: dy = dz/(1 - s0 z/Fs), then back along dz/(1 + s0 z/Fs)."""
    plant = Plant(Parameters().replace({"mechanics.gravity": 0.0, "valves.leakage_ratio": 0.0}))
    push = np.zeros((200, 2, 1))
    push[:, 0, 0] = np.linspace(0, 5, 200)
    moved = []
    for ramp in (push, push[::-1]):
        plant.advance(np.zeros((4, 1)), ramp, 2.0)
        moved.append(plant.state[Y2, 0])
    breakaway, air = FS[1], 2500.0  # 2300 N/m at k = 1.2, up to 2700 N/m adiabatic
    carried, left = 5 - air * moved[0], -air * moved[1]
    forward = -breakaway / S0 * math.log(1 - carried / breakaway)
    backward = breakaway / S0 * math.log((1 + carried / breakaway) / (1 + left / breakaway))
    assert moved[0] == pytest.approx(forward, rel=0.02)
    assert moved[1] == pytest.approx(forward - backward, rel=0.1)
    plant.advance(np.zeros((4, 1)), [[30.0], [0.0]], 0.2)
    assert plant.state[Y2, 0] > 1e-3, "30 N break it away"


@pytest.mark.parametrize("law", ["lugre", "elasto_plastic"])
def test_bristle_stays_bounded_by_the_breakaway_deflection(law: str) -> None:
    lanes, rng = 200, np.random.default_rng(7)
    plant, largest = Plant(Parameters().replace({"friction.law": law}), lanes), 0.0
    for _ in range(100):
        plant.advance(rng.uniform(-1, 1, (4, lanes)), rng.uniform(-150, 150, (5, 2, lanes)), 0.01)
        largest = np.maximum(largest, np.abs(plant.state[[Z1, Z2]]).max(axis=1))
    assert np.all(largest <= np.array(FS) / S0 * (1 + 1e-9)), largest
    assert np.all(largest > np.array(FC) / S0), "some lane must have come near the bound"


@pytest.mark.parametrize("speed", [0.5, 0.02, -0.02, -0.5])
def test_coulomb_law_decelerates_by_fc_and_fv_v(speed: float) -> None:
    plant = PlantFriction(1, {"friction.law": "coulomb"})
    force, rate = plant(np.full((2, 1), speed), np.full((2, 1), 1e-4))
    np.testing.assert_allclose(force[:, 0], [math.copysign(fc, speed) + FV * speed for fc in FC], rtol=1e-10)
    assert np.all(rate == 0), "no bristle in (4)"


def test_coulomb_law_is_a_line_through_rest() -> None:
    plant = PlantFriction(3, {"friction.law": "coulomb", "friction.sign_speed": 0.004})
    force, _ = plant(np.array([[-0.001, 0.0, 0.002]] * 2), np.zeros((2, 3)))
    np.testing.assert_allclose(force, [[-fc / 4 - 0.035, 0.0, fc / 2 + 0.07] for fc in FC], rtol=0, atol=1e-10)


def test_piston_coasts_as_long_as_coulomb_and_viscous_friction_let_it() -> None:
    """m dv/dt = -Fc - Fv v stops v0 after (m/Fv) ln(1 + Fv v0/Fc); the chambers are kept open to the atmosphere."""
    wide_open = {"mechanics.gravity": 0.0, "chambers.dead_volume": 10.0}
    rig = Parameters().replace({"friction.law": "coulomb", "friction.sign_speed": 0.001, **wide_open})
    plant = Plant(rig)
    plant.state[list(PRESSURES)] = rig.air.atmospheric_pressure
    plant.state[V2] = 0.4
    stop = 3.0 / FV * math.log(1 + FV * 0.4 / FC[1])
    plant.advance(np.zeros((4, 1)), np.zeros((2, 1)), 0.98 * stop)
    assert plant.state[V2, 0] > 0.002
    plant.advance(np.zeros((4, 1)), np.zeros((2, 1)), 0.04 * stop)
    assert abs(plant.state[V2, 0]) < 0.001


@pytest.mark.parametrize("law", ["lugre", "coulomb", "elasto_plastic"])
def test_no_friction_when_switched_off(law: str) -> None:
    plant = PlantFriction(3, {**NO_FRICTION, "friction.law": law})
    force, _ = plant(np.array([[-0.7, 0.0, 2.5]] * 2), np.zeros((2, 3)))
    assert np.abs(force).max() <= (0.0 if law == "coulomb" else 1e-7)


def test_frictionless_rig_keeps_its_energy() -> None:
    """Swinging on cylinder 1 with huge chambers at atmospheric pressure: kinetic plus potential energy stay, LuGre selected."""
    changes = {"friction.law": "lugre", "chambers.dead_volume": 100.0, "valves.leakage_ratio": 0.0}
    rig = Parameters().replace({**NO_FRICTION, **changes})
    plant = Plant(rig)
    plant.state[list(PRESSURES)] = rig.air.atmospheric_pressure
    plant.state[Y1] = 0.05
    plant.state[V1], plant.state[V2] = -0.5, 0.3

    def energy() -> float:
        _, y, vx, vy = plant.end_effector()[:, 0]
        return 1.5 * (vx**2 + vy**2) + 3 * 9.81 * y

    start = energy()
    plant.advance(np.zeros((4, 1)), np.zeros((2, 1)), 0.15)
    assert abs(plant.state[Y1, 0]) < 0.1
    assert energy() == pytest.approx(start, abs=1e-5)


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
