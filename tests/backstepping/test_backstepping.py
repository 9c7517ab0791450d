"""The backstepping law: its openings against ``derived_law``, and Lyapunov's proof on the paper's model."""

import math
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from baselines import BacksteppingController
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.physics import mechanics
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import closed_loop
from tests.oracles import derived_law as derived
from tests.oracles import linkage_by_points as by_points
from tests.oracles.gain_range import closed_loop_damping, closed_loop_stiffness


def random_situations(
    rig: Parameters, width: float, compensate: bool, lanes: int, rng: np.random.Generator, ratio: float | None = None
) -> dict[str, Array]:
    """States near random references: F within some N of F*, K inside the range of the pressures, the valves not all shut."""
    half = np.array([[rig.cylinder1.stroke / 2], [rig.cylinder2.stroke / 2]])
    s: dict[str, Array] = {}
    s["piston"] = 0.8 * half * rng.uniform(-1, 1, (2, lanes))
    s["speed"] = rng.choice([0.0, 0.003, 0.3], (2, lanes)) * rng.normal(0, 1, (2, lanes))
    noise = np.repeat([0.001, 0.01, 0.5, 20.0], 2)[:, None]
    s["wanted"] = np.concatenate([s["piston"], s["speed"], np.zeros((4, lanes))]) + noise * rng.normal(0, 1, (8, lanes))
    s["stiffness"] = rng.uniform(800, 4500, (2, lanes))
    s["believed"] = rng.normal(0, 20, (2, lanes))
    s["gains"] = derived.gains_for(s["piston"], s["stiffness"], rig, ratio)
    s["pneumatic"] = rng.uniform([[2500], [1300]], [[5000], [2600]], (2, lanes))
    s["pneumatic_wanted"] = s["pneumatic"] + rng.normal(0, 50, (2, lanes))
    s["pneumatic_rate"] = rng.normal(0, 500, (2, lanes))
    values = derived.rig_values(rig, width, compensate)
    errors, _ = derived.errors_and_rates()
    without_air = [*s["piston"], *s["speed"], 0.0, 0.0, *s["wanted"], *s["gains"], *s["believed"], *values]
    star = -np.array([errors(*without_air)[i][2] for i in (0, 1)])
    s["force"] = star + rng.normal(0, 3, (2, lanes))
    pressures = [
        derived.pressures_for(s["force"][i], s["pneumatic"][i], s["piston"][i], cylinder, rig)
        for i, cylinder in enumerate((rig.cylinder1, rig.cylinder2))
    ]
    s["pressures"] = np.concatenate(pressures)
    s["feedforward_rate"] = rng.normal(0, 100, (2, lanes))
    possible = np.all((s["pressures"] > 1.1e5) & (s["pressures"] < 6.9e5), axis=0)
    return {name: value[:, possible] for name, value in s.items()}


def as_signals(s: dict[str, Array], rig: Parameters) -> tuple[Measurement, Reference]:
    """A random situation as the controller meets it."""
    reference = derived.cartesian(s["wanted"], rig)
    reference.rows[8:14] = np.concatenate([s["stiffness"], s["pneumatic_wanted"], s["pneumatic_rate"]])
    return derived.seen(s["piston"], s["speed"], s["pressures"], rig), reference


def many(lanes: int) -> tuple[Measurement, Reference, tuple[Array, Array, Array]]:
    """More situations than one block of lanes holds, and what the law is told in them: forces, their rates, damping factors."""
    situation = random_situations(Parameters(), 0.01, True, 200, np.random.default_rng(3))
    measured, reference = as_signals(situation, Parameters())
    assert measured.time.size >= lanes
    told = situation["believed"][:, :lanes], situation["feedforward_rate"][:, :lanes], np.linspace(0.5, 2.0, lanes)
    some = slice(lanes)
    return closed_loop.of_lanes(measured, some), Reference(np.ascontiguousarray(reference.rows[:, some])), told


