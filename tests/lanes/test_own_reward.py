"""examples/own_reward.py: what a wrapper pays on lanes is what the same function of ``info`` is in single environments."""

import os
import re
import runpy
import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest

from tests.console import ROOT

EXAMPLE = ROOT / "examples" / "own_reward.py"
PROBE = "BirthSIM/Probe-v3"


@pytest.mark.parametrize("mode", ["SameStep", "Disabled"])
def test_lanes_pay_what_single_environments_say_through_ends(mode):
    near = runpy.run_path(str(EXAMPLE))["Near"]
    worlds = near(gym.make_vec(PROBE, num_envs=3, randomize=True, duration=0.2, autoreset_mode=mode))
    singles, ends = [gym.make(PROBE, randomize=True, duration=0.2) for _ in range(3)], 0
    worlds.reset(seed=4)
    for lane, env in enumerate(singles):
        env.reset(seed=4 + lane)
    for action in np.random.default_rng(0).uniform(-0.5, 0.5, (50, 3, 4)).astype(np.float32):
        _, paid, terminated, truncated, _ = worlds.step(action)
        ended = terminated | truncated
        for lane, env in enumerate(singles):
            *_, over, cut, info = env.step(action[lane])
            assert ended[lane] == (over or cut)
            assert paid[lane] == pytest.approx(np.exp(-np.hypot(*info["tracking_error"]) / 0.002), rel=1e-12)
            if over or cut:
                env.reset()
        ends += int(ended.sum())
        if mode == "Disabled" and ended.any():
            worlds.reset(options={"reset_mask": ended})
    assert ends == 6


@pytest.mark.slow
def test_the_example_trains_saves_and_prints_a_score(tmp_path):
    file = tmp_path / "near.zip"
    command = [sys.executable, str(EXAMPLE), "4096", str(file)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert file.is_file()
    assert re.search(r"^circle-ideal +-?[\d.]+ \[", done.stdout, re.MULTILINE), done.stdout
