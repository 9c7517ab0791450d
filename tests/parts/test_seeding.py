"""Random streams: each random part has its own, draws fill their documented ranges, and ranges that cannot be are refused."""

import dataclasses
import itertools

import gymnasium
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from birthsim_env import Parameters
from birthsim_env.parts.drawn.randomization import documented_ranges, draw_parameters
from birthsim_env.parts.drawn.seeding import STREAMS, lane_seeds, stream
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.compiled.lanes import PARAMETER_NAMES, parameter_column
from birthsim_env.physics.rig.parameters import DECLARED, value_of
from birthsim_env.physics.rig.rows import RIG_ROWS, parameters_read
from birthsim_env.registry import names

RIG = Parameters()
DRAWN = documented_ranges(RIG)
READ = {row.name: parameters_read(row.of, RIG) for row in RIG_ROWS}
CURVATURE = "curvature"
COLUMNS = {
    name: next(row.name for row in RIG_ROWS if name in READ[row.name] and row.of(RIG) == value_of(RIG, name))
    for name in DRAWN
    if not name.endswith(CURVATURE)
}
"""Parameter that is drawn -> the row that is it."""


def values_of(name, rows):
    """A parameter that is drawn, (lanes,), from the rows of the rigs; the slope of a valve's edge is (1 + c)/(1 - d)."""
    if name in COLUMNS:
        return rows[COLUMNS[name]]
    side = name.removeprefix("valves.").removesuffix(f"_{CURVATURE}")
    return rows[f"{side}_slope_p1"] * (1 - rows[f"{side}_overlap_p1"]) - 1


def world(name="BirthSIM/Descent-v2", seed=11, lanes=4, **arguments):
    """Target motion, stiffness setpoints, user force (over the whole episode) and the rigs that a seed draws."""
    env = gymnasium.make_vec(name, num_envs=lanes, **arguments).unwrapped
    env.reset(seed=seed)
    parts, instants = env.simulation, np.linspace(0, 24, 60)
    rows = [np.stack([part.sample(np.full(lanes, t)) for t in instants]) for part in (parts.trajectory, parts.stiffness)]
    zero = np.zeros((2, lanes))
    force = parts.user_force.force(np.repeat(instants[:, None], lanes, axis=1), zero, zero)
    return *rows, force, parts.plant.lane_parameters


def rigs(lanes=1500, seed=0, **arguments):
    """Parameter name -> (lanes,) as drawn."""
    env = gymnasium.make_vec("BirthSIM/Probe-v3", num_envs=lanes, **arguments).unwrapped
    env.reset(seed=seed)
    return dict(zip(PARAMETER_NAMES, env.simulation.plant.lane_parameters, strict=True))


def first_draw(*arguments):
    return stream(*arguments).random()


@given(st.integers(0, 2**63), st.integers(0, 10**6))
def test_every_stream_of_every_episode_is_its_own_and_repeatable(seed, episode):
    draws = {(s, e, name): first_draw(s, e, name) for s in (seed, seed + 1) for e in (episode, episode + 1) for name in STREAMS}
    assert len(set(draws.values())) == 4 * len(STREAMS)
    assert all(first_draw(*key) == value for key, value in draws.items())


@pytest.mark.parametrize("scenario", [False, True])
@pytest.mark.parametrize("sensors", ["ideal", "lab"])
def test_other_random_parts_do_not_move_reference_stiffness_and_force(scenario, sensors):
    base = world(randomize="scenario" if scenario else False)
    changed = world(randomize=scenario or "plant", sensors=sensors)
    for part in range(3):
        np.testing.assert_array_equal(base[part], changed[part])
        assert (np.ptp(base[part], axis=-1).max() > 0) == scenario
    assert not np.array_equal(base[3], changed[3])
    np.testing.assert_array_equal(changed[3], world(randomize=True)[3])


def test_a_logarithmic_range_is_filled_over_its_decades():
    """Bristles: a tenth to ten times 5e4 N/m, each tenth of the two decades alike, and lanes have what a single rig draws."""
    name, (low, high) = "friction.bristle_stiffness", DECLARED["friction.bristle_stiffness"].range
    drawn = rigs(randomize={name: (low, high)})["s0"]
    assert low <= drawn.min() < 1.01 * low
    assert 0.99 * high < drawn.max() <= high
    counts = np.histogram(np.log10(drawn), 10, (np.log10(low), np.log10(high)))[0]
    assert np.abs(counts - 150).max() < 4.5 * np.sqrt(150 * 0.9)
    one = draw_parameters(Parameters(), {name: (low, high)}, np.random.default_rng(3)).friction.bristle_stiffness
    assert one == pytest.approx(low * (high / low) ** np.random.default_rng(3).uniform(), rel=1e-14)


