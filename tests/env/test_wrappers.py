"""Wrappers of Gymnasium that use more of an environment than arrays in boxes: pictures, information, specification, ends."""

import gymnasium
import numpy as np
import pytest
from gymnasium import wrappers
from gymnasium.wrappers import vector

import birthsim_env  # noqa: F401  registers the ids

PLAIN = ("Autoreset", "NumpyToTorch", "PassiveEnvChecker", "RecordEpisodeStatistics", "RenderCollection")
SINGLE = {
    **{name: getattr(wrappers, name) for name in PLAIN},
    "AddRenderObservation": lambda env: wrappers.AddRenderObservation(env, render_only=True),
    "TimeAwareObservation": lambda env: wrappers.TimeAwareObservation(wrappers.TimeLimit(env, 100)),
}
INFORMED = ("DictInfoToList", "RecordEpisodeStatistics")
"""Wrappers that take the information of lanes that have ended, in either mode."""
VECTOR = {
    **{name: getattr(vector, name) for name in (*INFORMED, "NormalizeReward", "NumpyToTorch")},
    "VectorizeTransformObservation": lambda env: vector.VectorizeTransformObservation(env, wrappers.FlattenObservation),
}


def walk(env, name):
    """Two episodes of random actions of a wrapped environment."""
    env.action_space.seed(0)
    for seed in range(2):
        env.reset(seed=seed)
        for _ in range(10):
            action = 0.1 * env.action_space.sample()
            if name == "NumpyToTorch":
                import torch

                action = torch.as_tensor(action)
            observation, reward, _, _, _ = env.step(action)
            assert np.isfinite(np.asarray(observation)).all()
            assert np.isfinite(np.asarray(reward)).all()
            assert np.shape(observation) == env.observation_space.shape
    env.close()


@pytest.mark.parametrize("name", SINGLE)
@pytest.mark.parametrize("kind", ["", "Residual"])
def test_single(name, kind):
    env = gymnasium.make(f"BirthSIM/Circle{kind}-v1", duration=0.2, render_mode="rgb_array", picture_size=(320, 240))
    walk(SINGLE[name](env), name)


@pytest.mark.parametrize(
    ("name", "mode"), [*((name, "NextStep") for name in VECTOR), *((name, "SameStep") for name in INFORMED)]
)
def test_vector(name, mode):
    env = gymnasium.make_vec("BirthSIM/Circle-v1", num_envs=3, duration=0.08, autoreset_mode=mode)
    walk(VECTOR[name](env), name)
