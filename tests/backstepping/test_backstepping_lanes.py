"""The backstepping law over lanes, past the strokes, and given what it cannot use."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from baselines import BacksteppingController
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.geometry import joint_force
from birthsim_env.physics.rig.parameters import Parameters
from tests.backstepping.test_backstepping import many, of_lanes
from tests.oracles import closed_loop
from tests.oracles import derived_law as derived


def test_one_rig_is_one_lane() -> None:
    measured, reference, told = many(77)
    law = BacksteppingController(weight_compensation=True)
    together, without = law.command(measured, reference, *told), law.command(measured, reference)
    assert not np.array_equal(together, without)
    for lane in (0, 31, 32, 76):
        alone = law.command(*of_lanes(measured, reference, lane), *(one[..., lane] for one in told))
        assert alone.shape == (4,)
        assert np.array_equal(alone, together[:, lane])
        assert np.array_equal(law.command(*of_lanes(measured, reference, lane)), without[:, lane])


def test_lanes_do_not_know_of_each_other() -> None:
    measured, reference, told = many(77)
    law = BacksteppingController()
    together = law.command(measured, reference, *told)
    order = np.random.default_rng(0).permutation(77)
    shuffled = law.command(*of_lanes(measured, reference, order), *(one[..., order] for one in told))
    assert np.array_equal(shuffled, together[:, order])
    measured.pressures[:, 40] = 3e5
    changed = law.command(measured, reference, *told)
    assert np.array_equal(np.delete(changed, 40, axis=1), np.delete(together, 40, axis=1))
    assert not np.array_equal(changed[:, 40], together[:, 40])


def test_the_law_has_no_memory_of_exact_measurements() -> None:
    measured, reference, _ = many(5)
    law = BacksteppingController()
    first = law.command(measured, reference)
    assert np.array_equal(law.command(measured, reference), first)
    law.reset(np.array([True, False, True, False, False]))
    law.reset()
    assert np.array_equal(law.command(measured, reference), first)


def test_a_piston_past_its_stroke_gets_finite_openings() -> None:
    """End stops give way a little and sensors have noise."""
    rig = Parameters()
    beyond = np.array([[1, -1, 1, -1], [1, 1, -1, -1]]) * np.array([[0.1005], [0.2005]])
    measured = derived.seen(beyond, np.zeros((2, 4)), np.full((4, 4), 4e5), rig)
    openings = BacksteppingController(rig).command(measured, closed_loop.holding(measured.position, 2000.0))
    assert np.all(np.abs(openings) <= 1)


def test_believing_the_users_force_removes_the_compliance() -> None:
    """Pushed with 10 N on each axis: 5 mm at 2000 N/m; nothing where the law is told of it along the cylinders (17)."""
    rig = closed_loop.FRICTIONLESS
    reference = closed_loop.holding(np.array([[0.5, 0.5, 0.45, 0.45], [0.0, 0.0, 0.05, 0.05]]), 2000.0)
    plant, law = closed_loop.resting_at(reference, rig), BacksteppingController(rig, weight_compensation=True)
    told, push = np.array([0.0, 1.0, 0.0, 1.0]), np.full((2, 4), 10.0)

    def command(measured: Measurement, reference: Reference) -> Array:
        return law.command(measured, reference, told * joint_force(measured.user_force, plant.piston, rig))

    for _ in closed_loop.run(plant, command, lambda t: reference, lambda t: push * min(t / 0.5, 1.0), 2.0):
        pass
    moved = plant.end_effector()[:2] - reference.position
    np.testing.assert_allclose(moved[:, told == 0], 0.005, rtol=0.01)
    np.testing.assert_allclose(moved[:, told == 1], 0, atol=0.00001)


@pytest.mark.parametrize("name", ["pneumatic_gain", "sign_width", "damping_ratio"])
@pytest.mark.parametrize("value", [0, -1.0, math.nan, math.inf])
def test_options_that_cannot_be_are_refused(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{name} = {value!r}; allowed: a positive number"):
        BacksteppingController(**{name: value})


def test_a_rig_that_cannot_be_is_refused() -> None:
    with pytest.raises(ValueError, match="parameters = 3; allowed"):
        BacksteppingController(3)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"nowhere\.toml"):
        BacksteppingController("nowhere.toml")


def test_signals_over_different_lanes_are_refused() -> None:
    """A compiled loop would read past the shorter array without a word."""
    measured, reference, (believed, rate, factor) = many(3)
    law, narrow = BacksteppingController(), slice(1)
    fewer, fewer_wanted = of_lanes(measured, reference, narrow)
    mixed = dataclasses.replace(measured, pressures=fewer.pressures), dataclasses.replace(measured, velocity=fewer.velocity)
    with pytest.raises(ValueError, match=r"measurement.pressures has shape \(4, 1\); allowed: \(4, 3\)"):
        law.command(mixed[0], reference)
    with pytest.raises(ValueError, match=r"measurement.velocity has shape \(2, 1\); allowed: \(2, 3\)"):
        law.command(mixed[1], reference)
    with pytest.raises(ValueError, match=r"reference.rows has shape \(15, 1\); allowed: \(15, 3\)"):
        law.command(measured, fewer_wanted)
    with pytest.raises(ValueError, match=r"reference.rows has shape \(8, 3\); allowed: \(15, 3\)"):
        law.command(measured, Reference(reference.rows[:8].copy()))
    for wrong in (believed[:, :1], believed[:1], believed[:, 0]):
        with pytest.raises(ValueError, match=r"feedforward_force has shape .*; allowed: \(2, 3\)"):
            law.command(measured, reference, wrong)
        with pytest.raises(ValueError, match=r"feedforward_rate has shape .*; allowed: \(2, 3\)"):
            law.inspect(measured, reference, believed, wrong)
    for wrong in (factor[:1], factor[None], factor[0]):
        with pytest.raises(ValueError, match=r"damping_factor has shape .*; allowed: \(3,\)"):
            law.command(measured, reference, believed, rate, wrong)
    openings = law.command(measured, reference, believed, rate, factor)
    assert np.array_equal(law.command(measured, reference, believed.tolist(), rate.tolist(), factor.tolist()), openings)
