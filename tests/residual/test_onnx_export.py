"""The exported policy is the policy: PyTorch, NumPy and onnxruntime agree, and the file says what it is."""

import json
import re
import sys
from dataclasses import replace

import gymnasium
import numpy as np
import onnx
import onnxruntime
import pytest
import torch

import agents
from agents.policy import onnx_export
from agents.policy.controller import ResidualController
from agents.policy.files import Policy
from agents.policy.onnx_export import FORMAT, TOLERANCE, PolicyModule, export_onnx
from agents.residual.corrected import action_names, observation_names
from agents.residual.settings import ResidualSettings
from baselines.network import PolicyNetwork
from tests.console import call
from tests.residual.policies import ENVIRONMENT, SETTINGS, network, policy


def exported(policy, folder) -> onnxruntime.InferenceSession:
    export_onnx(policy, folder / "policy.onnx")
    return onnxruntime.InferenceSession(folder / "policy.onnx", providers=["CPUExecutionProvider"])


def assert_same(session, policy, observations):
    """What onnxruntime, PyTorch and NumPy make of the observations; returns the actions."""
    actions = session.run(["action"], {"observation": observations})[0]
    with torch.no_grad():
        by_torch = PolicyModule(policy.network)(torch.from_numpy(observations))[0].numpy()
    assert actions.dtype == by_torch.dtype == np.float32
    assert actions.shape == (len(observations), policy.settings.size)
    np.testing.assert_allclose(actions, by_torch, rtol=0, atol=TOLERANCE)
    np.testing.assert_allclose(actions, policy.network.actions(observations), rtol=0, atol=TOLERANCE)
    return actions


@pytest.mark.parametrize(("hidden", "squashed"), [((16,), False), ((), True)])
def test_a_memory_goes_in_and_comes_out(tmp_path, hidden, squashed):
    made = policy(hidden=hidden, squashed=squashed, cells=6)
    session = exported(made, tmp_path)
    (_, taken), (_, given) = session.get_inputs(), session.get_outputs()
    for one, name in ((taken, "memory"), (given, "next_memory")):
        assert (one.name, one.type, one.shape) == (name, "tensor(double)", ["batch", 6])
    rng, act = np.random.default_rng(6), made.network.acting()
    memory = np.zeros((9, 6))
    for _ in range(40):
        seen = (made.network.mean + rng.normal(size=(9, made.network.inputs))).astype(np.float32)
        actions, memory = session.run(None, {"observation": seen, "memory": memory})
        np.testing.assert_allclose(actions, act(seen), rtol=0, atol=TOLERANCE)
    assert np.ptp(memory) > 0.5


@pytest.mark.parametrize("squashed", [False, True])
@pytest.mark.parametrize("hidden", [(64, 64), (), (5, 6, 7)])
def test_random_and_extreme_observations_make_the_same_actions(tmp_path, squashed, hidden):
    made = policy(squashed=squashed, hidden=hidden)
    session = exported(made, tmp_path)
    largest = np.finfo(np.float32).max
    values = np.array([0.0, -0.0, 1e-40, 10.0, -10.0, 1e9, -1e9, largest, -largest, np.inf, -np.inf], np.float32)
    inputs = made.network.inputs
    alike = np.repeat(values[:, None], inputs, axis=1)
    rng = np.random.default_rng(3)
    mixed, near = rng.choice(values, (3000, inputs)), made.network.mean + rng.normal(size=(2000, inputs))
    actions = assert_same(session, made, np.concatenate([alike, mixed, near.astype(np.float32)]))
    assert len(np.unique(actions[-2000:].round(3), axis=0)) > 1000
    assert (np.abs(actions) <= 1.0).all()
    # A sensor that says nothing is not made into an action.
    alike[:, 3] = np.nan
    assert np.isnan(session.run(None, {"observation": alike})[0]).all()


def test_an_input_that_hardly_varies_is_normalised_in_double_precision(tmp_path):
    # The nearest single to 0.1 is 1.5e-9 off; over a standard deviation of 1e-4 that is 1.5e-5.
    made = policy(hidden=())
    constant = np.full(made.network.inputs, 0.1)
    ones = (np.full_like(made.network.layers[0][0], 0.5), np.zeros(SETTINGS.size, np.float32))
    made = replace(made, network=PolicyNetwork(constant, np.zeros_like(constant), (ones,)))
    actions = assert_same(exported(made, tmp_path), made, constant.astype(np.float32)[None])
    np.testing.assert_allclose(actions, 0.5 * len(constant) * (np.float64(np.float32(0.1)) - 0.1) / 1e-4, rtol=1e-5)
    assert abs(actions).min() > 100 * TOLERANCE


