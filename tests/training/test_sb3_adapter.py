"""Stable-Baselines3's view of a native vector environment: the same rollouts, ends as its own wrappers report them; and what
wrappers of ours change: a learner's shifted rewards are the same problem, a privileged one sees the true figures."""

import copy
import pickle

import gymnasium
import numpy as np
import pytest
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor

from agents.residual.privileged import TRUE_PARAMETERS, true_parameters
from agents.training.sb3.adapter import SB3VecEnv
from agents.training.sb3.privileged import Privileged

PROBE, RESIDUAL = "BirthSIM/Probe-v3", "BirthSIM/CircleResidual-v2"
SLAM = np.array([[0, 0, 1, -1], [0, 0, 0, 0], [0.02, -0.02, 0.01, 0]], np.float32)
"""Lane 0 runs into an end stop after some tenths of a second, the others live until their time is over."""


def native(name=PROBE, lanes=3, **arguments):
    return gymnasium.make_vec(
        name, num_envs=lanes, **{"duration": 0.6, "randomize": True, "autoreset_mode": "SameStep", **arguments}
    )


def adapted(*args, **arguments) -> SB3VecEnv:
    return SB3VecEnv(native(*args, **arguments))


def seeded(env, seed):
    env.seed(seed)
    return env.reset()


def test_rollouts_and_ends_are_those_of_stable_baselines_own_vectorization():
    env, own = adapted(), DummyVecEnv([lambda: Monitor(gymnasium.make(PROBE, duration=0.6, randomize=True))] * 3)
    np.testing.assert_array_equal(seeded(env, 4), seeded(own, 4))
    ends = set()
    for _ in range(150):
        observation, rewards, dones, infos = env.step(SLAM)
        expected, paid, ended, theirs = own.step(SLAM)
        np.testing.assert_array_equal(observation, expected)
        np.testing.assert_array_equal(rewards, paid)
        np.testing.assert_array_equal(dones, ended)
        for lane, (info, its) in enumerate(zip(infos, theirs, strict=True)):
            assert info.get("TimeLimit.truncated") is its["TimeLimit.truncated"]
            assert ("episode" in info) == bool(dones[lane])
            assert "no such entry" not in info
            assert info.get("cost", 7.0) == its["cost"]
            assert set(info) == set(its)
            for name in its.keys() - {"episode"}:
                np.testing.assert_array_equal(info[name], its[name], strict=True)
                assert type(info[name]) is type(its[name]), name
            if not dones[lane]:
                assert copy.deepcopy(info).keys() == pickle.loads(pickle.dumps(info)).keys() == {**info}.keys() == its.keys()
                continue
            # Monitor rounds the return to six digits.
            assert info["episode"] == {"r": pytest.approx(its["episode"]["r"], abs=1e-6), "l": its["episode"]["l"]}
            ends.add((lane, info["TimeLimit.truncated"]))
    assert ends == {(0, False), (1, True), (2, True)}


def test_a_seed_counts_for_one_reset_and_the_next_episode_differs():
    env, base = adapted(RESIDUAL), native(RESIDUAL)
    first, second = seeded(env, 7), env.reset()
    np.testing.assert_array_equal(first, base.reset(seed=7)[0])
    np.testing.assert_array_equal(second, base.reset()[0])
    assert not np.array_equal(first, second)
    np.testing.assert_array_equal(seeded(env, 7), first)
    # Stable-Baselines3's convention: lane i gets seed + i, as the native environment has it.
    np.testing.assert_array_equal(seeded(env, 8)[:2], first[1:])
    assert len(np.unique(first, axis=0)) == 3


def test_a_reset_in_mid_episode_starts_return_and_length_anew():
    env = adapted()
    seeded(env, 0)
    for _ in range(20):
        env.step(SLAM)
    env.reset()
    infos = [env.step(np.zeros((3, 4), np.float32))[3] for _ in range(60)]
    assert [info["episode"]["l"] for info in infos[-1]] == [60, 60, 60]
    assert not any("episode" in info for row in infos[:-1] for info in row)