@pytest.mark.parametrize("name", names("scenario"))
def test_without_randomization_every_seed_gives_the_same_fixed_experiment(name):
    one, other = (world(environment_id(name), seed=seed, lanes=6) for seed in (0, 100))
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a, b)
        assert np.ptp(a, axis=-1).max() == 0.0


def test_draws_stay_inside_their_ranges_and_fill_them_independently():
    drawn = rigs(randomize="plant")
    shares = {}
    for name, bounds in DRAWN.items():
        scale = np.log if DECLARED[name].logarithmic else np.asarray
        low, high = scale(bounds)
        shares[name] = values = (scale(values_of(name, drawn)) - low) / (high - low)
        assert -1e-12 <= values.min() < 0.01, name
        assert 0.99 < values.max() <= 1 + 1e-12, name
        # Uniform: no decile is off by more than 4.5 standard deviations.
        counts = np.histogram(values, 10, (0, 1))[0]
        assert np.abs(counts - 150).max() < 4.5 * np.sqrt(150 * 0.9), name
    for one, other in itertools.combinations(DRAWN, 2):
        correlation = np.corrcoef(shares[one], shares[other])[0, 1]
        assert abs(correlation) < 4.5 / np.sqrt(1500), (one, other)
    nominal = dict(zip(PARAMETER_NAMES, parameter_column(Parameters()), strict=True))
    # What is not drawn, nor derived from it, keeps its nominal value.
    np.testing.assert_array_equal(drawn["spool_rate"], 1 / drawn["tau"])
    np.testing.assert_array_equal(drawn["inverse_mass"], 1 / drawn["mass"])
    for name in (name for name in PARAMETER_NAMES if not READ[name] & DRAWN.keys()):
        np.testing.assert_array_equal(drawn[name], nominal[name], err_msg=name)


def test_a_mapping_draws_just_its_parameters():
    drawn = rigs(lanes=300, randomize={"mechanics.mass": (3.5, 4.0), "air.supply_pressure": (6e5, 8e5)})
    assert 3.5 <= drawn["mass"].min() < 3.51
    assert 3.99 < drawn["mass"].max() <= 4.0
    assert 6e5 <= drawn["supply"].min() < 6.05e5
    assert 7.95e5 < drawn["supply"].max() <= 8e5
    varied = {name for name, values in drawn.items() if np.ptp(values)}
    assert varied == {"mass", "inverse_mass", "inverse_mass1", "supply", "inverse_supply", "source"}


def test_a_draw_does_not_depend_on_the_order_of_the_names():
    ranges = {"mechanics.mass": (2.0, 5.0), "chambers.dead_volume": (5e-6, 2e-5)}
    one = draw_parameters(Parameters(), ranges, stream(1, 0, "parameters"))
    other = draw_parameters(Parameters(), dict(reversed(ranges.items())), stream(1, 0, "parameters"))
    assert one == other != Parameters()
    assert dataclasses.replace(one, mechanics=Parameters().mechanics, chambers=Parameters().chambers) == Parameters()


def test_ranges_are_judged_on_the_users_rig():
    bores = {"cylinder1.rod_diameter": 0.02, "cylinder1.piston_diameter": 0.05}
    wide = Parameters().replace({**bores, "chambers.dead_volume": 2e-5})
    env = gymnasium.make("BirthSIM/Circle-v2", parameters=wide, randomize={"cylinder1.rod_diameter": (0.02, 0.03)})
    assert env.reset(seed=0)[0].shape == (24,)
    # The ranges follow the rig: no chamber is drawn smaller than its largest piston needs.
    low, high = documented_ranges(wide)["chambers.dead_volume"]
    assert (low, high) == (pytest.approx(0.01 * np.pi / 4 * 0.05**2), pytest.approx(2.4e-5))


def test_lane_seeds_count_up_or_are_as_given():
    rng = np.random.default_rng(0)
    assert lane_seeds(7, 3, rng) == lane_seeds(np.int64(7), 3, rng) == [7, 8, 9]
    assert lane_seeds([4, 4, 1], 3, rng) == [4, 4, 1]
    missing = lane_seeds([4, None, None], 3, rng)
    assert missing[0] == 4
    assert len({*missing, *lane_seeds(None, 3, rng)}) == 6
