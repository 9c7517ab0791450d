"""Recorded episodes are those of the environment; ``lab/studies/clients/test_offline.py`` has Minari read the files."""

import gymnasium
import numpy as np
import pytest

from birthsim.exports.dataset import LEVELS, made, recorded

PROBE = "BirthSIM/Probe-v3"


@pytest.mark.parametrize("level", LEVELS)
def test_an_episode_is_played_again_by_its_seed_and_actions(level):
    """By the single environment, where lanes were recorded side by side; random actions end episodes before their time."""
    env, ended = made(PROBE, gymnasium.make, duration=7.0), 0
    for one in recorded(PROBE, level, range(5, 8)):
        np.testing.assert_array_equal(env.reset(seed=one.seed)[0], one.observations[0])
        assert len(one.observations) == len(one.actions) + 1
        for k, action in enumerate(one.actions):
            seen, paid, terminated, truncated, _ = env.step(action)
            np.testing.assert_array_equal(seen, one.observations[k + 1])
            assert paid == one.rewards[k]
            assert (terminated or truncated) == (k == len(one.actions) - 1)
        assert terminated == one.terminated
        ended += terminated
    assert ended == (3 if level == "random" else 0)


def test_an_episode_does_not_depend_on_those_beside_it():
    alone, (_, beside) = next(recorded(PROBE, "medium", range(6, 7))), recorded(PROBE, "medium", range(5, 7))
    np.testing.assert_array_equal(alone.actions, beside.actions)
