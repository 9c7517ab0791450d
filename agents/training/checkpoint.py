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
from stable_baselines3.common.vec_env import VecNormalize

from agents.policy.sealed import Arrays, sealed, unsealed
from agents.training.sb3_adapter import SB3VecEnv
from birthsim_env.files import whole_file
from birthsim_env.physics.rig.values import problem

NAME = "checkpoint.safetensors"
FORMAT = "birthsim-checkpoint-1"

REMEMBERED = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
"""Arrays in which SAC and TQC remember past steps."""


def save_checkpoint(folder: Path, model: Any, env: VecNormalize, settings: dict[str, Any], past: dict[str, Any]) -> None:
    """Write the training of ``model`` in ``env`` between two updates, its settings, and ``past``: JSON and arrays."""
    content = {
        "past": past,
        "parameters": model.get_parameters(),
        "average": model.average.state_dict(),
        "entropy": getattr(model, "log_ent_coef", None),
        "counts": [int(model.num_timesteps), int(model._n_updates), int(model._episode_num)],
        "observations": _statistics(env.obs_rms),
        "rewards": _statistics(env.ret_rms),
        "returns": env.returns,
        "last": [model._last_obs, model._last_episode_starts, model._last_original_obs],
        "lanes": _adapter(env).get_state(),
        "memory": _memory(model),
        "random": [
            torch.get_rng_state(),
            np.random.get_state(legacy=False),  # noqa: NPY002  Stable-Baselines3 draws its batches from it
            model.action_space.np_random.bit_generator.state,
        ],
    }
    write_checkpoint(folder, settings, content)


def write_checkpoint(folder: Path, settings: dict[str, Any], content: dict[str, Any]) -> None:
    """Write ``content``, JSON with arrays and tensors at any depth, and the settings of the training that it is of."""
    arrays: Arrays = {}
    about = {"format": FORMAT, "settings": settings, "content": _flat("", content, arrays)}
    with whole_file(folder / NAME) as file:
        file.write(sealed(arrays, about))


def load_checkpoint(folder: Path, model: Any, env: VecNormalize, settings: dict[str, Any]) -> dict[str, Any] | None:
    """Put model, environment and random states back where they were and return the past; None where there is no checkpoint.

    Raises ``ValueError`` as ``read_checkpoint`` does.
    """
    return read_checkpoint(folder, settings, lambda content: _restore(content, model, env))


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


def _restore(content: dict[str, Any], model: Any, env: VecNormalize) -> dict[str, Any]:
    model.set_parameters(tensors(content["parameters"]), exact_match=True, device="cpu")
    model.average.load_state_dict(tensors(content["average"]))
    if content["entropy"] is not None:
        with torch.no_grad():
            model.log_ent_coef.copy_(torch.from_numpy(content["entropy"]))
    model.num_timesteps, model._n_updates, model._episode_num = content["counts"]
    for running, name in ((env.obs_rms, "observations"), (env.ret_rms, "rewards")):
        running.mean, running.var, running.count = content[name]  # type: ignore[union-attr]
    env.returns = content["returns"]
    model._last_obs, model._last_episode_starts, model._last_original_obs = content["last"]
    _adapter(env).set_state(content["lanes"])
    memory = content["memory"]
    if memory is not None:
        buffer = model.replay_buffer
        buffer.pos, buffer.full = memory["pos"], memory["full"]
        for name in REMEMBERED:
            getattr(buffer, name)[: len(memory[name])] = memory[name]
    of_torch, of_numpy, of_actions = content["random"]
    torch.set_rng_state(torch.from_numpy(of_torch))
    np.random.set_state(of_numpy)  # noqa: NPY002
    model.action_space.np_random.bit_generator.state = of_actions
    past = content["past"]
    if not isinstance(past, dict):
        raise TypeError("its past is no dictionary")
    return past


def _memory(model: Any) -> dict[str, Any] | None:
    """What SAC and TQC remember of past steps."""
    buffer = getattr(model, "replay_buffer", None)
    if buffer is None:
        return None
    arrays = {name: getattr(buffer, name)[: buffer.size()] for name in REMEMBERED}
    return {"pos": int(buffer.pos), "full": bool(buffer.full), **arrays}


def _adapter(env: Any) -> SB3VecEnv:
    while not isinstance(env, SB3VecEnv):
        env = env.venv
    return env


def _statistics(running: Any) -> list[Any]:
    return [np.array(running.mean), np.array(running.var), float(running.count)]


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
