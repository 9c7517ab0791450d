"""The example runs the exported policy as the controller does."""

import runpy
import subprocess
import sys

import gymnasium
import numpy as np
import pytest

from agents.policy.controller import ResidualController
from agents.policy.files import save_policy
from agents.policy.onnx_export import TOLERANCE
from birthsim_env import Parameters
from tests.console import ROOT
from tests.residual.policies import policy
from tests.residual.test_onnx_export import exported

EXAMPLE = ROOT / "examples" / "onnx_policy.py"


def positions(controller, sensors):
    """Of the end effector (T, 2), m, over a second of one rig under the controller."""
    env = gymnasium.make("BirthSIM/Probe-v3", policy_period=1e-3, randomize=True, sensors=sensors)
    env.reset(seed=4)
    controller.reset()
    path = []
    for _ in range(1000):
        openings = controller.command(env.unwrapped.measurement, env.unwrapped.reference)
        assert openings.shape == (4,)
        path.append(env.step(openings)[4]["position"])
    return np.array(path)


# Actions off by 1e-6 at random, which is what an export may be off by, moved the rig by up to 0.2 um, and with sensors that are
# late and rough, where a random policy hunts, by up to 2 um. Ten times that is allowed.
@pytest.mark.parametrize(("sensors", "close"), [("ideal", 2e-6), ("lab", 2e-5)])
@pytest.mark.parametrize(("squashed", "cells"), [(False, 0), (True, 0), (False, 8)])
def test_the_example_moves_the_rig_as_the_controller_does(tmp_path, squashed, cells, sensors, close):
    made = policy(squashed=squashed, cells=cells)
    save_policy(made, tmp_path)
    exported(made, tmp_path)
    rig = Parameters()
    expected = positions(ResidualController(rig, tmp_path), sensors)
    assert np.ptp(expected, axis=0).max() > 1e-3
    mine, environment = runpy.run_path(str(EXAMPLE))["onnx_controller"](tmp_path / "policy.onnx", rig)
    assert environment == "BirthSIM/Probe-v3"
    np.testing.assert_allclose(positions(mine, sensors), expected, rtol=0, atol=close)


def test_the_example_forgets_lanes(tmp_path):
    made = policy(cells=8)
    session = exported(made, tmp_path)
    theirs, own = runpy.run_path(str(EXAMPLE))["OnnxPolicy"](session), made.network.acting()
    seen = np.random.default_rng(0).normal(size=(6, 4, made.network.inputs)).astype(np.float32)
    for k, rows in enumerate(seen):
        np.testing.assert_allclose(theirs(rows), own(rows), rtol=0, atol=TOLERANCE)
        lanes = np.arange(4) == k if k < 4 else None
        theirs.reset(lanes), own.reset(lanes)


@pytest.mark.slow
def test_the_example_runs_without_torch_and_prints_a_table(tmp_path):
    exported(policy(), tmp_path)
    program = (
        "import runpy, sys\n"
        "sys.modules['torch'] = sys.modules['onnx'] = sys.modules['stable_baselines3'] = None\n"
        f"sys.argv = ['onnx_policy.py', {str(tmp_path / 'policy.onnx')!r}]\n"
        f"runpy.run_path({str(EXAMPLE)!r}, run_name='__main__')\n"
    )
    line = [sys.executable, "-W", "error", "-c", program]
    done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    rows = {row.split("|")[1].strip(): row.split("|")[3].strip() for row in done.stdout.splitlines()}
    assert rows["metric"].startswith("with the policy")
    assert 0 < float(rows["settled_rms"]) < 100
    assert rows["lost episodes"].endswith(" of 8")
