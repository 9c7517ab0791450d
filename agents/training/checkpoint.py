"""All that the future of a training depends on, in one file that appears whole or not at all: it goes on as if never killed.

Arrays and JSON with a checksum of every byte (``agents.policy.sealed``): nothing is unpickled, and what has changed is refused.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch

from agents.policy.sealed import Arrays, sealed, unsealed
from birthsim_env.files import whole_file
from birthsim_env.physics.rig.values import problem, shown

NAME = "checkpoint.safetensors"
FORMAT = "birthsim-checkpoint-2"

ALLOWED = "allowed: a checkpoint that birthsim train wrote"

Content = dict[str, Any]


def write_checkpoint(folder: Path, settings: dict[str, Any], content: dict[str, Any]) -> None:
    """Write ``content``, JSON with arrays and tensors at any depth, and the settings of the training that it is of."""
    arrays: Arrays = {}
    about = {"format": FORMAT, "settings": settings, "content": _flat("", content, arrays)}
    with whole_file(folder / NAME) as file:
        file.write(sealed(arrays, about))


def read_checkpoint(
    folder: Path,
    settings: dict[str, Any],
    present: Callable[[], Content],
    restore: Callable[[Content], Content],
    undo: Callable[[Content], object],
    free: Sequence[str],
) -> Content | None:
    """What ``restore`` makes of the content of a checkpoint, with arrays for tensors; None where there is no checkpoint.

    Raises ``ValueError`` for a damaged one, for one of a training with other settings, and for a content that is not like the
    ``present`` one: names, types, shapes, finite numbers. ``restore`` looks itself at what stands below the keys ``free``.
    Where it raises, ``undo`` gets the present content.
    """
    path = folder / NAME
    if not path.is_file():
        return None
    try:
        arrays, about = unsealed(path.read_bytes(), FORMAT)
    except ValueError as error:
        raise ValueError(f"{str(path)!r} is {error}; {ALLOWED}") from error
    own = json.loads(json.dumps(settings))
    its = about["settings"] if isinstance(about.get("settings"), dict) else {}
    other = sorted(name for name in {*its, *own} if its.get(name) != own.get(name))
    if other:
        raise ValueError(
            f"{str(path)!r} is of a training with other {', '.join(other)}; allowed: the same settings, or a folder of its own"
        )
    own_arrays: Arrays = {}
    own_form = _flat("", present(), own_arrays)
    own_content = _nested(own_form, {name: array.copy() for name, array in own_arrays.items()})
    try:
        content = _nested(about["content"], arrays)
        _require_like("", own_content, content, free)
        try:
            return restore(content)
        except BaseException:
            undo(own_content)
            raise
    except (LookupError, TypeError, ValueError, AttributeError, RuntimeError, ArithmeticError) as error:
        raise ValueError(f"{str(path)!r} does not fit this version ({problem(error)}); {ALLOWED}") from error


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


def _require_like(name: str, own: Any, value: Any, free: Sequence[str]) -> None:
    """Raise ``ValueError`` where ``value`` differs from ``own`` in more than numbers; what is None may be anything."""
    if name.rpartition("/")[2] in free or own is None:
        return
    if isinstance(own, np.ndarray):
        if getattr(value, "shape", None) != own.shape or value.dtype != own.dtype or not is_finite_array(value):
            raise ValueError(f"{name} is {shown(value)}; allowed: finite {own.dtype} {own.shape}")
    elif type(value) is not type(own) or (isinstance(own, (list, dict)) and len(own) != len(value)):
        raise ValueError(f"{name} is {shown(value)}; allowed: {shown(own)}")
    elif isinstance(own, float) and math.isfinite(own) and not math.isfinite(value):
        raise ValueError(f"{name} is {shown(value)}; allowed: a finite number")
    elif isinstance(own, dict):
        for key, one in own.items():
            if key not in value:
                raise ValueError(f"{name}/{key} is missing")
            _require_like(f"{name}/{key}", one, value[key], free)
    elif isinstance(own, list):
        for k, one in enumerate(own):
            _require_like(f"{name}/{k}", one, value[k], free)


def is_finite_array(array: Any) -> bool:
    """Whether numbers are finite, as all others than floats are."""
    return array.dtype.kind != "f" or bool(np.isfinite(array).all())


def require_array(name: str, value: Any, shape: Sequence[int]) -> None:
    """Raise ``ValueError`` where ``value`` is no array of finite numbers of this shape."""
    if not isinstance(value, np.ndarray) or value.shape != tuple(shape) or not is_finite_array(value):
        raise ValueError(f"{name} is {shown(value)}; allowed: finite numbers, {tuple(shape)}")


def require_moments(optimizer: torch.optim.Optimizer) -> None:
    """Raise ``ValueError`` where what an optimizer remembers of a weight has not its shape, which PyTorch does not check."""
    for weight, remembered in optimizer.state.items():
        for name, value in remembered.items():
            shape = getattr(value, "shape", None)
            if shape is None or tuple(shape) not in ((), tuple(weight.shape)) or not torch.isfinite(value).all():
                raise ValueError(f"{name} of an optimizer has shape {shape}; allowed: {tuple(weight.shape)}, finite")


def tensors(value: Any) -> Any:
    """``value`` with tensors for the arrays that it holds at any depth."""
    if isinstance(value, dict):
        return {key: tensors(one) for key, one in value.items()}
    if isinstance(value, list):
        return [tensors(one) for one in value]
    return torch.from_numpy(value) if isinstance(value, np.ndarray) else value
