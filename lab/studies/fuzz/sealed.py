"""Kinds of sealed files, policies and checkpoints: with other arrays or values under a right checksum, and damaged."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from lab.studies.fuzz.files import written
from lab.studies.fuzz.harness import Case, Kind
from lab.studies.fuzz.mutations import Rng, altered, damaged, json_bytes

SETTINGS, PAST = {"seed": 3, "hidden": [8, 8]}, {"law": {"pooled_mm": 2.5}, "policy": None, "curve": [{"steps": 0, "x": 0.1}]}


def changed(rng: Rng, arrays: dict[str, Any]) -> dict[str, Any]:
    """Arrays of which one is gone, has another name, shape or type, or numbers that are not finite."""
    arrays = dict(arrays)
    name = sorted(arrays)[rng.integers(len(arrays))]
    array = np.array(arrays.pop(name))
    match int(rng.integers(7)):
        case 0:
            pass
        case 1:
            arrays[f"{name}s"] = array
        case 2:
            arrays[name] = array.reshape(-1)[: int(rng.integers(3))]
        case 3:
            arrays[name] = array.astype(["f2", "f8", "i4", "u1", "bool"][rng.integers(5)])
        case 4:
            arrays[name] = np.full(array.shape, (np.nan, np.inf, 1e30, -1.0)[rng.integers(4)], dtype=np.float32)
        case 5:
            arrays[name] = np.stack([array, array])
        case _:
            arrays[name] = np.array(0.0)
    return arrays


def _sealed(rng: Rng, content: bytes, form: str) -> bytes:
    """Another content: sealed anew with other arrays or values, with another header, or damaged."""
    from agents.policy.sealed import sealed, unsealed

    choice = rng.random()
    if choice < 0.25:
        return damaged(rng, content)
    if choice < 0.4:
        size = int.from_bytes(content[:8], "little")
        header = json_bytes(rng, json.loads(content[8 : 8 + size]))
        length = len(header) if rng.random() < 0.8 else (0, 1, 2**63, 2**64 - 1, len(header) + 1)[rng.integers(5)]
        return length.to_bytes(8, "little") + header + content[8 + size :]
    arrays, about = unsealed(content, form)
    about = altered(rng, about) if choice < 0.8 else about
    if not isinstance(about, dict):
        about = {"format": form}
    return sealed(changed(rng, arrays) if choice > 0.7 else arrays, {**about, "format": form})


def _policies(name: str) -> Callable[[Path], bytes]:
    """A shipped policy's file."""

    def content(_: Path) -> bytes:
        from agents.policy.files import WEIGHTS, read_policy
        from agents.policy.seeds import policy_folders

        folder = policy_folders(name)[0]
        read_policy(folder)
        return (folder / WEIGHTS).read_bytes()

    return content


def _policy(valid: bytes, rng: Rng, folder: Path, case: Case) -> None:
    from agents.policy.files import FORMAT, WEIGHTS, read_policy

    place = folder / "our_policy"
    place.mkdir()
    written(case, place / WEIGHTS, _sealed(rng, valid, FORMAT))
    case.names = ("our_policy",)
    assert np.isfinite(read_policy(place).network.mean).all()


def _checkpoints(folder: Path) -> tuple[Any, Any, bytes]:
    import gymnasium
    import torch
    from stable_baselines3.common.vec_env import VecNormalize

    from agents.training.checkpoint import NAME
    from agents.training.configuration import TrainingSettings
    from agents.training.sb3.adapter import SB3VecEnv
    from agents.training.sb3.algorithms import make_model
    from agents.training.sb3.checkpoint import load_checkpoint, save_checkpoint

    torch.set_num_threads(1)
    tiny = TrainingSettings("BirthSIM/ProbeResidual-v2", steps=64, lanes=2, rollout=16, batch=32, hidden=(8, 8))
    env = VecNormalize(SB3VecEnv(gymnasium.make_vec(tiny.environment, num_envs=2, autoreset_mode="SameStep")))
    env.seed(0)
    env.reset()
    model = make_model(tiny, env)
    model.learn(64)
    save_checkpoint(folder, model, env, SETTINGS, PAST)
    load_checkpoint(folder, model, env, SETTINGS)
    return model, env, (folder / NAME).read_bytes()


def _checkpoint(valid: tuple[Any, Any, bytes], rng: Rng, folder: Path, case: Case) -> None:
    from agents.training.checkpoint import FORMAT, NAME
    from agents.training.sb3.checkpoint import load_checkpoint

    model, env, content = valid
    written(case, folder / NAME, _sealed(rng, content, FORMAT))
    assert isinstance(load_checkpoint(folder, model, env, SETTINGS), dict)


SEALED: dict[str, Kind] = {
    "policy": Kind(_policies("circle"), _policy),
    "policy-with-memory": Kind(_policies("circle_honest_student"), _policy),
    "checkpoint": Kind(_checkpoints, _checkpoint),
}
