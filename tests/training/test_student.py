"""A student remembers what its teacher is told: DAgger on a problem whose answer is known, and the file."""

from __future__ import annotations

import sys

import numpy as np
import pytest
import torch
from agents.training.student_file import NAME, load_student

from agents.commands import distill
from agents.policy.seeds import policy_folders
from agents.residual.settings import ResidualSettings
from agents.training import student as module
from agents.training.configuration import TrainingSettings
from agents.training.student import Student, _learn
from agents.training.trainer import train


def test_a_student_finds_from_the_past_what_it_is_not_told():
    """The right action is the mean of what was seen so far: (T, N) noise about a level that each lane has."""
    torch.manual_seed(0)
    levels = torch.randn(64).clamp(-1, 1)
    seen = levels[:, None] + torch.randn(40, 64, 1)
    right = levels.expand(40, 64)[..., None]
    student = Student(np.zeros(1), np.ones(1), 1, 16)
    adam = torch.optim.Adam(student.parameters(), lr=1e-2)
    for number in range(1, 60):
        _learn(student, adam, [(seen, right, torch.ones(40, 64, dtype=torch.bool))], number)
    act = student.acting()
    by_steps = np.stack([act(now) for now in seen.numpy()])
    with torch.no_grad():
        at_once = student(seen)[0].clamp(-1, 1).numpy()
    np.testing.assert_allclose(by_steps, at_once, atol=1e-5)
    error = np.abs(by_steps - right.numpy()).mean(axis=(1, 2))
    assert error[-5:].mean() < 0.5 * error[0], "what is seen last has the noise of what was seen first"


def test_steps_after_a_loss_teach_nothing():
    torch.manual_seed(0)
    seen, right = torch.randn(5, 4, 1), torch.full((5, 4, 1), 100.0)
    student = Student(np.zeros(1), np.ones(1), 1, 4)
    before = [one.clone() for one in student.parameters()]
    _learn(student, torch.optim.SGD(student.parameters(), lr=1.0), [(seen, right, torch.zeros(5, 4, dtype=torch.bool))], 0)
    assert all(torch.equal(one, other) for one, other in zip(before, student.parameters(), strict=True))


def told(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["distill", *map(str, arguments)])
    distill.main()
    return capsys.readouterr().out


def test_a_student_is_taught_written_and_read(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(module, "LANES", 4)
    settings = TrainingSettings(
        "BirthSIM/ProbeResidual-v2", steps=64, lanes=4, rollout=8, batch=32, validation_lanes=4, validations=1, privileged=True
    )  # fmt: skip
    train(settings, ResidualSettings(force_sensor=False), tmp_path / "teacher")
    out = told(monkeypatch, capsys, "--teacher", tmp_path / "teacher", "--rounds", 2, "--hidden", 3, "--out", tmp_path / "one")
    assert out.count("round") == 2
    found = load_student(tmp_path / "one")
    assert found.settings == ResidualSettings(force_sensor=False)
    assert found.training["lessons"] == {"hidden": 3, "rounds": 2, "seed": 0}
    seen = np.random.default_rng(0).normal(size=(4, len(found.student.mean))).astype(np.float32)
    assert found.student.acting()(seen).shape == (4, 2)
    told(monkeypatch, capsys, "--teacher", tmp_path / "teacher", "--rounds", 2, "--hidden", 3, "--out", tmp_path / "two")
    assert (tmp_path / "one" / NAME).read_bytes() == (tmp_path / "two" / NAME).read_bytes()
    content = bytearray((tmp_path / "two" / NAME).read_bytes())
    content[-1] ^= 1
    (tmp_path / "two" / NAME).write_bytes(content)
    with pytest.raises(ValueError, match=r"student.safetensors is damaged or missing \(.*checksum"):
        load_student(tmp_path / "two")


def test_a_teacher_must_be_told_more(tmp_path, monkeypatch, capsys):
    with pytest.raises(SystemExit):
        told(monkeypatch, capsys, "--teacher", policy_folders("circle")[0], "--out", tmp_path)
    assert "is not privileged; allowed: a policy trained with privileged = true" in capsys.readouterr().err
