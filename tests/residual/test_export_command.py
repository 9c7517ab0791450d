"""``birthsim export``: where it writes, what it says, and what it refuses in one line."""

import re
import sys

import pytest

import agents
from agents.policy.controller import ResidualController
from agents.policy.files import WEIGHTS, save_policy
from tests.console import call
from tests.residual.policies import policy


@pytest.fixture
def folder(tmp_path):
    save_policy(policy(), tmp_path / "policy")
    return tmp_path / "policy"


def refused(monkeypatch, capsys, *arguments):
    """What the command complained about, in one line and with exit status 2."""
    status, printed, complaint = call("export", monkeypatch, capsys, "--to", "onnx", *arguments)
    assert (status, printed) == (2, "")
    assert complaint.startswith("birthsim export: error: ")
    assert complaint.count("\n") == 1
    return complaint


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


def test_what_a_user_can_mend_is_said_in_one_line(folder, tmp_path, monkeypatch, capsys):
    assert "is a folder; allowed: the name of a file" in refused(monkeypatch, capsys, folder, "--out", tmp_path)
    (tmp_path / "file").write_text("")
    refused(monkeypatch, capsys, folder, "--out", tmp_path / "file" / "policy.onnx")
    content = bytearray((folder / WEIGHTS).read_bytes())
    content[100] ^= 1
    (folder / WEIGHTS).write_bytes(content)
    assert f"{WEIGHTS} is" in refused(monkeypatch, capsys, folder)
    assert sorted(path.name for path in folder.iterdir()) == [WEIGHTS]


@pytest.mark.parametrize("missing", ["onnx", "onnxruntime", "torch"])
def test_a_missing_extra_is_named(folder, monkeypatch, capsys, missing):
    monkeypatch.delitem(sys.modules, "agents.policy.onnx_export")
    monkeypatch.delattr(agents.policy, "onnx_export")
    monkeypatch.setitem(sys.modules, missing, None)
    complaint = refused(monkeypatch, capsys, folder)
    assert missing in complaint
    assert "extras agents and onnx: pip install 'birthsim[agents,onnx]'" in complaint
