"""Evaluations in pieces: some episodes of one controller each, which several processes and interrupted runs put together."""

import base64
import hashlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from baselines.bench.evaluation import Evaluation, evaluate, merged
from baselines.controller import Controller
from baselines.named import bare_name, make_controller
from baselines.work.tasks import Result, Task
from birthsim_env.physics.rig.parameters import Parameters

EPISODES = 64
"""Episodes of a piece, and of one whose controller is slow: a minute's work at most on this project's machines."""


def file_hash(part: str | None) -> str:
    """Hash of the file that ``path`` or ``path:Name`` names; "" where that is no file."""
    for path in (Path(part or ""), Path((part or "").rpartition(":")[0])):
        if path.is_file():
            return hashlib.sha256(path.read_bytes()).hexdigest()
    return ""


def controller_settings(name: str, rig: Parameters) -> dict[str, Any]:
    """What a result of a controller depends on: its name, a hash of its file if it has one, and the rig as a dictionary.

    Raises ``ValueError`` for a name that is no controller.
    """
    make_controller(name, rig)
    return {"controller": name, "source": file_hash(bare_name(name)), "rig": rig.to_dict()}


def file_stem(name: str) -> str:
    """A controller's name as that of a file; those that are none get a hash, so that no two have the same."""
    stem = "".join(letter if letter.isalnum() or letter in "_.-" else "-" for letter in name)
    return stem if stem == name else f"{stem.strip('-')}-{hashlib.sha256(name.encode()).hexdigest()[:8]}"


def evaluation_tasks(
    label: str,
    settings: dict[str, Any],
    environment: str,
    world: dict[str, Any],
    episodes: int,
    seed: int,
    work: Callable[..., Result] | None = None,
) -> list[Task]:
    """The pieces of an evaluation of the controller with these ``controller_settings``, seeds ``seed``, ``seed`` + 1, ...

    ``world`` holds the environment's arguments as JSON takes them, the rig only where it is not as believed;
    ``work`` is ``evaluate_piece`` or what calls it.
    """
    hashes = [file_hash(value) for value in world.values() if isinstance(value, str)]
    return [
        Task(
            f"pieces/{file_stem(label)}/{first}",
            work or evaluate_piece,
            {
                **settings,
                "environment": environment,
                "world": world,
                "files": hashes,
                "seed": first,
                "episodes": min(EPISODES, seed + episodes - first),
            },
        )
        for first in range(seed, seed + episodes, EPISODES)
    ]


def evaluate_piece(
    controller: str,
    source: str,
    rig: dict[str, Any],
    environment: str,
    world: dict[str, Any],
    files: list[str],
    seed: int,
    episodes: int,
    **options: Any,
) -> Result:
    """One piece; ``options`` go to the controller's constructor, ``source`` and ``files`` only tell pieces apart.

    ``rig`` is what the controller believes, and where ``world`` has no ``parameters`` it is so.
    """
    law = make_controller(controller, Parameters.from_dict(rig), **options)
    return piece_under(law, controller, rig, environment, world, seed, episodes)


def piece_under(
    law: Controller, name: str, rig: dict[str, Any], environment: str, world: dict[str, Any], seed: int, episodes: int
) -> Result:
    """``evaluate_piece`` under a controller that has been made."""
    world = {**world, "parameters": Parameters.from_dict(world.get("parameters", rig))}
    found = evaluate(environment, law, name, episodes, seed, progress=False, **world)
    if len(found.seeds) < episodes:
        raise KeyboardInterrupt  # which ``evaluate`` answers by what is complete; a piece is complete or it is none
    trace = np.ascontiguousarray(np.concatenate(found.traces, axis=1), dtype="<f4")
    return {
        "seeds": found.seeds, "metrics": found.metrics, "lost": found.lost, "success": found.success, "cost": found.cost,
        "required_strength_ratio": found.required_strength_ratio, "remarks": found.remarks,
        "returns": {str(discount): values for discount, values in found.returns.items()},
        "trace": {"shape": trace.shape, "float32": base64.b64encode(trace.tobytes()).decode()},
    }  # fmt: skip


def gathered(name: str, results: Sequence[Result]) -> Evaluation:
    """The evaluation that pieces make up."""
    return merged([_evaluation(result) for result in results], name)


def _evaluation(result: Result) -> Evaluation:
    flat = np.frombuffer(base64.b64decode(result["trace"]["float32"]), dtype="<f4")
    return Evaluation(
        "",
        result["seeds"],
        {name: _numbers(values) for name, values in result["metrics"].items()},
        result["lost"],
        result["required_strength_ratio"],
        {float(key): _numbers(values) for key, values in result["returns"].items()},
        result["success"],
        result["cost"],
        [flat.reshape(result["trace"]["shape"]).astype(np.float64)],
        result["remarks"],
    )


def _numbers(values: list[float | None]) -> list[float]:
    """JSON has no other word for a number that is not finite than null."""
    return [np.nan if value is None else value for value in values]
