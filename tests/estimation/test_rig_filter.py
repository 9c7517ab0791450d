"""The filter that finds a rig: slopes against differences, its arithmetic against NumPy's, and what it finds on the plant."""

from collections.abc import Iterator
from contextlib import closing
from typing import Any

import gymnasium
import numpy as np
import pytest

from baselines.driving import driving
from baselines.estimation import rig_filter
from baselines.estimation.chamber_observer import predicted_pressure
from baselines.estimation.rig_filter import DEAD, INDEX, LAG, SIZE, SUPPLY, TOLD, RigFilter
from baselines.named import make_controller
from birthsim_env.loop.signals import Joints
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Array, Rig, parameter_column
from birthsim_env.physics.rig.parameters import Parameters, value_of

PERIOD = 1e-3
NAMES = list(TOLD)


def another(seed: int) -> tuple[Array, Parameters]:
    """Logarithms (SIZE,) within what rigs are, and the rig that they stand for."""
    rng, rig = np.random.default_rng(seed), Parameters()
    values = {name: float(np.exp(rng.uniform(*np.log(ends)))) for name, ends in TOLD.items()}
    return np.array([*(np.log(values[name] / value_of(rig, name)) for name in NAMES), 0.0]), rig.replace(values)


@pytest.mark.parametrize("seed", range(8))
def test_a_rig_that_is_told_is_the_one_that_its_logarithms_stand_for(seed):
    logarithms, rig = another(seed)
    own = Rig(np.zeros(Rig.size))
    rig_filter.write_rig(Rig(parameter_column(Parameters())), logarithms, own)
    np.testing.assert_allclose(own.rows, parameter_column(rig), rtol=1e-13)


def filtered(rig: Parameters) -> RigFilter:
    return RigFilter(rig_filter.fresh(rig)[:, None].copy())


def test_a_measurement_is_taken_as_kalman_has_it():
    rng, own = np.random.default_rng(3), filtered(Parameters())
    root = rng.normal(size=(SIZE, SIZE))
    before, mean, slope = root @ root.T, rng.normal(size=SIZE), rng.normal(size=SIZE)
    own.mean[:, 0], own.covariance[:, 0] = mean, before.ravel()
    rig_filter.correct(own, 0, 0, slope, 0.7, 2.5, 4.0)
    expected = slope @ before @ slope
    gain = before @ slope / (2.5 + 5.0 * expected)
    np.testing.assert_allclose(own.mean[:, 0], mean + 0.7 * gain, rtol=1e-12)
    np.testing.assert_allclose(own.covariance[:, 0].reshape(SIZE, SIZE), before - np.outer(gain, slope @ before), atol=1e-11)


