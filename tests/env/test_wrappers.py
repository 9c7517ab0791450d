"""Every wrapper of Gymnasium takes the environments: the single ones take the single, the vector ones the native lanes."""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces, wrappers
from gymnasium.wrappers import vector

import birthsim_env

CIRCLE = "BirthSIM/Circle-v1"
PICTURES = {"render_mode": "rgb_array", "picture_size": (320, 240)}

ELSEWHERE = {
    "vector": "a module",
    "AtariPreprocessing": "of Atari games",
    "JaxToNumpy": "of environments that compute with JAX",
    "JaxToTorch": "of environments that compute with JAX",
    "HumanRendering": "opens a window: below",
    "RecordVideo": "needs moviepy: tests/env/test_video.py",
}
"""Wrappers that are tried elsewhere or have nothing to do here, and why."""


def seen_as(size):
    return spaces.Box(-np.inf, np.inf, size, np.float32)


def drawn(env):
    return wrappers.AddRenderObservation(env, render_only=True)


SINGLE = {
    "DelayObservation": lambda env: wrappers.DelayObservation(env, 3),
    "DtypeObservation": lambda env: wrappers.DtypeObservation(env, np.float32),
    "DiscretizeObservation": lambda env: wrappers.DiscretizeObservation(wrappers.TransformObservation(
        env, lambda seen: seen[:2], spaces.Box(-10, 10, (2,), np.float32)), 5),
    "FilterObservation": None,  # of dictionaries and tuples
    "FlattenObservation": wrappers.FlattenObservation,
    "FrameStackObservation": lambda env: wrappers.FrameStackObservation(env, 4),
    "GrayscaleObservation": lambda env: wrappers.GrayscaleObservation(drawn(env)),
    "TransformObservation": lambda env: wrappers.TransformObservation(env, lambda seen: seen[:3], seen_as((3,))),
    "MaxAndSkipObservation": lambda env: wrappers.MaxAndSkipObservation(env, 2),
    "NormalizeObservation": wrappers.NormalizeObservation,
    "AddRenderObservation": drawn,
    "ResizeObservation": None,  # needs OpenCV
    "ReshapeObservation": lambda env: wrappers.ReshapeObservation(env, (2, env.observation_space.shape[0] // 2)),
    "RescaleObservation": lambda env: wrappers.RescaleObservation(env, np.float32(-1), np.float32(1)),
    "TimeAwareObservation": lambda env: wrappers.TimeAwareObservation(wrappers.TimeLimit(env, 100)),
    "ClipAction": wrappers.ClipAction,
    "DiscretizeAction": lambda env: wrappers.DiscretizeAction(env, 3),
    "TransformAction": lambda env: wrappers.TransformAction(env, lambda action: 0.5 * action, env.action_space),
    "RescaleAction": lambda env: wrappers.RescaleAction(env, np.float32(-5), np.float32(5)),
    "StickyAction": lambda env: wrappers.StickyAction(env, 0.5),
    "RepeatAction": lambda env: wrappers.RepeatAction(env, 2),
    "ClipReward": lambda env: wrappers.ClipReward(env, 0.0, 0.5),
    "TransformReward": lambda env: wrappers.TransformReward(env, lambda reward: 2 * reward),
    "NormalizeReward": wrappers.NormalizeReward,
    "TimeLimit": lambda env: wrappers.TimeLimit(env, 7),
    "Autoreset": wrappers.Autoreset,
    "PassiveEnvChecker": wrappers.PassiveEnvChecker,
    "OrderEnforcing": wrappers.OrderEnforcing,
    "RecordEpisodeStatistics": wrappers.RecordEpisodeStatistics,
    "AddWhiteNoise": lambda env: wrappers.AddWhiteNoise(env, 0.5),
    "ObstructView": lambda env: wrappers.ObstructView(env, 0.5, 10),
    "RenderCollection": wrappers.RenderCollection,
    "ArrayConversion": None,  # between array libraries: NumpyToTorch is one
    "NumpyToTorch": wrappers.NumpyToTorch,
}  # fmt: skip

VECTOR = {
    "VectorizeTransformObservation": lambda env: vector.VectorizeTransformObservation(
        env, wrappers.TransformObservation, func=lambda seen: seen[:3], observation_space=seen_as((3,))),
    "VectorizeTransformAction": lambda env: vector.VectorizeTransformAction(
        env, wrappers.TransformAction, func=lambda action: 0.5 * action, action_space=env.single_action_space),
    "VectorizeTransformReward": lambda env: vector.VectorizeTransformReward(
        env, wrappers.TransformReward, func=lambda reward: 2 * reward),
    "DictInfoToList": vector.DictInfoToList,
    "TransformObservation": lambda env: vector.TransformObservation(env, lambda seen: 2 * seen),
    "FilterObservation": None,
    "FlattenObservation": vector.FlattenObservation,
    "GrayscaleObservation": None,  # of pictures, which a vector environment does not observe
    "ResizeObservation": None,
    "ReshapeObservation": lambda env: vector.ReshapeObservation(env, (4, 6)),
    "RescaleObservation": lambda env: vector.RescaleObservation(env, np.float32(-1), np.float32(1)),
    "DtypeObservation": lambda env: vector.DtypeObservation(env, np.float32),
    "NormalizeObservation": vector.NormalizeObservation,
    "TransformAction": lambda env: vector.TransformAction(env, lambda action: 0.5 * action, env.action_space),
    "ClipAction": vector.ClipAction,
    "RescaleAction": lambda env: vector.RescaleAction(env, np.float32(-5), np.float32(5)),
    "TransformReward": lambda env: vector.TransformReward(env, lambda reward: 2 * reward),
    "ClipReward": lambda env: vector.ClipReward(env, 0.0, 0.5),
    "NormalizeReward": vector.NormalizeReward,
    "RecordEpisodeStatistics": vector.RecordEpisodeStatistics,
    "ArrayConversion": None,
    "NumpyToTorch": vector.NumpyToTorch,
}  # fmt: skip


def test_no_wrapper_is_forgotten():
    assert birthsim_env
    assert set(wrappers.__all__) == set(SINGLE) | set(ELSEWHERE)
    assert set(vector.__all__) == set(VECTOR) | (set(ELSEWHERE) - {"vector", "AtariPreprocessing"})


@pytest.mark.parametrize("name", [name for name, wrap in SINGLE.items() if wrap])
@pytest.mark.parametrize("kind", ["", "Residual"])
def test_single(name, kind):
    env = SINGLE[name](gymnasium.make(f"BirthSIM/Circle{kind}-v1", duration=0.2, **PICTURES))
    env.action_space.seed(0)
    torch = name == "NumpyToTorch"
    for episode in range(2):
        observation, info = env.reset(seed=episode)
        assert torch or observation in env.observation_space
        assert info["is_success"] is False or torch
        for _ in range(5):
            action = env.action_space.sample() * 0.1 if isinstance(env.action_space, spaces.Box) else env.action_space.sample()
            if torch:
                import torch as library

                action = library.as_tensor(action)
            observation, reward, _, _, _ = env.step(action)
            assert torch or observation in env.observation_space
            assert np.isfinite(float(reward))
    env.close()


@pytest.mark.parametrize("name", [name for name, wrap in VECTOR.items() if wrap])
@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_vector(name, mode):
    env = gymnasium.make_vec(CIRCLE, num_envs=3, duration=0.08, autoreset_mode=mode)
    if mode == "SameStep" and (name.endswith("Observation") or name == "NumpyToTorch"):
        # Gymnasium's own limit: they would have to transform ``final_obs`` too.
        with pytest.raises((ValueError, BufferError), match=r"SAME_STEP|DLPack only supports"):
            _run(VECTOR[name](env), name)
        return
    _run(VECTOR[name](env), name)


def _run(env, name):
    env.reset(seed=0)
    for _ in range(20):
        action = env.action_space.sample() * 0.1
        if name == "NumpyToTorch":
            import torch

            action = torch.as_tensor(action)
        observation, reward, _, _, _ = env.step(action)
        assert np.isfinite(np.asarray(observation)).all()
        assert np.isfinite(np.asarray(reward)).all()
        assert observation.shape == env.observation_space.shape
    env.close()