TILTED = Parameters().replace(
    {
        "geometry.gamma3": 1.2, "geometry.d3": 0.42, "geometry.d6": 0.21, "geometry.k1": 0.45, "mechanics.mass": 4.2,
        "cylinder1.viscous_friction": 55.0, "cylinder2.coulomb_friction": 22.0, "cylinder2.rod_diameter": 0.012,
        "air.temperature": 300.0, "air.polytropic_index": 1.3, "valves.critical_ratio": 0.4,
    }
)  # fmt: skip


def test_model_13_is_5_without_14() -> None:
    """f2~ is what Newton's law in polar coordinates has beyond a force along the beam, and what (13) leaves out of (5)."""
    turning = derived.THETA1.diff(derived.Y1) * derived.V1
    assert sp.simplify(derived.neglected() - (derived.R2 * turning**2 + derived.GRAVITY * sp.cos(derived.THETA1))) == 0
    _, full2 = derived.equation_5(derived.F1, derived.F2)
    _, _, f2, g2 = derived.model_13()
    assert (
        sp.simplify(full2 - (f2 + g2 * derived.F2).subs({derived.COMPENSATE: 0, derived.BELIEVED[1]: 0}) - derived.neglected())
        == 0
    )
    # And the plant's (5) is the paper's.
    load1, load2, cosine, sine = sp.symbols("load1 load2 cosine sine")
    full1, full2 = (
        a.subs({derived.FEXT1: 0, derived.FEXT2: 0, derived.FC1: 0, derived.FC2: 0, derived.FV1: 0, derived.FV2: 0})
        for a in derived.equation_5(load1, load2)
    )
    angle = {sp.cos(derived.THETA1): cosine, sp.sin(derived.THETA1): sine}
    ours1 = mechanics.acceleration1.py_func(
        load1,
        derived.V1,
        derived.V2,
        derived.R2,
        derived.R4,
        derived.W,
        derived.ROOT**2,
        2 * derived.R2 * derived.R4 / derived.ROOT,
        sine,
        1 / derived.MASS,
        derived.GRAVITY,
    )
    ours2 = mechanics.acceleration2.py_func(
        load2, derived.V1, derived.R2, derived.R4, derived.ROOT**2, cosine, 1 / derived.MASS, derived.GRAVITY
    )
    assert sp.simplify(ours1 - full1.subs(angle)) == 0
    assert sp.simplify(ours2 - full2.subs(angle)) == 0


OPTIONS: dict[str, dict[str, Any]] = {
    "paper": {},
    "compensated": {"weight_compensation": True},
    "damped": {"weight_compensation": True, "damping_ratio": 1.3},
    "frozen": {"weight_compensation": True, "frozen_friction": True},
}


