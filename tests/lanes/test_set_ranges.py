"""``set_ranges``: what new episodes are drawn from changes without a new environment, which then has the bits of a new one."""

import pickle

import gymnasium
import numpy as np
import pytest
from stable_baselines3.common.vec_env import VecNormalize

import agents  # noqa: F401  registers the residual environments
from agents import SB3VecEnv
from birthsim_env import Parameters
from birthsim_env.parts.references import Trajectory
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.compiled.lanes import parameter_column
from birthsim_env.registry import names
from tests.contracts.test_environments import assert_same_steps, saved

CIRCLE = "BirthSIM/Circle-v2"
HEAVY, ALL = {"mechanics.mass": (4.0, 5.0)}, [False, "plant", "scenario", True, {"mechanics.mass": (4.0, 5.0)}]
LANES = 3


def made(name=CIRCLE, lanes=LANES, **arguments):
    return gymnasium.make_vec(name, num_envs=lanes, **{"autoreset_mode": "SameStep", "duration": 0.1, **arguments})


def actions(env, steps, seed=0):
    return np.random.default_rng(seed).uniform(-0.3, 0.3, (steps, *env.action_space.shape)).astype(np.float32)


def masses(env):
    (row,) = np.flatnonzero(parameter_column(Parameters().replace({"mechanics.mass": 4.3})) == 4.3)
    return env.simulation.plant.lane_parameters[row]


@pytest.mark.parametrize("before", ALL, ids=str)
@pytest.mark.parametrize("after", ALL, ids=str)
def test_after_a_seed_all_is_as_in_a_new_environment_through_several_episodes(before, after):
    one, other = made(randomize=before), made(randomize=after)
    one.reset(seed=3)
    given = actions(one, 27)
    for action in given[:14]:  # 1.4 episodes
        one.step(action)
    one.set_ranges(after)
    np.testing.assert_array_equal(one.reset(seed=5)[0], other.reset(seed=5)[0])
    np.testing.assert_array_equal(one.simulation.plant.lane_parameters, other.simulation.plant.lane_parameters)
    assert_same_steps(one, other, given)


@pytest.mark.parametrize("sensors", ["lab", "honest", "encoders-gauges"])
@pytest.mark.parametrize("name", [environment_id(one) for one in names("scenario")])
def test_every_scenario_and_sensor_model_draws_as_a_new_one(name, sensors):
    one, other = (
        gymnasium.make(name, sensors=sensors, randomize=randomize, duration=3.2).unwrapped for randomize in (False, True)
    )
    one.reset(seed=1)
    one.step(np.zeros(one.action_space.shape))
    one.set_ranges(True)
    one.reset(seed=2), other.reset(seed=2)
    assert_same_steps(one, other, actions(one, 320, seed=4))


@pytest.mark.parametrize("name", [environment_id(one) for one in names("scenario")])
def test_episodes_that_are_under_way_end_in_the_world_that_they_have(name):
    """Lanes at different moments: each takes the new ranges when its own episode is over."""
    one, bare, new = (made(name, duration=0.2, randomize=randomize) for randomize in (False, False, True))
    for env in (one, bare, new):
        env.reset(seed=7, options={"staggered": True})
    over, given = np.zeros(LANES, np.bool_), actions(one, 25)
    for k, action in enumerate(given):
        if k == 4:
            one.set_ranges(True)
        seen, theirs, drawn = (env.step(action) for env in (one, bare, new))
        over |= theirs[2] | theirs[3]
        for place in (0, 1):
            np.testing.assert_array_equal(seen[place][~over], theirs[place][~over])
        # The world of an episode depends on its seed and number alone, what happened in it on the actions.
        np.testing.assert_array_equal(seen[0][over], drawn[0][over])
    assert over.all()
    assert not np.array_equal(seen[0], theirs[0])


def test_ranges_may_be_taken_back():
    env = made(randomize=False)
    env.reset(seed=0)
    nominal = env.simulation.plant.lane_parameters.copy()
    env.set_ranges(HEAVY)
    env.reset(seed=0)
    assert (np.abs(masses(env) - 4.5) <= 0.5).all()
    assert len({*masses(env)}) == LANES
    env.set_ranges(False)
    env.reset(seed=0)
    np.testing.assert_array_equal(env.simulation.plant.lane_parameters, nominal)


REFUSED = [
    "all",
    "sensors",
    {"linkage.inclination": (0, 1)},
    {"mechanics.mass": (5, 2)},
    {"electronics.force_bias": (0, 1)},
    3,
    None,
]


