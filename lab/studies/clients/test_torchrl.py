"""TorchRL: its checks of an environment, its rollouts on single and native environments, its processes, and our example."""

from functools import partial

import gymnasium as gym
import numpy as np
import pytest
import torch
from torchrl.envs import GymEnv, GymWrapper, ParallelEnv, SerialEnv, StepCounter, TransformedEnv
from torchrl.envs.utils import check_env_specs

NAME = "BirthSIM/Probe-v3"


def native(lanes, **arguments):
    return GymWrapper(gym.make_vec(NAME, num_envs=lanes, randomize=True, autoreset_mode="Disabled", **arguments))


# The module before the colon registers the ids in processes of their own too.
single = partial(GymEnv, f"birthsim_env:{NAME}", randomize=True)


def given(actions):
    """A policy that plays the rows of ``actions`` one after another."""
    rows = iter(actions)

    return lambda observation: torch.as_tensor(next(rows))


@pytest.fixture
def actions():
    return np.random.default_rng(0).uniform(-0.3, 0.3, (30, 2, 4)).astype(np.float32)


@pytest.mark.parametrize("make", [single, lambda: native(2)], ids=["single", "native"])
def test_the_specs_hold(make):
    check_env_specs(make(), seed=0)


def test_a_rollout_is_the_bare_environments(actions):
    env = single()
    env.set_seed(3)
    told = env.rollout(30, given(actions[:, 0]))
    bare = gym.make(NAME, randomize=True)
    # TorchRL resets with the seed at once, and again when the rollout begins.
    bare.reset(seed=3)
    np.testing.assert_array_equal(told["observation"][0].numpy(), bare.reset()[0])
    for k, action in enumerate(actions[:, 0]):
        seen, paid, *_ = bare.step(action)
        np.testing.assert_array_equal(told["next", "observation"][k].numpy(), seen)
        assert told["next", "reward"][k].item() == pytest.approx(paid, rel=1e-6)


def test_native_lanes_are_the_bare_vector_environment(actions):
    env = native(2)
    env.set_seed(3)
    told = env.rollout(30, given(actions))
    bare = gym.make_vec(NAME, num_envs=2, randomize=True, autoreset_mode="Disabled")
    bare.reset(seed=3)
    np.testing.assert_array_equal(told["observation"][:, 0].numpy(), bare.reset()[0])
    for k, action in enumerate(actions):
        np.testing.assert_array_equal(told["next", "observation"][:, k].numpy(), bare.step(action)[0])


def test_processes_give_what_one_process_gives(actions):
    results = []
    for kind in (SerialEnv, ParallelEnv):
        env = kind(2, single)
        env.set_seed(5)
        results.append(env.rollout(30, given(actions)))
        env.close()
    assert torch.equal(results[0]["next", "observation"], results[1]["next", "observation"])


def test_lanes_that_end_begin_again():
    env = TransformedEnv(native(2, max_episode_steps=20), StepCounter())
    env.set_seed(1)
    told = env.rollout(50, break_when_any_done=False)
    assert told["next", "step_count"].squeeze(-1)[0].tolist() == [*range(1, 21), *range(1, 21), *range(1, 11)]
    assert told["next", "truncated"].sum().item() == 4


def test_the_example_trains_and_prints_scores(example):
    scores = example("torchrl_ppo", 100_000)
    assert len(scores) > 4
