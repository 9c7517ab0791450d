"""The example runs the exported policy as the controller does."""

from __future__ import annotations

import runpy
import subprocess
import sys

import gymnasium
import numpy as np
import pytest

from agents.policy.controller import ResidualController
from agents.policy.files import save_policy
from agents.policy.onnx_export import PolicyModule
from birthsim_env import Parameters
from tests.test_onnx_export import ROOT, exported, network, policy, tampered

EXAMPLE = ROOT / "examples" / "onnx_policy.py"


@pytest.fixture(scope="module")
def example():
    return runpy.run_path(str(EXAMPLE))


class ByNumpy:
    """In place of onnxruntime's session: the network as the controller asks it."""

    def __init__(self, network):
        self.network = network

    def run(self, outputs, inputs):
        return [self.network.actions(inputs["observation"])]


def positions(controller, sensors):
    """Of the end effector (T, 2), m, over a second of one rig under the controller."""
    env = gymnasium.make("BirthSIM/Probe-v1", policy_period=1e-3, randomize=True, sensors=sensors)
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
@pytest.mark.parametrize("squashed", [False, True])
def test_the_example_moves_the_rig_as_the_controller_does(tmp_path, example, squashed, sensors, close):
    made = policy(squashed=squashed)
    save_policy(made, tmp_path)
    exported(made, tmp_path)
    rig = Parameters()
    expected = positions(ResidualController(rig, tmp_path), sensors)
    assert np.ptp(expected, axis=0).max() > 1e-3
    mine = example["OnnxPolicy"](rig, tmp_path / "policy.onnx")
    np.testing.assert_allclose(positions(mine, sensors), expected, rtol=0, atol=close)
    mine.session = ByNumpy(made.network)
    np.testing.assert_array_equal(positions(mine, sensors), expected)


def test_the_example_begins_anew_after_a_reset(tmp_path, example):
    exported(policy(), tmp_path)
    controller = example["OnnxPolicy"](Parameters(), tmp_path / "policy.onnx")
    env = gymnasium.make("BirthSIM/Probe-v1", policy_period=1e-3)
    runs = []
    for steps in (25, 40):
        env.reset(seed=4)
        controller.reset()
        openings = []
        for _ in range(steps):
            openings.append(controller.command(env.unwrapped.measurement, env.unwrapped.reference))
            env.step(openings[-1])
        runs.append(np.array(openings[:25]))
    np.testing.assert_array_equal(*runs)


def test_the_example_runs_without_torch_and_prints_errors_and_times(tmp_path):
    exported(policy(), tmp_path)
    program = (
        "import runpy, sys\n"
        "sys.modules['torch'] = sys.modules['onnx'] = sys.modules['stable_baselines3'] = None\n"
        f"sys.argv = ['onnx_policy.py', {str(tmp_path / 'policy.onnx')!r}, '--seconds', '0.7', '--seed', '3']\n"
        f"runpy.run_path({str(EXAMPLE)!r}, run_name='__main__')\n"
    )
    line = [sys.executable, "-W", "error", "-c", program]
    done = subprocess.run(line, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    printed = done.stdout.splitlines()
    assert printed[0] == "BirthSIM/Probe-v1, 0.7 s, rig and experiment of seed 3; settled RMS error:"
    rows = {line[:28].strip(): line[28:].split() for line in printed[1:]}
    for name in ("backstepping", "with the policy"):
        assert 0 < float(rows[name][0]) < 100
        assert rows[name][1] == "mm"
    asked = "when the policy is asked"
    for name, steps in (("all", 700), (asked, 70)):
        mean, _, worst, late, _, count, processor = (word if word == "of" else float(word) for word in rows[name])
        assert 0 < mean <= worst
        assert 0 <= late <= count == steps
        assert processor > 0
    # Among all steps are those in which the policy is asked, and perhaps a worse one.
    assert all(float(rows[asked][k]) <= float(rows["all"][k]) for k in (2, 3, 6))


@pytest.mark.parametrize("content", [None, b"not a model"])
def test_the_example_refuses_what_is_no_exported_policy(tmp_path, example, content, monkeypatch, capsys):
    path = tmp_path / "other.onnx"
    if content is None:
        model = tampered(PolicyModule(network()), network().inputs)
        path.write_bytes(model.SerializeToString())
    else:
        path.write_bytes(content)
    monkeypatch.setattr(sys, "argv", ["onnx_policy.py", str(path)])
    with pytest.raises(SystemExit) as end:
        example["main"]()
    assert end.value.code == 2
    assert ("is foreign; allowed" if content is None else "other.onnx") in capsys.readouterr().err
