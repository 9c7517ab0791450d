"""The example on tensors of a device; ``lab/studies/clients`` runs those on other libraries."""

import re
import subprocess
import sys

import numpy as np
import pytest

from tests.build.targets import need_threads
from tests.console import ROOT


@pytest.mark.slow
@pytest.mark.weekly
def test_a_policy_learns_from_tensors_of_a_device():
    pytest.importorskip("torch")
    need_threads()
    line = [sys.executable, str(ROOT / "examples" / "device_ppo.py"), "host", "BirthSIM/CircleResidual-v2", "110000"]
    said = subprocess.run(line, capture_output=True, text=True, check=True).stdout
    errors = [float(error) for error in re.findall(r"([\d.]+) mm off", said)]
    assert len(errors) == 26
    # Of one update they are 64 lanes over 0.64 s. Measured: 4.6 and 2.3 mm, a ratio of 0.51.
    assert np.mean(errors[-5:]) < 0.7 * np.mean(errors[:5])
