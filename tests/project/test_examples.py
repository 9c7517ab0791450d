"""The examples of ``examples/`` on other libraries: short trainings that print scores; and the hundred odd rigs."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests import odd_rigs

ROOT = Path(__file__).resolve().parent.parent.parent
PRINTED = re.compile(r"^\s*[\d,]+ steps: episodes of \d+ steps, score -?\d+$", re.MULTILINE)

EXAMPLES = ("sb3_ppo", "cleanrl_ppo", "torchrl_ppo", "rllib_ppo")


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_is_short(name):
    assert len((ROOT / "examples" / f"{name}.py").read_text(encoding="utf-8").splitlines()) <= 60


@pytest.mark.weekly
@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_trains_and_prints_scores(name):
    command = [sys.executable, str(ROOT / "examples" / f"{name}.py"), "BirthSIM/Probe-v1", "45000"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=1200, check=False)
    assert done.returncode == 0, done.stderr[-3000:]
    assert PRINTED.search(done.stdout), done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(900, 908))
def test_an_odd_rig_works_or_is_refused_in_a_line(seed, tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text(odd_rigs.written(seed), encoding="utf-8")
    verdicts = {command: odd_rigs.attempt(command, path, tmp_path) for command in odd_rigs.COMMANDS}
    assert {command: words for command, (verdict, words) in verdicts.items() if verdict == "BAD"} == {}
