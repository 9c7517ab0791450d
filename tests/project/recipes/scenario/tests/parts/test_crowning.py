"""Crowning: how far the head comes, and what holds it back."""

import gymnasium
import numpy as np
import pytest

from baselines import evaluate, make_controller
from birthsim_env import Parameters
from birthsim_env.parts.scenarios import environment_id

CROWNING = environment_id("crowning")


def test_the_head_comes_forward_and_is_held_back_twice():
    env = gymnasium.make(CROWNING)
    _, info = env.reset(seed=0)
    start, held = info["target"], []
    for _ in range(950):
        _, _, _, _, info = env.step(np.zeros(4, np.float32))
        held.append(info["user_force"][0])
    np.testing.assert_allclose(info["target"] - start, (0.03, 0.0), atol=1e-6)
    holds = np.array(held) < -59.9
    assert np.count_nonzero(np.diff(holds.astype(int)) == 1) == 2
    assert min(held) == pytest.approx(-60.0, abs=1e-6)


def test_the_papers_controller_loses_no_episode():
    result = evaluate(
        CROWNING, make_controller("backstepping", Parameters()), "backstepping", 4, 0, progress=False, randomize="scenario"
    )
    assert result.lost == [False] * 4
