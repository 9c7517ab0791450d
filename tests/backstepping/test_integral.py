"""Integral action in the paper's law: how fast it closes an error, what is left of the stiffness, and saturated valves."""

import dataclasses

import numpy as np
import pytest

from baselines.backstepping.controller import BacksteppingController
from baselines.backstepping.integral import CompliantBackstepping, IntegralBackstepping, Integrated
from baselines.named import uses_force
from birthsim_env.physics.compiled.lanes import Array
from tests.oracles import closed_loop
from tests.oracles.closed_loop import IDEAL

RATE = 1.5
REFERENCE = closed_loop.holding(np.array([[0.5], [0.02]]), 2000.0)


def strayed(mass: float, push: Array, seconds: float, compliant: bool) -> Array:
    """Distance from the target (T, 2), m, at 1 kHz, on a rig without friction that weighs ``mass`` kg in place of 3."""
    law = (CompliantBackstepping if compliant else IntegralBackstepping)(IDEAL, integral_rate=RATE)
    plant, path = closed_loop.resting_at(REFERENCE, IDEAL.replace({"mechanics.mass": mass})), []
    for _ in closed_loop.run(plant, law.command, lambda t: REFERENCE, lambda t: push * min(1.0, 2 * t), seconds):
        path.append((plant.end_effector()[:2] - REFERENCE.position)[:, 0])
    return np.array(path)


@pytest.mark.parametrize("compliant", [False, True])
def test_an_unknown_weight_is_found_at_the_rate(compliant: bool) -> None:
    """0.4 kg are a constant force: with (B s + K) e = f - I and I' = a K e the height's error decays by the slow root."""
    declared = BacksteppingController(IDEAL, weight_compensation=True).declared_impedance(REFERENCE)
    assert declared is not None
    slow = np.roots([declared.damping[1, 1, 0] / declared.stiffness[1, 1, 0], 1.0, RATE]).max()
    path = strayed(3.4, np.zeros((2, 1)), 4.0, compliant)[:, 1]
    times = np.arange(600, 2400, 100)
    assert path[600] < -5e-4
    np.testing.assert_allclose(path[times], path[600] * np.exp(slow * 1e-3 * (times - 600)), rtol=0.06)


def test_a_push_that_is_measured_finds_the_stiffness_asked_for() -> None:
    path = strayed(3.4, np.array([[20.0], [0.0]]), 5.0, True)
    np.testing.assert_allclose(path[-1], [0.01, 0.0], atol=1e-4)


def test_a_push_that_is_not_measured_finds_none() -> None:
    path = strayed(3.0, np.array([[20.0], [0.0]]), 5.0, False)
    assert 0.003 < np.abs(path[:, 0]).max() < 0.01
    assert np.abs(path[-1]).max() < 1e-4


def test_it_rests_while_a_valve_is_full_and_leaves_what_it_was_told() -> None:
    """Half a second far from the target changes neither the integrals nor the forces that the law is given."""
    law = IntegralBackstepping(IDEAL, integral_rate=RATE)
    near = closed_loop.ideal(closed_loop.resting_at(REFERENCE, IDEAL), 0.0, np.zeros((2, 1)))
    far = dataclasses.replace(near, position=near.position + 0.06)
    given = {"feedforward_force": np.array([[3.0], [-2.0]]), "feedforward_rate": np.array([[30.0], [10.0]])}
    openings = np.array([law.command(far, REFERENCE, **given) for _ in range(500)])
    assert np.all(np.abs(openings).reshape(500, 2, 2).max(axis=2) == 1)
    assert not Integrated(law._memories[-1]).force.any()
    np.testing.assert_array_equal(law._asked[-5:-1].ravel(), [3.0, -2.0, 30.0, 10.0])
    plain = BacksteppingController(IDEAL, weight_compensation=True)
    np.testing.assert_allclose(law.command(near, REFERENCE), plain.command(near, REFERENCE), atol=1e-9)


def test_what_it_needs_and_declares() -> None:
    literal, compliant = IntegralBackstepping(), CompliantBackstepping()
    assert (literal.reads_force, compliant.reads_force) == (False, True)
    assert [uses_force(f"backstepping-integral{more}") for more in ("", "-compliant")] == [False, True]
    assert literal.declared_impedance(REFERENCE) is None
    declared = compliant.declared_impedance(REFERENCE)
    assert declared is not None
    np.testing.assert_array_equal(declared.stiffness, BacksteppingController().declared_impedance(REFERENCE).stiffness)


@pytest.mark.parametrize("kind", [IntegralBackstepping, CompliantBackstepping])
def test_other_rates_are_refused(kind: type[IntegralBackstepping]) -> None:
    with pytest.raises(ValueError, match=r"integral_rate = 0\.0; allowed: a positive number"):
        kind(integral_rate=0.0)
