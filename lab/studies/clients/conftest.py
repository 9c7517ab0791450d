"""What the clients' tests share. Nothing here imports the project's other tests: the environments hold the wheel alone."""

import re
import subprocess
import sys
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import birthsim_env

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"


def pytest_sessionstart():
    if not Path(birthsim_env.__file__).is_relative_to(sys.prefix):
        pytest.exit(f"birthsim_env comes from {birthsim_env.__file__}, not from the wheel in {sys.prefix}", 3)


@pytest.fixture
def example():
    """Runs a file of ``examples/`` on the stiffness test and returns the scores it prints."""

    def run(name, steps=45_000):
        command = [sys.executable, "-P", str(EXAMPLES / f"{name}.py"), "BirthSIM/Probe-v3", str(steps)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=1200, check=False)
        assert done.returncode == 0, done.stderr[-3000:]
        return [
            float(paid) for paid in re.findall(r"^\s*[\d,]+ steps: .* normalised return (-?\d+)$", done.stdout, re.MULTILINE)
        ]

    return run


@pytest.fixture
def mean_return():
    """The mean return of ``policy(observation) -> action`` over the same four drawn worlds of the circle.

    Shut valves get 674 on the nominal circle, the paper's law 1252; an untrained network is near the valves.
    """

    def measure(policy, episodes=4):
        env = gym.make("BirthSIM/Circle-v2", randomize=True)
        total = []
        for seed in range(1000, 1000 + episodes):
            observation, paid, over = env.reset(seed=seed)[0], 0.0, False
            while not over:
                observation, reward, terminated, truncated, _ = env.step(np.asarray(policy(observation), dtype=np.float32))
                paid, over = paid + reward, terminated or truncated
            total.append(paid)
        return float(np.mean(total))

    return measure
