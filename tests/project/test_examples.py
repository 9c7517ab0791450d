"""The examples of ``examples/`` on other libraries are short (``studies/clients`` runs them, and the last is run here)."""

import re
import subprocess
import sys

import pytest

from tests.build.targets import need_threads
from tests.console import ROOT

EXAMPLES = ("sb3_ppo", "cleanrl_ppo", "torchrl_ppo", "rllib_ppo", "device_ppo")


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_is_short(name):
    assert len((ROOT / "examples" / f"{name}.py").read_text(encoding="utf-8").splitlines()) <= 60


@pytest.mark.slow
def test_a_policy_learns_from_tensors_of_a_device():
    pytest.importorskip("torch")
    need_threads()
    line = [sys.executable, str(ROOT / "examples" / "device_ppo.py"), "host", "BirthSIM/CircleResidual-v1", "110000"]
    said = subprocess.run(line, capture_output=True, text=True, check=True).stdout
    errors = [float(error) for error in re.findall(r"([\d.]+) mm off", said)]
    assert len(errors) == 26
    assert errors[-1] < 0.6 * errors[0]
