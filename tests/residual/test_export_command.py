"""``birthsim export --to onnx``: where it writes, and which extras it names."""

import re
import sys

import pytest

import agents
from agents.policy.controller import ResidualController
from tests.console import call


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
    assert "extras agents and onnx: pip install 'birthsim[agents,onnx]'" in complaint
