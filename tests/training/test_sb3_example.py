"""examples/sb3_ppo.py and sb3_others.py: they learn in lanes, save a model, and end with the score of ``birthsim.score``."""

import os
import re
import subprocess
import sys

import pytest

import birthsim
from agents.foreign.stable_baselines import algorithm_in
from tests.console import ROOT

PROBE = "BirthSIM/Probe-v3"


@pytest.mark.slow
def test_the_example_saves_a_model_and_prints_its_score(tmp_path):
    file = tmp_path / "deeper" / "model.zip"
    command = [sys.executable, str(ROOT / "examples" / "sb3_ppo.py"), PROBE, "45000", "3", str(file)]
    done = subprocess.run(
        command, env={**os.environ, "PYTHONPATH": str(ROOT)}, cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert re.search(r"^ +40,960 steps: episodes of \d+ steps, normalised return -?\d+$", done.stdout, re.MULTILINE)
    assert algorithm_in(file) == "PPO"
    said = re.search(r"^probe-ideal +(-?[\d.]+) \[", done.stdout, re.MULTILINE)
    row = birthsim.score(file, PROBE, progress=False).row
    assert (row["split"], row["kinds"], row["tasks"][0]["episodes"]) == ("test", ["PPO"], 64)
    assert said is not None, done.stdout
    assert said[1] == f"{row['tasks'][0]['score']['value']:.1f}"
    assert len(re.findall(r"^probe-ideal ", done.stdout, re.MULTILINE)) == 2, "that of the paper's controller too"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "algorithm", "steps"),
    [
        ("recurrent-ppo", "RecurrentPPO", 4096),
        ("sac", "SAC", 1600),
        pytest.param("tqc", "TQC", 1600, marks=pytest.mark.weekly),
    ],
)
def test_the_other_algorithms_save_a_model_that_is_scored(tmp_path, name, algorithm, steps):
    file = tmp_path / "model.zip"
    command = [sys.executable, str(ROOT / "examples" / "sb3_others.py"), name, PROBE, str(steps), "3", str(file)]
    done = subprocess.run(
        command, env={**os.environ, "PYTHONPATH": str(ROOT)}, cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert algorithm_in(file) == algorithm
    assert re.search(rf"^{steps:,} steps in \d+ CPU s", done.stdout, re.MULTILINE), done.stdout
    assert re.search(r"^probe-ideal +-?[\d.]+ \[", done.stdout, re.MULTILINE), done.stdout
