"""The backstepping law: its openings and gains against ``derived_law``, and the model that it was derived from."""

from typing import Any

import numpy as np
import pytest
import sympy as sp

from baselines import BacksteppingController
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import derived_law as derived
from tests.oracles import rigid_body
from tests.oracles.gain_range import closed_loop_damping
from tests.physics.rigs import TILTED


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
    errors, _ = derived.errors_and_rates()
    # The sum of the pressures, which presses the seals, follows from the pneumatic stiffness and hardly from the force.
    about = derived.air_for(np.zeros((2, lanes)), s["pneumatic"], s["piston"], rig)
    values = derived.rig_values(rig, width, compensate, coulomb=derived.coulomb_levels(about, s["speed"], rig))
    without_air = [*s["piston"], *s["speed"], 0.0, 0.0, *s["wanted"], *s["gains"], *s["believed"], *values]
    star = -np.array([errors(*without_air)[i][2] for i in (0, 1)])
    s["force"] = star + rng.normal(0, 3, (2, lanes))
    s["pressures"] = derived.air_for(s["force"], s["pneumatic"], s["piston"], rig)
    s["feedforward_rate"] = rng.normal(0, 100, (2, lanes))
    possible = np.all((s["pressures"] > 1.1e5) & (s["pressures"] < 6.9e5), axis=0)
    return {name: value[:, possible] for name, value in s.items()}


def as_signals(s: dict[str, Array], rig: Parameters) -> tuple[Measurement, Reference]:
    """A random situation as the controller meets it."""
    reference = derived.cartesian(s["wanted"], rig)
    reference.rows[8:14] = np.concatenate([s["stiffness"], s["pneumatic_wanted"], s["pneumatic_rate"]])
    return derived.seen(s["piston"], s["speed"], s["pressures"], rig), reference


def test_model_13_is_5_without_14() -> None:
    """f2~ is what Newton's law in polar coordinates has beyond a force along the beam, and what (13) leaves out of (5)."""
    turning = derived.THETA1.diff(derived.Y1) * derived.V1
    assert sp.simplify(derived.neglected() - (derived.R2 * turning**2 + derived.GRAVITY * sp.cos(derived.THETA1))) == 0
    _, full2 = derived.equation_5(derived.F1, derived.F2)
    _, _, f2, g2 = derived.model_13()
    model2 = (f2 + g2 * derived.F2).subs({derived.COMPENSATE: 0, derived.BELIEVED[1]: 0})
    assert sp.simplify(full2 - model2 - derived.neglected()) == 0


OPTIONS: dict[str, dict[str, Any]] = {
    "paper": {},
    "compensated": {"weight_compensation": True},
    "damped": {"weight_compensation": True, "damping_ratio": 1.3},
    "frozen": {"weight_compensation": True, "frozen_friction": True},
    "force first": {"force_first": True},
}


@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS.keys())
@pytest.mark.parametrize(
    ("rig", "gain", "width"), [(Parameters(), 30.0, 0.01), (TILTED, 47.0, 0.004)], ids=["default", "another rig"]
)
def test_openings_are_those_of_the_derived_law(rig: Parameters, gain: float, width: float, options: dict[str, Any]) -> None:
    compensate, frozen = options.get("weight_compensation", False), options.get("frozen_friction", False)
    s = random_situations(rig, width, compensate, 800, np.random.default_rng(7), options.get("damping_ratio"))
    controller = BacksteppingController(rig, pneumatic_gain=gain, sign_width=width, **options)
    got = controller.command(*as_signals(s, rig), s["believed"], s["feedforward_rate"])
    _, wanted_rates = derived.errors_and_rates()
    levels = derived.coulomb_levels(s["pressures"], s["speed"], rig)
    values = derived.rig_values(rig, width, compensate, frozen, levels)
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
    same = unsaturated if "force_first" in options else np.full_like(unsaturated, True)
    np.testing.assert_allclose(got[:, same], expected[:, same], rtol=0, atol=1e-8)
    terms = controller.inspect(*as_signals(s, rig), s["believed"], s["feedforward_rate"])
    np.testing.assert_allclose(terms.gains.swapaxes(0, 1).reshape(6, -1), s["gains"], rtol=1e-8)
    np.testing.assert_allclose(terms.force_rate, force_rate, rtol=1e-7, atol=1e-4)
    np.testing.assert_allclose(terms.wanted, s["wanted"], rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("rig", [Parameters(), TILTED], ids=["default", "another rig"])
@pytest.mark.parametrize("factor", [1.02, 1.2, 1.5, 2.0])
def test_a_damping_factor_multiplies_the_damping_of_equal_gains_and_leaves_the_stiffness(
    rig: Parameters, factor: float
) -> None:
    lanes, rng = 200, np.random.default_rng(4)
    s = random_situations(rig, 0.01, False, lanes, rng)
    s["stiffness"] = rng.uniform(500, 6000, s["stiffness"].shape)
    law, signals = BacksteppingController(rig), as_signals(s, rig)
    equal, damped = law.inspect(*signals).gains, law.inspect(*signals, None, None, np.full(s["piston"].shape[1], factor)).gains
    squares = rigid_body.jacobians(s["piston"], rig) ** 2
    masses, asked = rig.mechanics.mass * squares.sum(axis=1), np.einsum("an,nai->ni", s["stiffness"], squares)
    assert damped.min() > 0
    for i, cylinder in enumerate((rig.cylinder1, rig.cylinder2)):
        for lane, (mass, stiffness) in enumerate(zip(masses[:, i], asked[:, i], strict=True)):
            damping = factor * closed_loop_damping(*equal[:, i, lane], mass, cylinder.viscous_friction)
            expected = derived.damped_gains(stiffness, damping, mass, cylinder.viscous_friction)
            np.testing.assert_allclose(damped[:, i, lane], expected, rtol=1e-6)


def test_a_damping_factor_up_to_its_least_is_bit_for_bit_the_law() -> None:
    s = random_situations(Parameters(), 0.01, True, 40, np.random.default_rng(3))
    signals, told = as_signals(s, Parameters()), (s["believed"], s["feedforward_rate"])
    factor = np.resize([0.0, 0.5, 1.0, 1.01], s["piston"].shape[1])
    for options in OPTIONS.values():
        law = BacksteppingController(**options)
        plain = law.command(*signals, *told)
        np.testing.assert_array_equal(law.command(*signals, *told, factor), plain)
        # A law with a damping ratio has its damping already.
        assert np.array_equal(law.command(*signals, *told, np.full_like(factor, 1.5)), plain) == ("damping_ratio" in options)
        np.testing.assert_array_equal(law.inspect(*signals, None, None, factor).gains, law.inspect(*signals).gains)
