"""docs/how-to/wrappers.md: each wrapper works with the autoreset modes that its row names, and Gymnasium refuses the others."""

import re

import gymnasium as gym
import numpy as np
import pytest
import torch
from gymnasium.wrappers import vector

from agents import SB3VecEnv
from tests.console import ROOT

LANES, STEPS = 3, 25
SMALL, LARGE = np.float32(-2), np.float32(2)
WRAPPERS = {
    "RecordEpisodeStatistics": vector.RecordEpisodeStatistics,
    "NormalizeReward": vector.NormalizeReward,
    "ClipReward": lambda env: vector.ClipReward(env, 0.0, 0.5),
    "TransformReward": lambda env: vector.TransformReward(env, lambda reward: 2 * reward),
    "VectorizeTransformReward": lambda env: vector.VectorizeTransformReward(env, gym.wrappers.TransformReward, func=np.sqrt),
    "ClipAction": vector.ClipAction,
    "RescaleAction": lambda env: vector.RescaleAction(env, SMALL, LARGE),
    "TransformAction": lambda env: vector.TransformAction(env, lambda action: action, env.action_space),
    "VectorizeTransformObservation": lambda env: vector.VectorizeTransformObservation(
        env, gym.wrappers.RescaleObservation, min_obs=SMALL, max_obs=LARGE
    ),
    "NormalizeObservation": vector.NormalizeObservation,
    "TransformObservation": lambda env: vector.TransformObservation(env, lambda seen: 2 * seen),
    "RescaleObservation": lambda env: vector.RescaleObservation(env, SMALL, LARGE),
    "FlattenObservation": vector.FlattenObservation,
    "ReshapeObservation": lambda env: vector.ReshapeObservation(env, (4, 6)),
    "DictInfoToList": vector.DictInfoToList,
    "NumpyToTorch": vector.NumpyToTorch,
}
ADAPTED = "in `SB3VecEnv`"


def rows():
    """(wrapper, mode, whether it works) of the page's table."""
    text = (ROOT / "docs" / "how-to" / "wrappers.md").read_text(encoding="utf-8")
    head, _, *body = re.findall(r"^\|(.*)\|$", text, re.MULTILINE)
    modes = [cell.strip().strip('`"') for cell in head.split("|")][1:]
    for line in body:
        name, *said = (cell.strip().strip("`") for cell in line.split("|"))
        yield from ((name, mode, word == "yes") for mode, word in zip(modes, said, strict=True))


ROWS = list(rows())


def made(mode):
    arguments = {"num_envs": LANES, "randomize": True, "duration": 0.1}
    return gym.make_vec("BirthSIM/Probe-v3", autoreset_mode=mode, **arguments)


def run(name, mode):
    """Two and a half episodes of every lane; returns how many ended."""
    action = np.zeros((LANES, 4), np.float32)
    if mode.endswith("SB3VecEnv"):
        worlds = SB3VecEnv(WRAPPERS[name](made("SameStep")), staggered=True)
        worlds.reset()
        return sum(int(worlds.step(action)[2].sum()) for _ in range(STEPS))
    env, ends = WRAPPERS[name](made(mode)), 0
    env.reset(seed=0)
    for _ in range(STEPS):
        _, _, terminated, truncated, _ = env.step(torch.from_numpy(action) if name == "NumpyToTorch" else action)
        ended = np.asarray(terminated) | np.asarray(truncated)
        ends += int(ended.sum())
        if mode == "Disabled" and ended.any():
            env.reset(options={"reset_mask": ended})
    return ends


def test_the_page_has_every_wrapper_that_is_tried():
    assert {name for name, _, _ in ROWS} == set(WRAPPERS)
    assert len({mode for _, mode, _ in ROWS}) == 4


@pytest.mark.parametrize(("name", "mode", "works"), ROWS)
def test_a_wrapper_works_where_the_page_says_so_and_is_refused_elsewhere(name, mode, works):
    if works:
        assert run(name, mode) >= 2 * LANES
        return
    with pytest.raises((ValueError, AttributeError, TypeError, BufferError)):
        run(name, mode)


def test_the_adapter_reaches_through_wrappers():
    worlds = SB3VecEnv(vector.ClipReward(vector.RecordEpisodeStatistics(made("SameStep")), 0.0, 0.5))
    worlds.reset()
    action, paid = np.zeros((LANES, 4), np.float32), []
    for _ in range(4):
        paid.append(worlds.step(action)[1])
    assert max(map(np.max, paid)) == 0.5
    assert worlds.get_attr("steps") == [10] * LANES
    assert worlds.get_attr("measurement")[1].position.shape == (2,)
    state, later = worlds.get_state(), [worlds.step(action)[0] for _ in range(3)]
    worlds.set_state(state)
    np.testing.assert_array_equal([worlds.step(action)[0] for _ in range(3)], later)
    worlds.env_method("set_ranges", False)
    with pytest.raises(AttributeError, match="no_such"):
        worlds.get_attr("no_such")