@pytest.mark.parametrize(
    "settings",
    [
        *(ResidualSettings(impedance=impedance) for impedance in ("fixed", "variable_kp", "variable")),
        ResidualSettings(law="none", policy_period=0.02, time_constant=0.1),
    ],
    ids=["fixed", "variable_kp", "variable", "none"],
)
def test_the_file_says_what_it_is(tmp_path, settings):
    session = exported(policy(settings), tmp_path)
    about = session.get_modelmeta().custom_metadata_map
    assert set(about) == {"format", "environment", "settings", "observations", "actions"}
    assert (about["format"], about["environment"]) == (FORMAT, ENVIRONMENT)
    assert ResidualSettings(**json.loads(about["settings"])) == settings
    assert tuple(json.loads(about["actions"])) == action_names(settings)
    env = gymnasium.make(ENVIRONMENT, **settings.to_dict())
    names = tuple(json.loads(about["observations"]))
    assert names == observation_names(settings) == env.unwrapped.observation_names
    (taken,), (given,) = session.get_inputs(), session.get_outputs()
    assert (taken.name, taken.type, taken.shape) == ("observation", "tensor(float)", ["batch", len(names)])
    assert (given.name, given.type, given.shape) == ("action", "tensor(float)", ["batch", settings.size])


def test_the_same_policy_makes_the_same_file_in_one_piece(tmp_path):
    for name in ("one", "other"):
        result = export_onnx(policy(), tmp_path / name / "policy.onnx")
    one, other = ((tmp_path / name / "policy.onnx").read_bytes() for name in ("one", "other"))
    assert one == other
    assert result.size == len(one)
    assert result.observations >= 1000
    assert max(result.from_torch, result.from_numpy) <= TOLERANCE
    assert [path.name for path in (tmp_path / "one").iterdir()] == ["policy.onnx"]


def tampered(module, *sizes):
    """The model with one bias a little off."""
    model = TRACED(module, *sizes)
    bias = next(part for part in model.graph.initializer if part.name == "last.0.bias")
    values = onnx.numpy_helper.to_array(bias) + 3e-5
    bias.CopyFrom(onnx.numpy_helper.from_array(values, bias.name))
    return model


TRACED = onnx_export.traced


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("traced", tampered, r"actions differ from PyTorch's by \S+e-05; allowed: 1.19209e-07"),
        ("CLIP", 5.0, r"actions differ from NumPy's by \S+; allowed: 1.19209e-07"),
        ("EPSILON", float("nan"), "actions differ from PyTorch's by nan; allowed: 1.19209e-07"),
    ],
)
def test_a_file_that_is_not_the_policy_is_not_written(tmp_path, monkeypatch, name, value, message):
    path = tmp_path / "deeper" / "policy.onnx"
    monkeypatch.setattr(onnx_export, name, value)
    with pytest.raises(ValueError, match=message):
        export_onnx(policy(), path)
    assert not path.parent.exists()


def test_a_network_of_other_settings_is_refused(tmp_path):
    variable = ResidualSettings(impedance="variable")
    with pytest.raises(ValueError, match="policy maps 32 to 2 numbers; allowed: 38 to 5"):
        export_onnx(Policy(network(), ENVIRONMENT, variable, {}), tmp_path / "policy.onnx")
    assert list(tmp_path.iterdir()) == []


def test_the_command_writes_beside_the_policy_or_where_it_is_told(folder, tmp_path, monkeypatch, capsys):
    status, printed, complaint = call("export", monkeypatch, capsys, "--to", "onnx", folder)
    assert (status, complaint) == (0, "")
    written = folder / "policy.onnx"
    assert f"{written}: {written.stat().st_size} bytes, 32 observation entries to 2 actions" in printed
    assert "over 3000 observations" in printed
    assert re.search(r": \S+ from PyTorch, \S+ from NumPy; allowed: 1.19209e-07\n", printed)
    elsewhere = tmp_path / "new" / "folder" / "mine.onnx"
    status, printed, complaint = call("export", monkeypatch, capsys, "--to", "onnx", folder, "--out", elsewhere)
    assert (status, complaint) == (0, "")
    assert str(elsewhere) in printed
    assert elsewhere.read_bytes() == written.read_bytes()
    # The folder is still a policy's.
    ResidualController(policy=folder)


@pytest.mark.parametrize("missing", ["onnx", "onnxruntime", "torch"])
def test_a_missing_extra_is_named(folder, monkeypatch, capsys, missing):
    monkeypatch.delitem(sys.modules, "agents.policy.onnx_export")
    monkeypatch.delattr(agents.policy, "onnx_export")
    monkeypatch.setitem(sys.modules, missing, None)
    status, printed, complaint = call("export", monkeypatch, capsys, "--to", "onnx", folder)
    assert (status, printed, complaint.count("\n")) == (2, "", 1)
    assert missing in complaint
    assert "extras agents and onnx: pip install -e '.[agents,onnx]'" in complaint