def test_attributes_are_read_for_the_lanes_asked_for_and_never_set():
    env = adapted(RESIDUAL)
    assert env.get_attr("steps") == [60] * 3
    assert env.get_attr("steps", 1) == [60]
    assert env.get_attr("steps", [0, 2]) == [60, 60]
    with pytest.raises(AttributeError):
        env.get_attr("nothing_like_it")
    with pytest.raises(NotImplementedError, match=r"set_attr\('steps'\).*share one environment"):
        env.set_attr("steps", 3)
    with pytest.raises(NotImplementedError, match=r"env_method\('reset'\).*share one environment"):
        env.env_method("reset")
    assert env.get_attr("steps") == [60] * 3
    assert env.env_is_wrapped(Monitor) == [False] * 3
    assert env.env_is_wrapped(Monitor, [1]) == [False]


def test_frames_come_from_the_lanes(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = adapted(RESIDUAL, lanes=2, render_mode="rgb_array")
    env.reset()
    frames = env.get_images()
    assert [frame.shape for frame in frames] == [(480, 640, 3)] * 2
    assert env.render().shape[2] == 3
    env.close()
    silent = adapted(RESIDUAL, lanes=2)
    silent.reset()
    assert silent.get_images() == [None, None]


def test_every_observation_has_the_figures_of_its_own_episode():
    lanes = gymnasium.make_vec(
        "BirthSIM/ProbeResidual-v3", num_envs=4, randomize=True, autoreset_mode="SameStep", duration=0.05
    )
    env = Privileged(SB3VecEnv(lanes, staggered=True))
    env.seed(0)
    seen, ends = env.reset(), 0
    assert seen.shape == (4, *env.observation_space.shape)
    for _ in range(12):
        before = seen[:, -TRUE_PARAMETERS:]
        seen, _, ended, infos = env.step(np.zeros((4, 2), np.float32))
        np.testing.assert_array_equal(seen[:, -TRUE_PARAMETERS:], true_parameters(lanes))
        assert not ended.all(), "they are staggered"
        assert (seen[~ended, -TRUE_PARAMETERS:] == before[~ended]).all()
        for lane in np.flatnonzero(ended):
            np.testing.assert_array_equal(infos[lane]["terminal_observation"][-TRUE_PARAMETERS:], before[lane])
            assert (seen[lane, -TRUE_PARAMETERS:] != before[lane]).any()
            ends += 1
    assert ends >= 8
    env.close()


def test_a_monitor_finds_its_keywords_and_an_attribute_is_a_single_environments():
    env = VecMonitor(adapted(duration=0.05), info_keywords=("cost", "is_success", "position"))
    own = DummyVecEnv([lambda: gymnasium.make(PROBE, duration=0.05, randomize=True)] * 3)
    seeded(env, 4), seeded(own, 4)
    for _ in range(5):
        *_, dones, infos = env.step(np.zeros((3, 4), np.float32))
        own.step(np.zeros((3, 4), np.float32))
    assert dones.all()
    assert {"cost", "is_success", "position", "r", "l"} <= set(infos[0]["episode"])
    assert [info["tracking_error"].shape for info in env.venv.reset_infos] == [(2,)] * 3
    assert env.get_attr("duration") == own.get_attr("duration") == [0.05] * 3
    for name in vars(type(own.envs[0].unwrapped)).keys() | {
        "dt",
        "parameters",
        "steps",
        "observation_names",
        "action_space",
        "spec",
    }:
        if not name.startswith("_") and not callable(getattr(own.envs[0].unwrapped, name)):
            ours, theirs = env.get_attr(name), own.get_attr(name)
            assert len(ours) == 3
            assert all(type(one) is type(other) for one, other in zip(ours, theirs, strict=True)), name
    for one, other in zip(env.get_attr("measurement"), own.get_attr("measurement"), strict=True):
        np.testing.assert_array_equal(one.position, other.position, strict=True)
        np.testing.assert_array_equal(one.time, other.time, strict=True)
    for one, other in zip(env.get_attr("reference"), own.get_attr("reference"), strict=True):
        np.testing.assert_array_equal(one.rows, other.rows, strict=True)
    assert env.get_attr("scene", 1)[0].time == own.get_attr("scene", 1)[0].time
    with pytest.raises(AttributeError, match="no_such"):
        env.get_attr("no_such")
