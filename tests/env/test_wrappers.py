"""Every wrapper of Gymnasium takes the environments: the single ones take the single, the vector ones the native lanes."""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces, wrappers
from gymnasium.wrappers import vector

CIRCLE = "BirthSIM/Circle-v1"
PICTURES = {"render_mode": "rgb_array", "picture_size": (320, 240)}

ELSEWHERE = {
    "vector": "a module",
    "AtariPreprocessing": "of Atari games",
    "ArrayConversion": "between array libraries: NumpyToTorch is one",
    "FilterObservation": "of dictionaries and tuples",
    "HumanRendering": "opens a window: tests/env/test_rendering.py",
    "JaxToNumpy": "of environments that compute with JAX",
    "JaxToTorch": "of environments that compute with JAX",
    "RecordVideo": "needs moviepy: tests/env/test_video.py",
    "ResizeObservation": "needs OpenCV",
}
"""Wrappers that are tried elsewhere or have nothing to do here, and why."""

GIVEN = {
    "AddWhiteNoise": (0.5,),
    "ClipReward": (0.0, 0.5),
    "DelayObservation": (3,),
    "DiscretizeAction": (3,),
    "DtypeObservation": (np.float32,),
    "FrameStackObservation": (4,),
    "MaxAndSkipObservation": (2,),
    "ObstructView": (0.5, 10),
    "RepeatAction": (2,),
    "RescaleAction": (np.float32(-5), np.float32(5)),
    "RescaleObservation": (np.float32(-1), np.float32(1)),
    "StickyAction": (0.5,),
    "TimeLimit": (7,),
    "TransformReward": (lambda reward: 2 * reward,),
}
"""Arguments of wrappers that need them, of both kinds."""


def some(env):
    seen_as = spaces.Box(-10, 10, (2,), np.float32)
    return wrappers.TransformObservation(env, lambda seen: seen[:2], seen_as)


def drawn(env):
    return wrappers.AddRenderObservation(env, render_only=True)


def halved(action):
    return 0.5 * action


SINGLE = {
    "AddRenderObservation": drawn,
    "DiscretizeObservation": lambda env: wrappers.DiscretizeObservation(some(env), 5),
    "GrayscaleObservation": lambda env: wrappers.GrayscaleObservation(drawn(env)),
    "ReshapeObservation": lambda env: wrappers.ReshapeObservation(env, (2, env.observation_space.shape[0] // 2)),
    "TimeAwareObservation": lambda env: wrappers.TimeAwareObservation(wrappers.TimeLimit(env, 100)),
    "TransformAction": lambda env: wrappers.TransformAction(env, halved, env.action_space),
    "TransformObservation": some,
}
VECTOR = {
    "ReshapeObservation": lambda env: vector.ReshapeObservation(env, (4, 6)),
    "TransformAction": lambda env: vector.TransformAction(env, halved, env.action_space),
    "TransformObservation": lambda env: vector.TransformObservation(env, lambda seen: 2 * seen),
    "VectorizeTransformAction": lambda env: vector.VectorizeTransformAction(
        env, wrappers.TransformAction, func=halved, action_space=env.single_action_space
    ),
    "VectorizeTransformObservation": lambda env: vector.VectorizeTransformObservation(env, wrappers.FlattenObservation),
    "VectorizeTransformReward": lambda env: vector.VectorizeTransformReward(
        env, wrappers.TransformReward, func=lambda reward: 2 * reward
    ),
}


def walk(env, name, wrap):
    """Two episodes of random actions of a wrapped environment."""
    env = wrap(env)
    env.action_space.seed(0)
    for seed in range(2):
        env.reset(seed=seed)
        for _ in range(10):
            action = env.action_space.sample()
            if isinstance(env.action_space, spaces.Box):
                action = 0.1 * action
            if name == "NumpyToTorch":
                import torch

                action = torch.as_tensor(action)
            observation, reward, _, _, _ = env.step(action)
            assert np.isfinite(np.asarray(observation)).all()
            assert np.isfinite(np.asarray(reward)).all()
            assert np.shape(observation) == env.observation_space.shape
    env.close()


@pytest.mark.parametrize("name", sorted(set(wrappers.__all__) - set(ELSEWHERE)))
@pytest.mark.parametrize("kind", ["", "Residual"])
def test_single(name, kind):
    env = gymnasium.make(f"BirthSIM/Circle{kind}-v1", duration=0.2, **PICTURES)
    walk(env, name, SINGLE.get(name, lambda env: getattr(wrappers, name)(env, *GIVEN.get(name, ()))))


@pytest.mark.parametrize("name", sorted(set(vector.__all__) - set(ELSEWHERE) - {"GrayscaleObservation"}))
@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_vector(name, mode):
    env = gymnasium.make_vec(CIRCLE, num_envs=3, duration=0.08, autoreset_mode=mode)
    wrap = VECTOR.get(name, lambda env: getattr(vector, name)(env, *GIVEN.get(name, ())))
    if mode == "SameStep" and (name.endswith("Observation") or name == "NumpyToTorch"):
        # Gymnasium's own limit: they would have to transform ``final_obs`` too.
        with pytest.raises((ValueError, BufferError), match=r"SAME_STEP|DLPack only supports"):
            walk(env, name, wrap)
    else:
        walk(env, name, wrap)
