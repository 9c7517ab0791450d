"""The pieces of a sweep: a point's evaluation, and where it trains a policy, the training before it."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from baselines.bench.pieces import controller_settings, evaluate_piece, evaluation_tasks, file_hash
from baselines.work.tasks import Result, Task
from birthsim.command_line.worlds import policy_of
from birthsim_env.files import own_folder
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from lab.studies.sweeps.plan import Point, Sweep

WORLD = ("sensors", "randomize", "reference", "user_force")
"""Names that are arguments of the environment."""


@dataclass(frozen=True, eq=False)
class Piece:
    """What a task is for: the ``number`` of a ``point``, which has ``count`` pieces."""

    number: int
    point: Point
    count: int


def pieces_of(points: Sequence[Point], sweep: Sweep, first: int = 0) -> dict[Piece, Task]:
    """The pieces of points, which are numbered from ``first``; that of a point that cannot be fails and says why."""
    pieces = dict[Piece, Task]()
    for number, point in enumerate(points, first):
        try:
            tasks = tasks_of(point, sweep)
        except ValueError as error:
            tasks = [Task(f"point {number}", refuse, {"why": str(error)})]
        pieces |= {Piece(number, point, len(tasks)): task for task in tasks}
    return pieces


def complete(found: Mapping[Piece, Result]) -> tuple[list[Point], list[list[Result]]]:
    """The points that have all their pieces, and these."""
    pieces: dict[int, list[Piece]] = {}
    for piece in found:
        pieces.setdefault(piece.number, []).append(piece)
    whole = [own for _, own in sorted(pieces.items()) if len(own) == own[0].count]
    return [own[0].point for own in whole], [[found[piece] for piece in own] for own in whole]


def refuse(why: str) -> Result:
    """Raises ``ValueError``."""
    raise ValueError(why)


def tasks_of(point: Point, sweep: Sweep) -> list[Task]:
    """The pieces of a sweep's point, named by their settings, so that a longer sweep keeps those of a shorter one.

    Raises ``ValueError`` that names what cannot be.
    """

    def named(task: Task) -> Task:
        digest = hashlib.sha256(json.dumps(task.settings, sort_keys=True).encode()).hexdigest()
        return replace(task, name=f"pieces/{digest[:2]}/{digest[2:16]}")

    return [named(task) for task in _tasks(point, sweep)]


def _tasks(point: Point, sweep: Sweep) -> list[Task]:
    asked = {**sweep.base, **point}
    believed = load_parameters(asked["parameters"]).replace(_group("believed", asked))
    rig = believed.replace(_group("rig", asked))
    world = {name: asked[name] for name in WORLD if name in asked}
    if rig != believed:
        world["parameters"] = rig.to_dict()
    if "train" in asked:
        return [_trained(asked, believed, world)]
    span = asked["episodes"], asked["seed"]
    if asked["controller"] == "residual" or "policy" in asked:
        # Policies need an extra, which laws do not.
        from agents.policy.files import WEIGHTS
        from agents.policy.seeds import best_policy

        name = asked.get("policy") or policy_of(asked["environment"])
        place = best_policy(name)
        own = {
            "controller": "residual", "source": file_hash(str(place / WEIGHTS)), "rig": believed.to_dict(),
            "policy": str(place), **_group("gain", asked),
        }  # fmt: skip
        return evaluation_tasks("residual", own, asked["environment"], world, *span, work=evaluate_point)
    gains = ",".join(f"{name}={value}" for name, value in _group("gain", asked).items())
    name = f"{asked['controller']}[{gains}]" if gains else asked["controller"]
    settings = controller_settings(name, believed)
    return evaluation_tasks(asked["controller"], settings, asked["environment"], world, *span, evaluate_point)


def evaluate_point(**settings: Any) -> Result:
    """A piece of a point's evaluation, without the course of its errors."""
    result = evaluate_piece(**settings)
    result.pop("trace")
    return result


def train_point(
    training: dict[str, Any],
    residual: dict[str, Any],
    rig: dict[str, Any],
    environment: str,
    world: dict[str, Any],
    files: list[str],
    seed: int,
    episodes: int,
    place: str,
    ending: Path | None,
) -> Result:
    """Train a policy in the folder ``place``, where a killed training goes on, and evaluate it.

    Beside others it ends, with a checkpoint of the update that it is in, once there is a file ``ending``.
    """
    from agents.policy.files import WEIGHTS
    from agents.residual.settings import ResidualSettings
    from agents.training.configuration import TrainingSettings
    from agents.training.trainer import train

    parameters = Parameters.from_dict(rig)
    several = {name: tuple(training[name]) for name in ("hidden", "beside")}
    settings = TrainingSettings(**{**training, **several})
    with own_folder(Path(place)) as folder:
        train(settings, ResidualSettings(**residual), folder, parameters, ending=ending)
    result = evaluate_point(
        controller="residual",
        source="",
        rig=rig,
        environment=environment,
        world=world,
        files=files,
        seed=seed,
        episodes=episodes,
        policy=str(folder),
    )
    return {**result, "network": file_hash(str(folder / WEIGHTS))}


def _trained(asked: dict[str, Any], believed: Parameters, world: dict[str, Any]) -> Task:
    from agents.training.configuration import load_configuration, override

    training, residual = load_configuration(asked["train"])
    training = override(training, **_group("training", asked))
    residual = override(residual, **_group("residual", asked))
    files = [file_hash(value) for value in world.values() if isinstance(value, str)]
    settings = {
        "training": training.to_dict(), "residual": residual.to_dict(), "rig": believed.to_dict(),
        "environment": asked["environment"], "world": world, "files": files, "seed": asked["seed"],
        "episodes": asked["episodes"],
    }  # fmt: skip
    return Task("training", train_point, settings, keeps=True)


def _group(group: str, asked: dict[str, Any]) -> dict[str, Any]:
    """What stands under ``group.``."""
    return {name.partition(".")[2]: value for name, value in asked.items() if name.startswith(f"{group}.")}
