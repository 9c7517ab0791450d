"""What a user imports is importable from the packages, wherever it lives."""

from __future__ import annotations

import subprocess
import sys

import pytest

import agents
import baselines
import birthsim_env


@pytest.mark.parametrize("package", [agents, baselines, birthsim_env])
def test_every_public_name_is_there(package):
    assert len(package.__all__) > 5
    for name in package.__all__:
        assert getattr(package, name) is not None
    with pytest.raises(AttributeError, match="has no attribute 'Nobody'"):
        _ = package.Nobody


@pytest.mark.parametrize("package", [agents, baselines])
def test_the_list_is_that_of_the_places(package):
    assert sorted(package.__all__) == sorted(package._PLACES)


def test_importing_a_package_loads_no_torch():
    script = "import sys, agents, baselines, birthsim_env; print('torch' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=300, check=True)
    assert done.stdout.strip() == "False"
