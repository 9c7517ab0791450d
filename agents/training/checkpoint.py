"""What a training needs to go on after a kill, in one file that appears whole or not at all.

Tensors and plain numbers, read by ``torch.load(weights_only=True)``: nothing is unpickled that could run. What SAC and TQC
remember of past steps is not kept: they fill their memory anew with the policy that they have.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import torch
from stable_baselines3.common.vec_env import VecNormalize

from baselines.files import whole_file

NAME = "checkpoint.pt"


def save_checkpoint(folder: Path, model: Any, env: VecNormalize, settings: dict[str, Any], past: dict[str, Any]) -> None:
    """Write the model, the average of its policies, its normalisation, PyTorch's random state, the training's settings and its
    ``past``, which is JSON."""
    content = {
        "parameters": model.get_parameters(),
        "average": model.average.state_dict(),
        "entropy": _entropy(model),
        "steps": int(model.num_timesteps),
        "updates": int(model._n_updates),
        "observations": _statistics(env.obs_rms),
        "returns": _statistics(env.ret_rms),
        "random": torch.get_rng_state(),
        "settings": json.dumps(settings, sort_keys=True),
        "past": json.dumps(past),
    }
    with whole_file(folder / NAME) as file:
        torch.save(content, file)


def load_checkpoint(folder: Path, model: Any, env: VecNormalize, settings: dict[str, Any]) -> dict[str, Any] | None:
    """Put model and normalisation back where they were and return the past; None where there is no checkpoint.

    Raises ``ValueError`` for a damaged one and for one of a training with other settings.
    """
    path = folder / NAME
    if not path.is_file():
        return None
    damaged = f"{str(path)!r} is damaged; allowed: a checkpoint that birthsim-train wrote"
    try:
        content = torch.load(path, weights_only=True)
        its_settings = dict(json.loads(content["settings"]))
    except Exception as error:
        raise ValueError(damaged) from error
    if its_settings != json.loads(json.dumps(settings)):
        other = sorted(name for name in {*its_settings, *settings} if its_settings.get(name) != settings.get(name))
        raise ValueError(
            f"{str(path)!r} is of a training with other {', '.join(other)}; allowed: the same settings, or a folder of its own"
        )
    try:
        past: dict[str, Any] = json.loads(content["past"])
        model.set_parameters(content["parameters"], exact_match=True, device="cpu")
        model.average.load_state_dict(content["average"])
        if content["entropy"] is not None:
            with torch.no_grad():
                model.log_ent_coef.copy_(content["entropy"])
        model.num_timesteps, model._n_updates = content["steps"], content["updates"]
        _restore(env.obs_rms, content["observations"])
        _restore(env.ret_rms, content["returns"])
        torch.set_rng_state(content["random"])
    except (KeyError, TypeError, ValueError, AttributeError, RuntimeError) as error:
        raise ValueError(damaged) from error
    if hasattr(model, "learning_starts"):
        # Its memory of past steps is empty again: it is filled before it is learned from.
        model.learning_starts += model.num_timesteps
    return past


def _entropy(model: Any) -> torch.Tensor | None:
    """How much SAC and TQC think entropy is worth, which is no part of the parameters that they give."""
    coefficient = getattr(model, "log_ent_coef", None)
    return None if coefficient is None else coefficient.detach().clone()


def _statistics(running: Any) -> dict[str, torch.Tensor]:
    return {name: torch.as_tensor(getattr(running, name), dtype=torch.float64) for name in ("mean", "var", "count")}


def _restore(running: Any, content: dict[str, torch.Tensor]) -> None:
    running.mean, running.var = content["mean"].numpy().copy(), content["var"].numpy().copy()
    running.count = float(content["count"])