def test_what_measurements_say_adds_up_by_their_kind():
    own, slopes = filtered(Parameters()), np.random.default_rng(4).normal(size=(2, SIZE))
    for kind, slope in enumerate(slopes):
        for error in (0.02, -0.01):
            rig_filter.correct(own, 0, kind, slope, error, 0.04, 0.0)
    np.testing.assert_allclose(own.score[:, 0], slopes.ravel() * 0.01 / 0.04, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(own.information[:, 0], 2.0 * slopes.ravel() ** 2 / 0.04, rtol=1e-12)


def test_no_error_counts_for_more_than_three_standard_deviations():
    slope = np.eye(SIZE)[SUPPLY]
    far, near = filtered(Parameters()), filtered(Parameters())
    variance = near.covariance[(SIZE + 1) * SUPPLY, 0]
    rig_filter.correct(far, 0, 0, slope, 1e9, 1.0, 0.0)
    rig_filter.correct(near, 0, 0, slope, 3.0 * np.sqrt(1.0 + variance), 1.0, 0.0)
    np.testing.assert_allclose(far.mean, near.mean, rtol=1e-12)


def observed(rig: Parameters, index: float, chamber: int, openings: Array) -> Array:
    """Pressures, Pa, of a chamber that begins at 3 bar with a shut valve, as the observer of a rig expects them, and as a cell
    measures them that shows 3 bar throughout."""
    p = Rig(parameter_column(rig.replace({"air.polytropic_index": index})))
    pressure, spool, found = 3e5, 0.0, []
    cylinder, sign = chamber // 2, 1.0 - 2.0 * (chamber % 2)
    area = p.rows[(at.AREA_P1, at.AREA_N1, at.AREA_P2, at.AREA_N2)[chamber]]
    half = p.half_l1 if cylinder == 0 else p.half_l2
    kept = np.exp(-PERIOD / p.tau)
    mean = (1.0 - kept) * p.tau / PERIOD
    for opening in openings:
        away = spool - opening
        expected = predicted_pressure(
            chamber, pressure, opening + mean * away, area, half + sign * 0.02, sign * 0.15, PERIOD, p
        )
        spool = opening + kept * away
        found.append(expected)
        pressure = expected + rig_filter.TRUST * (3e5 - expected)
    return np.array(found)


@pytest.mark.parametrize("chamber", range(4))
def test_sensitivities_of_pressures_are_their_derivatives(chamber):
    # Openings beyond the overlap, where the valve's curve is smooth; the valve is opened and shut once.
    openings = np.concatenate([np.linspace(0.2, 0.6, 10), np.linspace(-0.3, -0.7, 10)])
    rig, dead = Parameters(), "chambers.dead_volume"
    own, p = filtered(rig), Rig(parameter_column(rig))
    own.pressure[:], own.spool[:] = 3e5, 0.0
    joints = Joints(np.zeros((Joints.size, 1)))
    joints.position[:], joints.speed[:] = 0.02, 0.15
    index, found = rig_filter.INDEX_FOUND, []
    bore = f"cylinder{1 + chamber // 2}.piston_diameter"
    for opening in openings:
        rig_filter.read_chamber(own, 0, chamber, opening, 3e5, joints, PERIOD, 500.0, p)
        first = rig_filter.OF_CHAMBER * chamber
        # As they were when the measurement was taken.
        found.append(own.sensitivity[first : first + rig_filter.OF_CHAMBER, 0] / (1.0 - rig_filter.TRUST))
    step, derivatives = 1e-5, []
    for name in ("air.supply_pressure", bore, "valves.time_constant", "chambers.dead_volume"):
        # What is not said of the dead volume follows the bores.
        sizes = {dead: value_of(rig, dead)}
        near = [rig.replace(sizes | {name: value_of(rig, name) * np.exp(side * step)}) for side in (1.0, -1.0)]
        more, less = (observed(one, index, chamber, openings) for one in near)
        derivatives.append((more - less) / (2 * step))
    more, less = (observed(rig, index * np.exp(side * step), chamber, openings) for side in (1.0, -1.0))
    derivatives.append((more - less) / (2 * step))
    # The recursion leaves out how P' depends on P, some 2 % a period here, which lasts for 1/TRUST = 5 periods.
    for k, expected in enumerate(derivatives):
        np.testing.assert_allclose(np.array(found)[:, k], expected, atol=0.1 * np.abs(expected).max(), err_msg=str(k))


def test_a_balance_of_the_true_rig_teaches_nothing_and_slopes_are_derivatives():
    logarithms, rig = another(5)
    described, true = Parameters(), Rig(parameter_column(rig))
    pressures = np.array([[3.1e5], [2.2e5], [4.0e5], [1.7e5]])
    alpha, speed, sliding, area = 7.0, 0.1, -0.9, true.area_p2
    difference = pressures[2, 0] - pressures[3, 0]
    gauge = pressures[2, 0] + pressures[3, 0] - 2 * true.atmosphere
    level = true.fc2 + true.fp2 * gauge
    hand = true.mass * alpha + true.fv2 * speed + level * sliding - area * difference

    def taught(mean: Array) -> RigFilter:
        own = filtered(described)
        own.mean[:, 0] = mean
        own.third[5:, 0] = hand, alpha, speed, sliding, difference
        rig_filter.balance(own, 0, 1, 0.0, pressures, Rig(parameter_column(described)))
        return own

    np.testing.assert_allclose(taught(logarithms).mean[:, 0], logarithms, atol=1e-12)
    for k in (rig_filter.MASS, rig_filter.COULOMB + 1, rig_filter.VISCOUS + 1, rig_filter.BORE + 1):
        off = logarithms + 1e-3 * np.eye(SIZE)[k]
        change = taught(off).mean[:, 0] - off
        assert change[k] < 0, "what is too large falls"
        assert (change[[SUPPLY, LAG, DEAD, INDEX, rig_filter.MASS if k else SUPPLY]][:4] == 0).all(), "others stay"


@pytest.fixture
def circles() -> Iterator[tuple[Any, Any]]:
    law: Any = make_controller("admittance[finds_rig=true]")
    ranges = {name: (low * 1.1, high / 1.1) for name, (low, high) in TOLD.items()} | {"mechanics.mass": (2.0, 5.0)}
    env = gymnasium.make_vec(
        "BirthSIM/Circle-v2", num_envs=24, randomize=ranges, sensors="honest", actuation=driving(law, None)
    )
    with closing(env):
        yield env, law


def test_on_the_plant_it_finds_what_circles_show_and_knows_how_well(circles):
    env, law = circles
    env.reset(seed=7_100_000)
    alive = np.ones(env.num_envs, dtype=bool)
    for _ in range(250):
        _, _, ended, _, _ = env.step(np.zeros(env.action_space.shape, dtype=np.float32))
        alive &= ~ended
    assert alive.sum() >= 12
    lane, plain = env.unwrapped.simulation.plant.lane_parameters[:, alive], Rig(parameter_column(Parameters()))
    true = {
        "air.supply_pressure": lane[at.SUPPLY] / plain.supply,
        "cylinder2.piston_diameter": np.sqrt(lane[at.AREA_P2] / plain.area_p2),
        "valves.time_constant": lane[at.TAU] / plain.tau,
        "mechanics.mass": lane[at.MASS] / plain.mass,
    }
    for name, ratio in true.items():
        value, spread = law.found_rig[name]
        error = np.abs(np.log(value[alive] / value_of(Parameters(), name) / ratio))
        assert np.median(error) < 0.4 * np.median(np.abs(np.log(ratio))), f"{name}: far better than the default"
        assert (spread[alive] < 0.7 * rig_filter.spread_of(Parameters())[NAMES.index(name)]).mean() > 0.8
    assert set(law.found_rig) == set(TOLD)
