"""A student is one file in a folder: ``student.safetensors``, its weights with JSON about them. Nothing is unpickled."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch

from agents.policy.files import Policy
from agents.policy.sealed import sealed, unsealed
from agents.residual.settings import ResidualSettings
from agents.training.student import Student
from baselines.work.files import whole_file
from birthsim_env.physics.rig.values import problem

FORMAT = "birthsim-student-1"
NAME = "student.safetensors"


@dataclass(frozen=True)
class Taught:
    """A student, the environment it was taught in, what it may do, and how it was made."""

    student: Student
    environment: str
    settings: ResidualSettings
    training: dict[str, Any]


def save_student(student: Student, teacher: Policy, training: dict[str, Any], folder: Path) -> None:
    """Write the file; it appears whole or not at all."""
    folder.mkdir(parents=True, exist_ok=True)
    about = {
        "format": FORMAT, "environment": teacher.environment, "settings": teacher.settings.to_dict(), "training": training,
    }  # fmt: skip
    with whole_file(folder / NAME) as file:
        file.write(sealed({name: value.numpy() for name, value in student.state_dict().items()}, about))


def load_student(folder: Path) -> Taught:
    """Read it; raises ``ValueError`` for a file that is damaged or foreign."""
    try:
        arrays, about = unsealed((folder / NAME).read_bytes(), FORMAT)
        hidden = len(arrays["enter.weight"])
        student = Student(arrays["mean"], arrays["deviation"], len(arrays["leave.bias"]), hidden)
        student.load_state_dict({name: torch.from_numpy(value) for name, value in arrays.items()})
        return Taught(student, str(about["environment"]), ResidualSettings(**about["settings"]), dict(about["training"]))
    except (KeyError, TypeError, ValueError, RuntimeError, OSError) as error:
        raise ValueError(f"student = {str(folder)!r}: {NAME} is damaged or missing ({problem(error)})") from error
