"""The example on tensors of a device; ``lab/studies/clients`` runs those on other libraries."""

import re
import subprocess
import sys

import pytest

from tests.build.targets import need_threads
from tests.console import ROOT


@pytest.mark.slow
def test_a_policy_learns_from_tensors_of_a_device():
    pytest.importorskip("torch")
    need_threads()
    line = [sys.executable, str(ROOT / "examples" / "device_ppo.py"), "host", "BirthSIM/CircleResidual-v2", "110000"]
    said = subprocess.run(line, capture_output=True, text=True, check=True).stdout
    errors = [float(error) for error in re.findall(r"([\d.]+) mm off", said)]
    assert len(errors) == 26
    assert errors[-1] < 0.6 * errors[0]
