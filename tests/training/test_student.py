"""A student remembers what its teacher is told: DAgger on a problem whose answer is known, and the command that teaches."""

import sys
from dataclasses import replace

import numpy as np
import pytest
import torch

from agents.policy.files import WEIGHTS, read_policy
from agents.policy.seeds import best_policy, policy_folders
from agents.reports.learning_curves import learning_curves
from agents.residual.privileged import TRUE_PARAMETERS
from agents.residual.settings import ResidualSettings
from agents.training import student as module
from agents.training.configuration import TrainingSettings
from agents.training.differentiated import Differentiated
from agents.training.student import _learn
from agents.training.trainer import train
from birthsim.command_line.command import perform_with
from birthsim.commands import distill
from birthsim_env.physics.rig.parameters import Parameters
from tests.residual.policies import INPUTS, policy


def made(hidden):
    return Differentiated(1, 1, (hidden,), hidden, squashed=False)


def test_a_student_finds_from_the_past_what_it_is_not_told():
    """The right action is the mean of what was seen so far: (T, N) noise about a level that each lane has."""
    torch.manual_seed(0)
    levels = torch.randn(64).clamp(-1, 1)
    seen = levels[:, None] + torch.randn(40, 64, 1)
    right = levels.expand(40, 64)[..., None]
    student = made(16)
    adam = torch.optim.Adam(student.parameters(), lr=1e-2)
    for number in range(1, 60):
        _learn(student, adam, [(seen, right, torch.ones(40, 64, dtype=torch.bool))], number)
    act = student.network(np.zeros(1), np.ones(1)).acting()
    by_steps = np.stack([act(now) for now in seen.numpy()])
    with torch.no_grad():
        at_once = student(seen, torch.zeros(64, 16))[0].clamp(-1, 1).numpy()
    # Singles in PyTorch, over 40 steps of the memory.
    np.testing.assert_allclose(by_steps, at_once, atol=1e-5)
    error = np.abs(by_steps - right.numpy()).mean(axis=(1, 2))
    assert error[-5:].mean() < 0.5 * error[0], "what is seen last has the noise of what was seen first"


def test_steps_after_a_loss_teach_nothing():
    torch.manual_seed(0)
    seen, right = torch.randn(5, 4, 1), torch.full((5, 4, 1), 100.0)
    student = made(4)
    before = [one.clone() for one in student.parameters()]
    _learn(student, torch.optim.SGD(student.parameters(), lr=1.0), [(seen, right, torch.zeros(5, 4, dtype=torch.bool))], 0)
    assert all(torch.equal(one, other) for one, other in zip(before, student.parameters(), strict=True))


@pytest.fixture(scope="module")
def teachers(tmp_path_factory):
    """Folder of two teachers, hardly trained."""
    folder = tmp_path_factory.mktemp("teachers")
    for seed in (0, 1):
        settings = TrainingSettings(
            "BirthSIM/ProbeResidual-v3",
            steps=64,
            seed=seed,
            lanes=4,
            rollout=8,
            batch=32,
            validation_lanes=4,
            validations=1,
            privileged=True,
        )
        train(settings, ResidualSettings(force_sensor=False), folder / f"seed_{seed}")
    return folder


@pytest.fixture
def told(monkeypatch, capsys):
    """What the command prints; rounds are of 4 episodes."""
    monkeypatch.setattr(module, "LANES", 4)

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["distill", *map(str, arguments)])
        perform_with("birthsim distill", distill.Settings, distill.main, "")
        return capsys.readouterr().out

    return run


@pytest.mark.slow
def test_every_teacher_gets_a_student_that_is_a_policy(tmp_path, teachers, told):
    brief = ("--teacher", teachers, "--rounds", 1, "--hidden", 3)
    out = told(*brief, "--seeds", 2, "--out", tmp_path / "both")
    assert "seed 0: " in out
    assert "seed 1: " in out
    folders = policy_folders(tmp_path / "both")
    assert [folder.name for folder in folders] == ["seed_0", "seed_1"]
    assert best_policy(tmp_path / "both") in folders
    for seed, (folder, curve) in enumerate(zip(folders, learning_curves(folders), strict=True)):
        policy = read_policy(folder)
        assert (policy.settings, policy.network.cells) == (ResidualSettings(force_sensor=False), 3)
        assert policy.training["seed"] == policy.training["teacher"]["seed"] == seed
        assert policy.training["sensors"] == "ideal"
        assert not policy.training.get("privileged", False)
        assert policy.training["reached"]["pooled_mm"] == curve["policy"]["pooled_mm"]
        assert [point["steps"] for point in curve["curve"]] == [0, 4 * 700]
    told(*brief, "--seed", 1, "--out", tmp_path / "one")
    assert (tmp_path / "one" / "seed_1" / WEIGHTS).read_bytes() == (folders[1] / WEIGHTS).read_bytes()


@pytest.mark.slow
def test_the_same_command_goes_on_with_the_seeds_that_are_not_done(tmp_path, teachers, told, monkeypatch):
    taught, teach = [], distill.teach

    def interrupted(teacher, lessons, rig):
        taught.append(lessons.seed)
        yield from teach(teacher, lessons, rig)
        if lessons.seed == 1 and taught.count(1) == 1:
            raise KeyboardInterrupt

    monkeypatch.setattr(distill, "teach", interrupted)
    command = ("--teacher", teachers, "--rounds", 1, "--hidden", 2, "--seeds", 2, "--out", tmp_path)
    with pytest.raises(SystemExit):
        told(*command)
    read_policy(tmp_path / "seed_1")  # the best so far
    told(*command)
    assert taught == [0, 1, 1]
    told(*command)
    assert taught == [0, 1, 1]
    for change in (("--hidden", 3), ("--parameters", "examples/frictionless_rig.toml")):
        with pytest.raises(SystemExit):
            told(*command, *change)
    assert taught == [0, 1, 1]


def test_a_teacher_that_was_told_other_parameters_is_refused():
    told = replace(policy(), training={"sensors": "ideal", "randomize": True, "validation_lanes": 2, "privileged": True})
    with pytest.raises(ValueError, match=rf"teacher observes {INPUTS} numbers; allowed: {INPUTS + TRUE_PARAMETERS}"):
        next(module.teach(told, module.Lessons(), Parameters()))


def test_a_teacher_must_be_told_more(tmp_path, told, capsys):
    with pytest.raises(SystemExit):
        told("--teacher", policy_folders("circle")[0].parent, "--out", tmp_path)
    assert "is not privileged; allowed: policies trained with privileged = true" in capsys.readouterr().err
