"""RL-Zoo: its command trains from a file of ours, evaluates on the way, writes what a later run loads, and plays it."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecNormalize

FILE = Path(__file__).resolve().parent / "rl_zoo_ppo.yml"
NAME = "BirthSIM/Circle-v2"


def command(module, *arguments):
    line = [sys.executable, "-P", "-m", f"rl_zoo3.{module}", "--algo", "ppo", "--env", NAME, "--gym-packages", "birthsim_env"]
    done = subprocess.run([*line, *map(str, arguments)], capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """What the command leaves on the disk."""
    out = tmp_path_factory.mktemp("zoo")
    evaluation = ("--eval-freq", 48_000, "--eval-episodes", 2)
    command("train", "--conf-file", FILE, "-f", out, "--seed", 1, "--num-threads", 1, "--device", "cpu", *evaluation)
    return out


@pytest.fixture(scope="module")
def run(folder):
    (found,) = (path.parent for path in folder.rglob("best_model.zip"))
    return found


def test_it_has_our_settings(run):
    (kept,) = run.rglob("config.yml")
    written = dict(yaml.unsafe_load(kept.read_text(encoding="utf-8")))
    ours = yaml.safe_load(FILE.read_text(encoding="utf-8"))[NAME]
    assert {key: written[key] for key in ours} == ours


def test_its_model_is_better_than_before(run, mean_return):
    (statistics,) = run.rglob("vecnormalize.pkl")
    worlds = VecNormalize.load(str(statistics), make_vec_env(f"birthsim_env:{NAME}", n_envs=1))

    def policy(model):
        return lambda observation: model.predict(worlds.normalize_obs(observation), deterministic=True)[0]

    untrained = mean_return(policy(PPO("MlpPolicy", worlds, seed=1, device="cpu")))
    (last,) = run.glob("BirthSIM*Circle-v2.zip")
    assert mean_return(policy(PPO.load(last, device="cpu"))) > untrained + 200, untrained
    (evaluations,) = run.rglob("evaluations.npz")
    assert np.load(evaluations)["results"].mean() > untrained


def test_its_player_plays_the_model(folder, run):
    words = command("enjoy", "-f", folder, "--no-render", "-n", 3300, "--device", "cpu")
    rewards = [float(number) for number in re.findall(r"Episode Reward: ([\d.]+)", words)]
    assert len(rewards) >= 2
    assert min(rewards) > 500
