"""A privileged training sees the true figures in every observation; its policy runs in no controller."""

import gymnasium
import numpy as np
import pytest

from agents.policy.controller import ResidualController
from agents.policy.files import load_policy
from agents.residual.privileged import FIGURES, true_figures
from agents.residual.settings import ResidualSettings
from agents.training.configuration import TrainingSettings
from agents.training.privileged import Privileged
from agents.training.sb3_adapter import SB3VecEnv
from agents.training.trainer import train


def test_every_observation_has_the_figures_of_its_own_episode():
    lanes = gymnasium.make_vec(
        "BirthSIM/ProbeResidual-v2", num_envs=4, randomize=True, autoreset_mode="SameStep", duration=0.05
    )  # fmt: skip
    env = Privileged(SB3VecEnv(lanes, staggered=True))
    env.seed(0)
    seen, ends = env.reset(), 0
    assert seen.shape == (4, *env.observation_space.shape)
    for _ in range(12):
        before = seen[:, -FIGURES:]
        seen, _, ended, infos = env.step(np.zeros((4, 2), np.float32))
        np.testing.assert_array_equal(seen[:, -FIGURES:], true_figures(lanes))
        assert (seen[~ended, -FIGURES:] == before[~ended]).all()
        for lane in np.flatnonzero(ended):
            np.testing.assert_array_equal(infos[lane]["terminal_observation"][-FIGURES:], before[lane])
            assert (seen[lane, -FIGURES:] != before[lane]).any()
            ends += 1
    assert ends >= 8
    env.close()


def test_a_privileged_policy_is_trained_and_refused_by_the_controller(tmp_path):
    settings = TrainingSettings(
        "BirthSIM/ProbeResidual-v2", steps=64, lanes=4, rollout=8, batch=32, validation_lanes=4, validations=1, privileged=True
    )  # fmt: skip
    train(settings, ResidualSettings(), tmp_path)
    policy = load_policy(tmp_path)
    assert policy.training["privileged"] is True
    with pytest.raises(
        ValueError, match=rf"maps {policy.network.inputs} to 2 numbers; allowed: {policy.network.inputs - FIGURES}"
    ):
        ResidualController(policy=tmp_path)
