"""A user's own actuation: when it is asked, what a policy sees of its memory, and that its arrays stay its own."""

import gymnasium
import numpy as np
import pytest

from birthsim_env.info import FIELDS
from birthsim_env.observation import SIZE
from birthsim_env.parts.actuation import Actuation

PROBE = "BirthSIM/Probe-v3"


class Leaky(Actuation):
    """Openings of a table; it remembers how often a lane was asked, and its first ``shown`` actions, each at half the rate."""

    def __init__(self, lanes, every_period=True, size=3, shown=1):
        self.every_period, self.size = every_period, size
        self.names = tuple(f"entry {k}" for k in range(size))
        self.memory_names = ("calls, 1000", *(f"smoothed {k}, 1" for k in range(shown)))
        self.calls, self.smooth, self.begun = np.zeros(lanes), np.zeros((shown, lanes)), []
        self.table = np.repeat([[0.02], [-0.02], [0.01], [-0.01]], lanes, axis=1)

    def begin(self, lanes):
        self.begun.append(lanes.copy())
        self.calls[lanes], self.smooth[:, lanes] = 0.0, 0.0

    def accept(self, actions):
        assert actions.shape == (self.size, len(self.calls))
        self.smooth = 0.5 * (self.smooth + actions[: len(self.smooth)])

    def openings(self, plant, measurement, reference):
        self.calls += 1
        return self.table

    def memory(self):
        return np.concatenate([[self.calls / 1000], self.smooth])


@pytest.mark.parametrize("every_period", [True, False])
def test_a_policy_sees_the_memory_after_its_last_action(every_period):
    env = gymnasium.make_vec(PROBE, num_envs=2, actuation=Leaky(2, every_period))
    assert env.single_action_space.shape == (3,)
    assert env.single_observation_space.shape == (SIZE + 5,)
    last = tuple(f"last action: entry {k}" for k in range(3))
    assert env.observation_names[SIZE:] == (*last, "calls, 1000", "smoothed 0, 1")
    observation, _ = env.reset(seed=0)
    np.testing.assert_array_equal(observation[:, SIZE:], 0)
    smooth = np.zeros(2)
    for step, actions in enumerate(np.random.default_rng(0).uniform(-1, 1, (5, 2, 3)).astype(np.float32)):
        observation, _, _, _, infos = env.step(actions)
        smooth = 0.5 * (smooth + actions[:, 0])
        np.testing.assert_array_equal(observation[:, SIZE : SIZE + 3], actions)
        np.testing.assert_allclose(observation[:, SIZE + 3], (step + 1) * (10 if every_period else 1) / 1000, rtol=1e-6)
        np.testing.assert_allclose(observation[:, SIZE + 4], smooth, rtol=1e-6)
        assert set(infos) >= set(FIELDS)


def test_a_lane_that_ends_begins_alone_and_the_single_environment_is_one_lane():
    actuation = Leaky(2)
    table = actuation.table.copy()
    env = gymnasium.make_vec(PROBE, num_envs=2, actuation=actuation, duration=0.05, autoreset_mode="SameStep")
    env.reset(seed=3)
    alone = gymnasium.make(PROBE, actuation=Leaky(1), duration=0.05).unwrapped
    alone.reset(seed=3)
    for _ in range(5):
        observation, _, _, truncated, infos = env.step(np.full((2, 3), 0.5, np.float32))
        expected, _, _, ended, _ = alone.step(np.full(3, 0.5, np.float32))
        np.testing.assert_array_equal(infos["final_obs"][0] if ended else observation[0], expected)
    assert truncated.all()
    np.testing.assert_array_equal(observation[:, SIZE:], 0)
    np.testing.assert_array_equal(actuation.begun, [[True, True], [True, True]])
    np.testing.assert_array_equal(actuation.table, table, "its openings are not written to")


def test_long_actions_and_memories_have_room_up_to_a_length_that_is_said():
    env = gymnasium.make(PROBE, actuation=Leaky(1, size=64, shown=63)).unwrapped
    env.reset(seed=0)
    action = np.linspace(-1, 1, 64).astype(np.float32)
    for share in (0.5, 0.75, 0.875):
        observation, *_ = env.step(action)
        np.testing.assert_array_equal(observation[SIZE : SIZE + 64], action)
        np.testing.assert_allclose(observation[SIZE + 65 :], share * action[:63], rtol=1e-6)
    for size, shown in ((65, 0), (4, 64)):
        with pytest.raises(ValueError, match="allowed: at most 64"):
            gymnasium.make(PROBE, actuation=Leaky(1, size=size, shown=shown))