@pytest.mark.parametrize("wrong", REFUSED, ids=str)
def test_what_cannot_be_drawn_is_refused_in_the_words_of_make_and_changes_nothing(wrong):
    with pytest.raises(ValueError, match="randomize") as refused:
        made(randomize=wrong)
    one, other = made(randomize=HEAVY), made(randomize=HEAVY)
    one.reset(seed=1), other.reset(seed=1)
    with pytest.raises(ValueError, match="randomize") as said:
        one.set_ranges(wrong)
    assert str(said.value) == str(refused.value)
    assert_same_steps(one, other, actions(one, 25))


def test_a_users_own_parts_stay_what_they_are():
    class Still(Trajectory):
        begun = 0

        def begin(self, lane, rng):
            self.begun += 1

        def sample(self, time):
            return np.concatenate([np.full((1, len(time)), 0.5), np.zeros((7, len(time)))])

    own = Still()
    one = made(reference=own, user_force="steps", randomize="plant")
    other = made(reference=Still(), user_force="steps", randomize=True)
    one.reset(seed=1)
    one.set_ranges(True)
    assert one.simulation.trajectory is own
    one.reset(seed=2), other.reset(seed=2)
    assert own.begun == 2 * LANES
    assert_same_steps(one, other, actions(one, 25))


def test_a_state_brings_its_ranges_back_also_to_an_environment_that_never_had_them():
    one, given = made(randomize=False, sensors="honest"), actions(made(), 40)
    one.reset(seed=1)
    one.set_ranges(True)
    one.reset()
    for action in given[:13]:
        one.step(action)
    state = saved(one.get_state())
    other, third = made(randomize=False, sensors="honest"), made(randomize=False, sensors="honest")
    other.set_state(state)
    third.reset(seed=3)
    third.set_ranges("sensors")
    third.set_state(state)
    assert_same_steps(one, other, given)
    one.set_state(state)
    assert_same_steps(one, third, given)
    # One from before the ranges changed brings those back that the environment was made with.
    fresh = made(randomize=False, sensors="honest")
    fresh.reset(seed=4)
    third.set_state(fresh.get_state())
    assert_same_steps(third, fresh, given)


def test_a_state_that_is_refused_leaves_ranges_and_lanes_as_they_are():
    one, other = (made(randomize=False, sensors="honest") for _ in range(2))
    for env in (one, other):
        env.reset(seed=1)
        env.step(np.zeros((LANES, 4)))
    stranger = made(randomize=False, sensors="honest", lanes=2)
    stranger.reset(seed=1)
    stranger.set_ranges(True)
    stranger.reset(seed=1)
    with pytest.raises(ValueError, match="state is of another environment"):
        one.set_state(stranger.get_state())
    assert_same_steps(one, other, actions(one, 25))


def test_copies_go_on_with_the_ranges_of_now():
    one = made(randomize=False)
    one.reset(seed=1)
    one.set_ranges(True)
    other = pickle.loads(pickle.dumps(one))
    assert_same_steps(one, other, actions(one, 25))


def test_where_there_is_no_room_for_a_new_latency_all_lanes_begin_anew_first():
    one = made(sensors="honest", randomize=False)
    one.reset(seed=1)
    longer = {"electronics.position_latency": (0.001, 0.05)}
    one.set_ranges(longer)
    for call in (lambda: one.step(np.zeros((LANES, 4))), one.get_state):
        with pytest.raises(RuntimeError, match=r"after set_ranges\(\).*call reset\(\) of all lanes first"):
            call()
    with pytest.raises(RuntimeError, match=r"reset\(\) of some lanes after set_ranges\(\)"):
        one.reset(options={"reset_mask": np.array([True, False, False])})
    other = made(sensors="honest", randomize=longer)
    np.testing.assert_array_equal(one.reset(seed=2)[0], other.reset(seed=2)[0])
    assert_same_steps(one, other, actions(one, 25))


def test_stable_baselines_calls_it_for_all_lanes_together():
    worlds = VecNormalize(SB3VecEnv(made("BirthSIM/CircleResidual-v2", randomize=False)))
    worlds.reset()
    assert worlds.env_method("set_ranges", HEAVY) == [None] * LANES
    for _ in range(10):
        worlds.step(np.zeros((LANES, *worlds.action_space.shape), np.float32))
    assert (masses(worlds.venv.env) >= 4.0).all()
    with pytest.raises(ValueError, match=r"randomize = 'everything'; allowed: False, True"):
        worlds.env_method("set_ranges", "everything")
    with pytest.raises(NotImplementedError, match=r"of 1 lanes: the lanes share one .* 'set_ranges' of all 3"):
        worlds.env_method("set_ranges", True, indices=[1])
    with pytest.raises(NotImplementedError, match=r"set_attr\('randomize'\).*env_method\('set_ranges', \.\.\.\)"):
        worlds.set_attr("randomize", True)
