"""The kind of checkpoints: tensors and plain values, changed one by one, and damaged files."""

from __future__ import annotations

import copy
import os
from pathlib import Path
from typing import Any

import numpy as np

from tests.fuzz.harness import Case, Kind
from tests.fuzz.mutations import Rng, altered, damaged, json_bytes, plain

SETTINGS, PAST = {"seed": 3, "hidden": [8, 8]}, {"law": {"pooled_mm": 2.5}, "policy": None, "curve": [{"steps": 0, "x": 0.1}]}


class Evil:
    """Unpickled, it runs a command."""

    def __reduce__(self) -> Any:
        return os.system, ("true",)


def _checkpoints(folder: Path) -> tuple[Any, Any, bytes, Path]:
    import gymnasium
    import torch
    from stable_baselines3.common.vec_env import VecNormalize

    from agents.training.algorithms import make_model
    from agents.training.checkpoint import NAME, load_checkpoint, save_checkpoint
    from agents.training.configuration import TrainingSettings
    from agents.training.sb3_adapter import SB3VecEnv

    torch.set_num_threads(1)
    tiny = TrainingSettings("BirthSIM/ProbeResidual-v1", steps=64, lanes=2, rollout=16, batch=32, hidden=(8, 8))
    env = VecNormalize(SB3VecEnv(gymnasium.make_vec(tiny.environment, num_envs=2, autoreset_mode="SameStep")))
    model = make_model(tiny, env)
    save_checkpoint(folder, model, env, SETTINGS, PAST)
    load_checkpoint(folder, model, env, SETTINGS)
    return model, env, (folder / NAME).read_bytes(), Path(NAME)


def _tree(rng: Rng, content: Any) -> Any:
    """The content of a checkpoint with tensors and values changed."""
    import torch

    flat: list[tuple[Any, Any]] = []

    def collect(tree: Any) -> None:
        for key, value in tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ():
            flat.append((tree, key))
            collect(value)

    collect(content)
    for _ in range(int(rng.integers(1, 3))):
        parent, key = flat[rng.integers(len(flat))]
        if not (key in parent if isinstance(parent, dict) else key < len(parent)):
            continue
        value = parent[key]
        match int(rng.integers(6)):
            case 0:
                del parent[key]
            case 1 if torch.is_tensor(value):
                parent[key] = value.flatten()[:1] if rng.random() < 0.5 else value.double() * float("nan")
            case 2 if torch.is_tensor(value):
                parent[key] = torch.zeros((0,)) if rng.random() < 0.5 else torch.ones((2, 3), dtype=torch.int64)
            case 3 if isinstance(value, str):
                parent[key] = json_bytes(rng, SETTINGS if key == "settings" else PAST).decode("utf-8", "replace")
            case 4 if isinstance(value, (dict, list)):
                parent[key] = [] if rng.random() < 0.5 else {}
            case _:
                parent[key] = plain(rng)
    return content


def _checkpoint(valid: tuple[Any, Any, bytes, Path], rng: Rng, folder: Path, case: Case) -> None:
    import io

    import torch

    from agents.training.checkpoint import load_checkpoint

    model, env, content, name = valid
    choice = rng.random()
    if choice < 0.35:
        content = damaged(rng, content)
    elif choice < 0.4:
        file = io.BytesIO()
        torch.save({"settings": Evil(), "past": Evil()}, file)
        content = file.getvalue()
    elif name.suffix == ".pt":
        try:
            tree = _tree(rng, copy.deepcopy(torch.load(io.BytesIO(content), weights_only=True)))
        except (ValueError, RuntimeError):
            tree = altered(rng, PAST)
        file = io.BytesIO()
        torch.save(tree, file)
        content = file.getvalue()
    (folder / name).write_bytes(content)
    case.names, case.shown = (name.name,), repr(content[:200])
    load_checkpoint(folder, model, env, SETTINGS)
    assert np.isfinite(env.obs_rms.mean).all(), "normalisation is not finite"


CHECKPOINTS: dict[str, Kind] = {"checkpoint": Kind(_checkpoints, _checkpoint)}
