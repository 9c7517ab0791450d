"""All that the future of a training depends on, in one file that appears whole or not at all: it goes on as if never killed.

Arrays and JSON with a checksum of every byte (``agents.policy.sealed``): nothing is unpickled, and what has changed is refused.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch

from agents.policy.sealed import Arrays, sealed, unsealed
from birthsim_env.files import whole_file
from birthsim_env.physics.rig.values import problem

NAME = "checkpoint.safetensors"
FORMAT = "birthsim-checkpoint-1"


def write_checkpoint(folder: Path, settings: dict[str, Any], content: dict[str, Any]) -> None:
    """Write ``content``, JSON with arrays and tensors at any depth, and the settings of the training that it is of."""
    arrays: Arrays = {}
    about = {"format": FORMAT, "settings": settings, "content": _flat("", content, arrays)}
    with whole_file(folder / NAME) as file:
        file.write(sealed(arrays, about))


def read_checkpoint(
    folder: Path, settings: dict[str, Any], restore: Callable[[dict[str, Any]], dict[str, Any]]
) -> dict[str, Any] | None:  # fmt: skip
    """What ``restore`` makes of the content of a checkpoint, with arrays for tensors; None where there is no checkpoint.

    Raises ``ValueError`` for a damaged one and for one of a training with other settings.
    """
    path = folder / NAME
    if not path.is_file():
        return None
    allowed = "allowed: a checkpoint that birthsim train wrote"
    try:
        arrays, about = unsealed(path.read_bytes(), FORMAT)
    except ValueError as error:
        raise ValueError(f"{str(path)!r} is {error}; {allowed}") from error
    own = json.loads(json.dumps(settings))
    its = about["settings"] if isinstance(about.get("settings"), dict) else {}
    other = sorted(name for name in {*its, *own} if its.get(name) != own.get(name))
    if other:
        raise ValueError(
            f"{str(path)!r} is of a training with other {', '.join(other)}; allowed: the same settings, or a folder of its own"
        )
    try:
        return restore(_nested(about["content"], arrays))
    except (LookupError, TypeError, ValueError, AttributeError, RuntimeError, ArithmeticError) as error:
        raise ValueError(f"{str(path)!r} does not fit this version ({problem(error)}); {allowed}") from error


def _flat(name: str, value: Any, arrays: Arrays) -> Any:
    """``value`` as JSON, in which ``arrays``, by name, stand for the arrays and tensors that it holds at any depth."""
    if isinstance(value, torch.Tensor):
        value = value.detach().cpu().numpy()
    if isinstance(value, (np.ndarray, np.generic)):
        arrays[name] = np.asarray(value)
        return {"array": name}
    if isinstance(value, dict):
        return {"dict": [[key, _flat(f"{name}/{key}", one, arrays)] for key, one in value.items()]}
    return [_flat(f"{name}/{k}", one, arrays) for k, one in enumerate(value)] if isinstance(value, (list, tuple)) else value


def _nested(value: Any, arrays: Arrays) -> Any:
    """What ``_flat`` was given, with arrays instead of tensors and lists instead of tuples."""
    if isinstance(value, list):
        return [_nested(one, arrays) for one in value]
    if not isinstance(value, dict):
        return value
    return arrays[value["array"]] if "array" in value else {key: _nested(one, arrays) for key, one in value["dict"]}


def tensors(value: Any) -> Any:
    """``value`` with tensors for the arrays that it holds at any depth."""
    if isinstance(value, dict):
        return {key: tensors(one) for key, one in value.items()}
    if isinstance(value, list):
        return [tensors(one) for one in value]
    return torch.from_numpy(value) if isinstance(value, np.ndarray) else value
