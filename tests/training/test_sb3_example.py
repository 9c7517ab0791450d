"""examples/sb3_ppo.py: it learns in lanes, saves its model, and ends with the score that ``birthsim.score`` gives."""

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
    assert re.search(r"^ +40,960 steps: episodes of \d+ steps, score -?\d+$", done.stdout, re.MULTILINE)
    assert algorithm_in(file) == "PPO"
    said = re.search(r"^probe-ideal +(-?[\d.]+) \[", done.stdout, re.MULTILINE)
    row = birthsim.score(file, PROBE, progress=False).row
    assert (row["split"], row["kinds"], row["tasks"][0]["episodes"]) == ("test", ["PPO"], 64)
    assert said is not None, done.stdout
    assert said[1] == f"{row['tasks'][0]['score']['value']:.1f}"
    assert "paper's law" in done.stdout
