"""``get_state`` and ``set_state``: an environment goes on from arrays as the one that they were taken from, bit for bit."""

import threading

import gymnasium
import numpy as np
import pytest

import agents  # noqa: F401  registers the residual environments
import birthsim_env
from birthsim_env.state import give_state, take_state
from tests.contracts.test_environments import WORLDS, assert_same_steps, made, saved

LANES = 3


def test_lanes_that_have_ended_and_the_seeds_to_come_are_part_of_it():
    env, other = (gymnasium.make_vec("BirthSIM/Circle-v2", num_envs=2, duration=0.05, randomize=True) for _ in range(2))
    env.reset()  # seeds of its own
    for _ in range(5):
        _, _, _, truncated, _ = env.step(np.zeros((2, 4), np.float32))
    assert truncated.all()
    other.set_state(env.get_state())
    assert_same_steps(env, other, np.zeros((3, 2, 4)))
    np.testing.assert_array_equal(env.reset()[0], other.reset()[0])
    assert env.np_random.integers(2**40) == other.np_random.integers(2**40)


@pytest.mark.parametrize("arguments", [{"sensors": "lab", "randomize": True}, {"user_force": "guided"}])
def test_the_single_environment_has_it_too(arguments):
    one, other = (gymnasium.make("BirthSIM/CircleResidual-v2", duration=0.4, **arguments).unwrapped for _ in range(2))
    given = np.random.default_rng(0).uniform(-1, 1, (35, *one.action_space.shape))
    one.reset(seed=1)
    for action in given[:15]:
        one.step(action)
    other.set_state(saved(one.get_state()))
    assert_same_steps(one, other, given[15:])


class Counting(birthsim_env.UserForce):
    """A hand in Python with a memory of every kind."""

    def __init__(self):
        self.count, self.table, self.nothing, self.words = 0, {"of": [1.5]}, None, ("a", (2, 3))

    def prepare(self, num_envs):
        self.rngs = [np.random.default_rng(k) for k in range(num_envs)]
        self.last = np.zeros((2, num_envs))

    def begin(self, lane, rng):
        self.rngs[lane] = rng

    def force(self, time, position, velocity):
        self.count += 1
        self.nothing = np.full(3, float(self.count))
        self.later = self.words
        self.last += np.array([rng.normal() for rng in self.rngs])
        return np.broadcast_to(self.last, (len(time), *self.last.shape)) + 0.01 * self.count


def test_a_users_own_part_keeps_its_memory():
    one, other = (gymnasium.make_vec("BirthSIM/Circle-v2", num_envs=2, duration=0.4, user_force=Counting()) for _ in range(2))
    one.reset(seed=1)
    for _ in range(7):
        one.step(np.zeros((2, 4)))
    other.set_state(saved(one.get_state()))
    assert other.simulation.user_force.count == one.simulation.user_force.count > 0
    assert other.simulation.user_force.later == ("a", (2, 3))
    assert_same_steps(one, other, np.zeros((20, 2, 4)))


def test_a_part_that_keeps_what_no_array_can_is_named():
    hand = Counting()
    env = gymnasium.make_vec("BirthSIM/Circle-v2", num_envs=2, user_force=hand)
    env.reset(seed=1)
    hand.lock = threading.Lock()
    with pytest.raises(ValueError, match=r"user_force\.lock is a lock; allowed in a state: numbers, text, None, arrays"):
        env.get_state()


def test_without_episodes_there_is_no_state():
    for env in (gymnasium.make("BirthSIM/Circle-v2").unwrapped, gymnasium.make_vec("BirthSIM/Circle-v2", num_envs=2)):
        with pytest.raises(RuntimeError, match=r"get_state\(\) before reset\(\): call reset\(seed=\.\.\.\) first"):
            env.get_state()


@pytest.mark.parametrize(("world", "lanes"), [("circle lab", 4), ("circle ideal", 3), ("hand guided", 3), ("flows", 3)])
def test_the_state_of_another_environment_is_refused_and_changes_nothing(world, lanes):
    name, arguments = WORLDS[world]
    stranger = gymnasium.make_vec(name, num_envs=lanes, **arguments)
    stranger.reset(seed=0)
    own = made("circle lab", LANES)
    own.reset(seed=6)
    own.step(np.zeros((LANES, 4)))
    before = own.get_state()
    with pytest.raises(ValueError, match=r"state is of another environment: '.*; allowed: what get_state\(\) of one made with"):
        own.set_state(stranger.get_state())
    after = own.get_state()
    assert all(np.array_equal(after[name], before[name]) for name in before)


@pytest.mark.parametrize("wrong", [{}, {"plain": np.zeros(3)}, {"plain": np.frombuffer(b"[1]", np.uint8)}, {"plain": None}])
def test_what_is_no_state_is_refused(wrong):
    env = made("circle ideal", LANES)
    with pytest.raises(ValueError, match="state is of another environment: 'plain' is missing or damaged"):
        env.set_state(wrong)


def test_arrays_that_are_one_stay_one():
    class Part:
        def __init__(self):
            self.one = self.two = np.zeros(3)

    part, state = Part(), None
    part.one[:] = 5.0
    state = take_state({"part": part})
    other = Part()
    give_state({"part": other}, state)
    assert other.one is other.two
    np.testing.assert_array_equal(other.two, 5.0)
