"""Checkpoints of a training by Stable-Baselines3: weights, statistics, lanes, what is remembered of the past, random states."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.vec_env import VecNormalize

from agents.training.checkpoint import read_checkpoint, tensors, write_checkpoint
from agents.training.sb3.adapter import SB3VecEnv

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


def load_checkpoint(folder: Path, model: Any, env: VecNormalize, settings: dict[str, Any]) -> dict[str, Any] | None:
    """Put model, environment and random states back where they were and return the past; None where there is no checkpoint.

    Raises ``ValueError`` as ``read_checkpoint`` does.
    """
    return read_checkpoint(folder, settings, lambda content: _restore(content, model, env))


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
