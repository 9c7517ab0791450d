"""Checkpoints of a training by Stable-Baselines3: weights, lanes, what is remembered or logged, random states."""

from __future__ import annotations

import operator
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.logger import Logger

from agents.training.checkpoint import read_checkpoint, require_array, require_moments, tensors, write_checkpoint
from agents.training.sb3.adapter import SB3VecEnv
from birthsim_env.physics.rig.values import shown
from birthsim_env.restored import is_beyond
from birthsim_env.state import State

FREE = ("past", "state", "lanes", "memory", "last", "random", "logged", "episodes")
"""Keys below which ``_restore``, or what it calls, looks itself: what optimizers remember, lanes, and what grows."""


def save_checkpoint(folder: Path, model: Any, settings: dict[str, Any], past: dict[str, Any]) -> None:
    """Write the training of ``model`` in ``env`` between two updates, its settings, and ``past``: JSON and arrays."""
    write_checkpoint(folder, settings, _content(model, past, _adapter(model).get_state()))


def _content(model: Any, past: dict[str, Any], lanes: State) -> dict[str, Any]:
    return {
        "past": past,
        "parameters": model.get_parameters(),
        "average": model.average.state_dict(),
        "entropy": getattr(model, "log_ent_coef", None),
        "counts": [int(model.num_timesteps), int(model._n_updates), int(model._episode_num)],
        "last": [model._last_obs, model._last_episode_starts],
        "lanes": lanes,
        "memory": model.algorithm.carried(model),
        "logged": _logged(model.logger),
        "episodes": None if model.ep_info_buffer is None else _episodes(model),
        "random": [
            torch.get_rng_state(),
            np.random.get_state(legacy=False),  # noqa: NPY002  Stable-Baselines3 draws its batches from it
            model.action_space.np_random.bit_generator.state,
        ],
    }


def load_checkpoint(folder: Path, model: Any, settings: dict[str, Any]) -> dict[str, Any] | None:
    """Put model, environment and random states back where they were and return the past; None where there is no checkpoint.

    Raises ``ValueError`` as ``read_checkpoint`` does.
    """

    def undo(content: dict[str, Any]) -> dict[str, Any]:
        return _restore(content, model)

    def restore(content: dict[str, Any]) -> dict[str, Any]:
        past = undo(content)
        _adapter(model).set_state(content["lanes"])  # last: it changes nothing where it refuses
        return past

    return read_checkpoint(folder, settings, lambda: _content(model, {}, {}), restore, undo, FREE)


def _restore(content: dict[str, Any], model: Any) -> dict[str, Any]:
    past, shape = content["past"], (model.n_envs, *model.observation_space.shape)
    if not isinstance(past, dict):
        raise TypeError("its past is no dictionary")
    if min(content["counts"]) < 0:
        raise ValueError(f"counts are {content['counts']}; allowed: >= 0")
    if content["last"][0] is not None:
        for name, array, own in zip(("last", "starts"), content["last"], (shape, shape[:1]), strict=True):
            require_array(name, array, own)
    model.set_parameters(tensors(content["parameters"]), exact_match=True, device="cpu")
    for name in content["parameters"]:
        part: Any = operator.attrgetter(name)(model)
        if isinstance(part, torch.optim.Optimizer):
            require_moments(part)
    model.average.load_state_dict(tensors(content["average"]))
    if content["entropy"] is not None:
        with torch.no_grad():
            model.log_ent_coef.copy_(torch.from_numpy(content["entropy"]))
    model.num_timesteps, model._n_updates, model._episode_num = content["counts"]
    model._last_obs, model._last_episode_starts = content["last"]
    model.algorithm.carry(model, content["memory"])
    _log(model.logger, content["logged"])
    _remember(model, content["episodes"])
    of_torch, of_numpy, of_actions = content["random"]
    if is_beyond(of_numpy) or is_beyond(of_actions):
        raise ValueError("random: a generator stands beyond its table")
    torch.set_rng_state(torch.from_numpy(of_torch))
    np.random.set_state(of_numpy)  # noqa: NPY002
    model.action_space.np_random.bit_generator.state = of_actions
    return past


def _logged(logger: Logger) -> list[list[Any]]:
    """What has been logged and waits for the next line: name, value, the formats that leave it out."""
    return [[name, float(value), list(logger.name_to_excluded[name] or ())] for name, value in logger.name_to_value.items()]


def _log(logger: Logger, logged: list[Any]) -> None:
    waiting = {}
    for name, value, left_out in logged:
        if not (isinstance(name, str) and type(value) is float and all(isinstance(one, str) for one in left_out)):
            raise ValueError(f"logged: {shown([name, value, left_out])}; allowed: a name, a number, names of formats")
        waiting[name] = value, tuple(left_out)
    logger.name_to_value.clear()
    for name, (value, left_out) in waiting.items():
        logger.record(name, value, exclude=left_out)


def _episodes(model: Any) -> dict[str, Any]:
    """Of the last episodes returns and lengths, and whether they succeeded, whose means are logged."""
    ended = [(one["r"], one["l"]) for one in model.ep_info_buffer]
    return {
        "ended": np.array(ended, dtype=np.float64).reshape(-1, 2),
        "successes": np.array(model.ep_success_buffer, dtype=np.bool_),
    }


def _remember(model: Any, episodes: Any) -> None:
    if episodes is None:
        model.ep_info_buffer = model.ep_success_buffer = None
        return
    ended, successes, window = episodes["ended"], episodes["successes"], model._stats_window_size
    require_array("episodes/ended", ended, (len(ended), 2))
    require_array("episodes/successes", successes, (len(successes),))
    model.ep_info_buffer = deque([{"r": float(r), "l": int(length)} for r, length in ended], maxlen=window)
    model.ep_success_buffer = deque([bool(one) for one in successes], maxlen=window)


def _adapter(model: Any) -> SB3VecEnv:
    env = model.get_env()
    while not isinstance(env, SB3VecEnv):
        env = env.venv
    return env