@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS.keys())
@pytest.mark.parametrize(
    ("rig", "gain", "width"), [(Parameters(), 30.0, 0.01), (TILTED, 47.0, 0.004)], ids=["default", "tilted"]
)
def test_openings_are_those_of_the_derived_law(rig: Parameters, gain: float, width: float, options: dict[str, Any]) -> None:
    compensate, frozen = options.get("weight_compensation", False), options.get("frozen_friction", False)
    s = random_situations(rig, width, compensate, 800, np.random.default_rng(7), options.get("damping_ratio"))
    controller = BacksteppingController(rig, pneumatic_gain=gain, sign_width=width, **options)
    got = controller.command(*as_signals(s, rig), s["believed"], s["feedforward_rate"])
    _, wanted_rates = derived.errors_and_rates()
    values = derived.rig_values(rig, width, compensate, frozen)
    force_rate = np.array(
        wanted_rates(
            *s["piston"], *s["speed"], *s["force"], *s["wanted"], *s["gains"], *s["believed"], *values, *s["feedforward_rate"]
        )
    )
    stiffness_rate = s["pneumatic_rate"] - gain * (s["pneumatic"] - s["pneumatic_wanted"])
    expected = np.empty_like(got)
    for lane in range(got.shape[1]):
        for i, cylinder in enumerate((rig.cylinder1, rig.cylinder2)):
            air, rates = s["pressures"][2 * i : 2 * i + 2, lane], np.array([force_rate[i, lane], stiffness_rate[i, lane]])
            flows = derived.flows_for(rates, air, s["piston"][i, lane], s["speed"][i, lane], cylinder, rig)
            expected[2 * i : 2 * i + 2, lane] = [derived.opening_for(q, p, rig) for q, p in zip(flows, air, strict=True)]
    unsaturated = np.all(np.abs(expected) < 1, axis=0)
    assert unsaturated.sum() >= 60
    assert (~unsaturated).any(), "saturated valves must have been met too"
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-8)
    terms = controller.inspect(*as_signals(s, rig), s["believed"], s["feedforward_rate"])
    np.testing.assert_allclose(terms.gains.swapaxes(0, 1).reshape(6, -1), s["gains"], rtol=1e-8)
    np.testing.assert_allclose(terms.force_rate, force_rate, rtol=1e-7, atol=1e-4)
    np.testing.assert_allclose(terms.wanted, s["wanted"], rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("compensate", [False, True], ids=["paper", "compensated"])
def test_the_force_rate_is_the_slope_of_the_wanted_force_along_a_changing_belief(compensate: bool) -> None:
    """dF/dt = dF*/dt - z2/g - c3 z3 with dF*/dt from F* a little later and sooner: pistons go as the model believes, with b.

    Without viscous friction and with one stiffness on both axes the gains do not follow the pose.
    """
    still = {"cylinder1.viscous_friction": 0.0, "cylinder2.viscous_friction": 0.0}
    rig, step = Parameters().replace(still), 1e-6
    s = random_situations(rig, 0.01, compensate, 300, np.random.default_rng(11))
    s["stiffness"] = np.repeat(s["stiffness"][:1], 2, axis=0)
    law = BacksteppingController(rig, compensate, sign_width=0.01)
    # What is believed acts like the air: (13) with F + b.
    moved = derived.accelerations(rig, 0.01, compensate)(*s["piston"], *s["speed"], *(s["force"] + s["believed"]))

    def at(time: float, told: tuple[Array, ...]) -> Any:
        then = {**s, "piston": s["piston"] + time * s["speed"] + time**2 / 2 * np.array(moved)}
        then["speed"] = s["speed"] + time * np.array(moved)
        then["wanted"] = sum(
            time**k / math.factorial(k) * np.concatenate([s["wanted"][2 * k :], np.zeros((2 * k, s["wanted"].shape[1]))])
            for k in range(4)
        )
        return law.inspect(*as_signals(then, rig), *told)

    rate = 30 * s["feedforward_rate"]
    later, sooner = (at(time, (s["believed"] + time * rate,)).wanted_force for time in (step, -step))
    now = at(0.0, (s["believed"], rate))
    gains = now.gains.swapaxes(0, 1).reshape(6, -1)
    errors = derived.errors_and_rates()[0](
        *s["piston"], *s["speed"], *s["force"], *s["wanted"], *gains, *s["believed"], *derived.rig_values(rig, 0.01, compensate)
    )
    for i, (_, z2, z3, g) in enumerate(errors):
        slope = now.force_rate[i] + z2 / g + gains[3 * i + 2] * z3
        np.testing.assert_allclose(slope, (later - sooner)[i] / (2 * step), rtol=1e-5, atol=0.02)
    # Untold of the rate the law's force lags by it: 3000 N/s are no trifle.
    np.testing.assert_allclose(at(0.0, (s["believed"],)).force_rate - now.force_rate, rate, rtol=1e-9, atol=1e-6)
    assert np.abs(rate).max() > 3000


@pytest.mark.parametrize("rig", [Parameters(), TILTED], ids=["default", "tilted"])
@pytest.mark.parametrize("factor", [1.02, 1.2, 1.5, 2.0])
def test_a_damping_factor_multiplies_the_damping_of_equal_gains_and_leaves_the_stiffness(
    rig: Parameters, factor: float
) -> None:
    lanes, rng = 200, np.random.default_rng(4)
    s = random_situations(rig, 0.01, False, lanes, rng)
    s["stiffness"] = rng.uniform(500, 6000, s["stiffness"].shape)
    law, signals = BacksteppingController(rig), as_signals(s, rig)
    equal, damped = law.inspect(*signals).gains, law.inspect(*signals, None, None, np.full(s["piston"].shape[1], factor)).gains
    r4, r2 = s["piston"][0] + rig.geometry.k1, s["piston"][1] + rig.geometry.k2
    pose = by_points.pose_from_lengths(r4, r2, rig.geometry)
    assert damped.min() > 0
    for i, cylinder in enumerate((rig.cylinder1, rig.cylinder2)):
        column, _ = by_points.cartesian_velocity(pose, r2, 1.0 - i, float(i))
        masses, asked = rig.mechanics.mass * (column**2).sum(axis=0), (s["stiffness"] * column**2).sum(axis=0)
        for lane, mass in enumerate(masses):
            rendered = mass, cylinder.viscous_friction
            for gains in (equal, damped):
                assert closed_loop_stiffness(*gains[:, i, lane], *rendered) == pytest.approx(asked[lane], rel=1e-8)
            least = closed_loop_damping(*equal[:, i, lane], *rendered)
            assert closed_loop_damping(*damped[:, i, lane], *rendered) == pytest.approx(factor * least, rel=1e-8)
            np.testing.assert_allclose(
                damped[:, i, lane], derived.damped_gains(asked[lane], factor * least, *rendered), rtol=1e-6
            )


def test_a_damping_factor_up_to_its_least_is_bit_for_bit_the_law() -> None:
    measured, reference, (believed, rate, _) = many(60)
    for options in OPTIONS.values():
        law, factor = BacksteppingController(**options), np.tile([0.0, 0.5, 1.0, 1.01], 15)
        plain, told = law.command(measured, reference, believed, rate), law.command(measured, reference, believed, rate, factor)
        assert np.array_equal(told, plain)
        raised = law.command(measured, reference, believed, rate, np.full(60, 1.5))
        # A law with a damping ratio has its damping already.
        assert np.array_equal(raised, plain) == ("damping_ratio" in options)
        assert np.array_equal(
            law.inspect(measured, reference, None, None, factor).gains, law.inspect(measured, reference).gains
        )


def moving_target(time: float, rig: Parameters) -> tuple[Array, Reference]:
    """Sinusoids of both joints, (8, 1), and the reference that asks for them with 2000 N/m on both axes."""
    angles = np.array([3.0, 2.5]) * time + np.array([0.4, 1.0])
    shifted = [np.array([0.04, 0.06]) * np.array([3.0, 2.5]) ** k * np.sin(angles + k * np.pi / 2) for k in range(4)]
    wanted = np.concatenate(shifted)[:, None]
    reference = derived.cartesian(wanted, rig)
    reference.rows[8:10], reference.rows[10:12] = 2000.0, closed_loop.PNEUMATIC_STIFFNESS
    return wanted, reference


def errors_of(time: float, x: Array, rig: Parameters, compensate: bool) -> tuple[Array, Array, Array]:
    """z1, z2, g z3 (3, 2) of both cylinders, their gains and their g, for a state of the control model."""
    wanted, reference = moving_target(time, rig)
    gains = derived.gains_for(x[:2, None], reference.stiffness, rig)[:, 0]
    found = derived.errors_and_rates()[0](
        *x[:4], *derived.forces(x[4:], rig), *wanted[:, 0], *gains, 0.0, 0.0, *derived.rig_values(rig, 0.01, compensate)
    )
    z = np.array([[z1, z2, g * z3] for z1, z2, z3, g in found]).T
    return z, gains, np.array([g for *_, g in found])


def simulate(rig: Parameters, compensate: bool, seconds: float) -> Any:
    """The paper's control model under the law, errors at the start: SciPy's solution for y1, y2, v1, v2, Pp1, Pn1, Pp2, Pn2.

    Acceleration (13), or (5) with compensation; polytropic chambers (6); valves without lag, which carry what their
    characteristic says for the openings that the law returns.
    """
    acceleration, cylinders = derived.accelerations(rig, 0.01, compensate), (rig.cylinder1, rig.cylinder2)
    law = BacksteppingController(rig, compensate, sign_width=0.01)

    def slope(time: float, x: Array) -> Array:
        measured = derived.seen(x[:2, None], x[2:4, None], x[4:, None].copy(), rig)
        openings = law.command(measured, moving_target(time, rig)[1])[:, 0]
        assert np.all(np.abs(openings) < 1), "the proof holds while no valve is saturated"
        flows = [derived.net_flow(s, p, rig) for s, p in zip(openings, x[4:], strict=True)]
        air = [
            derived.chamber_rates(x[4 + j : 6 + j], flows[j : j + 2], x[i], x[2 + i], c, rig)
            for i, (j, c) in enumerate(zip((0, 2), cylinders, strict=True))
        ]
        return np.array([*x[2:4], *acceleration(*x[:4], *derived.forces(x[4:], rig)), *air[0], *air[1]])

    wanted, reference = moving_target(0.0, rig)
    start = np.concatenate([wanted[:2, 0] + [0.001, -0.0015], wanted[2:4, 0] + [-0.02, 0.02], np.zeros(4)])
    for i, cylinder in enumerate(cylinders):
        z, _, g = errors_of(0.0, start, rig, compensate)
        star = derived.forces(start[4:], rig)[i] - z[2, i] / g[i]
        start[4 + 2 * i : 6 + 2 * i] = derived.pressures_for(
            star + 2.0, reference.pneumatic_stiffness[i, 0], start[i], cylinder, rig
        )
    tolerance = [1e-10] * 2 + [1e-9] * 2 + [1e-3] * 4
    return solve_ivp(slope, (0, seconds), start, rtol=1e-8, atol=tolerance, dense_output=True, max_step=2e-3)


@pytest.mark.parametrize("compensate", [False, True], ids=["paper", "compensated"])
def test_errors_decay_as_lyapunovs_function_says(compensate: bool) -> None:
    """z1' = z2 - c z1, z2' = g z3 - z1 - c z2, z3' = -z2/g - c z3 make V fall as exp(-2 c t) at constant g.

    V = (z1^2 + z2^2 + (g z3)^2)/2. Cylinder 2 has a constant g. That of cylinder 1 varies with the pose (by 11 %
    here): its errors are compared with the same equations integrated at that g. Without viscous friction its gain is
    constant, as the law takes it to be.
    """
    rig, seconds = Parameters().replace({"cylinder1.viscous_friction": 0.0}), 0.16
    motion = simulate(rig, compensate, seconds)
    times = np.linspace(0, seconds, 81)
    path = [errors_of(t, motion.sol(t), rig, compensate) for t in times]
    v = np.array([(z**2).sum(axis=0) / 2 for z, _, _ in path])
    assert np.all(np.diff(v, axis=0) < 0)
    assert np.all(v[-1] < 1e-5 * v[0])
    gain = path[0][1][3]
    np.testing.assert_allclose(v[:, 1], v[0, 1] * np.exp(-2 * gain * times), rtol=1e-4)

    def error_equations(time: float, z: Array) -> list[float]:
        _, gains, g = errors_of(time, motion.sol(time), rig, compensate)
        return [z[1] - gains[0] * z[0], g[0] * z[2] - z[0] - gains[0] * z[1], -z[1] / g[0] - gains[0] * z[2]]

    z, _, g = path[0]
    alone = solve_ivp(error_equations, (0, seconds), [z[0, 0], z[1, 0], z[2, 0] / g[0]], t_eval=times, rtol=1e-8, atol=1e-14)
    followed = np.array([[*z[:2, 0], z[2, 0] / g[0]] for z, _, g in path]).T
    worst = np.abs(followed - alone.y).max(axis=1) / np.abs(alone.y).max(axis=1)
    np.testing.assert_array_less(worst, 1e-7)
