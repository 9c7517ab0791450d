"""Recorded episodes are those of the environment; ``lab/studies/clients/test_offline.py`` has Minari read the files."""

import gymnasium
import numpy as np
import pytest

from birthsim.exports.dataset import LEVELS, Settings, card, made, recorded
from birthsim_env import scores

PROBE, RAIL = "BirthSIM/Probe-v3", "BirthSIM/Rail-v0"


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("environment", [PROBE, RAIL])
def test_an_episode_is_played_again_by_its_seed_and_actions(environment, level):
    """By the single environment, where lanes were recorded side by side; random actions end episodes before their time."""
    env, ended = made(environment, gymnasium.make), 0
    for one in recorded(environment, level, range(5, 8)):
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


def test_on_a_rail_the_expert_drives_the_valves_that_there_are():
    (expert,), (random,) = (list(recorded(RAIL, level, range(5, 6))) for level in ("expert", "random"))
    assert expert.actions.shape[1] == 2
    assert not expert.terminated
    assert expert.rewards.mean() > 2 * random.rewards.mean()


@pytest.mark.parametrize(("environment", "scored"), [(PROBE, True), (RAIL, True), (RAIL, False)])
def test_a_card_tells_scores_only_where_there_are_some(environment, scored, tmp_path, monkeypatch):
    if not scored:
        monkeypatch.setattr(scores, "_scored", dict)  # as for a scenario of another package
    settings = Settings(to="minari", env=environment, level="random", out=tmp_path)
    text = card(settings, "birthsim/some/random-v0", list(recorded(environment, "random", range(5, 6))))
    assert "| return, mean | " in text
    assert ("score" in text) == scored


def test_an_episode_does_not_depend_on_those_beside_it():
    alone, (_, beside) = next(recorded(PROBE, "medium", range(6, 7))), recorded(PROBE, "medium", range(5, 7))
    np.testing.assert_array_equal(alone.actions, beside.actions)
