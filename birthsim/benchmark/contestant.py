"""Who is judged: what a user names or hands over, as a controller in a task, and as pieces of work where it has a file."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from agents.foreign.policies import ALLOWED, SUFFIXES, acting_controller, acting_part, read_policy_file
from agents.foreign.stable_baselines import algorithm_in
from baselines.bench.pieces import controller_settings, evaluation_tasks, file_hash
from baselines.controller import RESIDUAL, Controller, controller_of, is_ready
from baselines.named import bare_name, make_controller
from baselines.work.tasks import Task
from birthsim.benchmark.pieces import score_piece
from birthsim.benchmark.suites import BenchmarkTask
from birthsim_env.extras import installation
from birthsim_env.parts.own_parts import from_file
from birthsim_env.physics.rig.json_reading import read_json
from birthsim_env.physics.rig.schema import Listed
from birthsim_env.physics.rig.values import near, path_of, shown
from birthsim_env.registry import names

ONNX = "ONNX"
"""Kind of a policy in an ONNX file."""

WEIGHTS = "policy.safetensors"
"""What a folder of ``birthsim train`` has of a policy."""

PLACES = ("{task}", "{scenario}")
"""What stands for a task's name, or for that of its scenario, in a policy that is another one in each."""

TRAINING = "training.json"
"""What a folder of ``birthsim train`` says of the training."""

_POINT = {"steps": int, "seconds": float}
_TRAINED = {"settings": dict, "steps?": int, "seconds?": float, "curve?": Listed(_POINT)}


@dataclass(frozen=True)
class Contestant:
    """A policy or controller.

    Parameters
    ----------
    name : str
        In tables and rows: of a path the last part.
    kind : str
        What it is: ``controller``, ``residual``, ``policy``, or the algorithm of an archive.
    given : Any
        The path or name, or the object.
    policy_period : float
        s between two actions of a policy of an environment.
    normalize : str
        File of ``VecNormalize``'s statistics, or "".
    run : int
        Which of the training seeds of a folder.
    """

    name: str
    kind: str
    given: Any
    policy_period: float = 0.01
    normalize: str = ""
    run: int = 0

    @property
    def said(self) -> str:
        """What was asked for, without the folder where it lies."""
        return Path(self.given).name if self.has_file else self.name

    @property
    def differs(self) -> bool:
        """Whether it is another one in each task."""
        return self.has_file and any(place in self.given for place in PLACES)

    @property
    def has_file(self) -> bool:
        """Whether a name or file says all of it, so that it can be evaluated in pieces that are kept."""
        return isinstance(self.given, str)

    def hash(self, task: BenchmarkTask) -> str:
        """SHA-256 of its file, of a policy's weights; "" of what has no file."""
        if not self.has_file:
            return ""
        return file_hash(str(self._folder(task) / WEIGHTS) if self.kind == RESIDUAL else self._place(task))

    def pieces(self, task: BenchmarkTask, seeds: range, label: str) -> list[Task]:
        """Its evaluation in a task as pieces of work."""
        rig = task.rig
        own: dict[str, Any] = {"source": self.hash(task), "rig": rig.to_dict()}
        if self.kind == "controller":
            own = controller_settings(self._place(task), rig)
        elif self.kind == RESIDUAL:
            own |= {"controller": RESIDUAL, "policy": str(self._folder(task))}
        else:
            own |= {"controller": self._place(task), "policy_period": self.policy_period, "normalize": self.normalize}
            own |= {"statistics": file_hash(self.normalize)}
        span = task.environment, task.world, len(seeds), seeds.start
        return evaluation_tasks(label, {"kind": self.kind, **own}, *span, work=score_piece)

    def controller(self, task: BenchmarkTask) -> Controller:
        """Itself as a controller of a task's rig; ``ValueError`` where it is none, or has other spaces."""
        rig = task.rig
        if self.kind == "controller":
            return make_controller(self._place(task), rig) if self.has_file else controller_of(self.given)
        if self.kind == RESIDUAL:
            return make_controller(RESIDUAL, rig, policy=self._folder(task))
        if self.has_file:
            return read_policy_file(self._place(task), rig, self.policy_period, self.normalize)
        return acting_controller(self.given, rig, self.policy_period, self.name)

    def training(self, task: BenchmarkTask) -> dict[str, Any] | None:
        """How its policy of a task was trained, as ``training_of`` says; of ONNX what stands in ``FILE.json`` beside it."""
        if self.kind == RESIDUAL:
            return training_of(self._folder(task) / TRAINING)
        return training_of(Path(self._place(task)).with_suffix(".json")) if self.kind == ONNX else None

    def _folder(self, task: BenchmarkTask) -> Path:
        return folders_of(self._place(task))[self.run]

    def _place(self, task: BenchmarkTask) -> str:
        return in_task(self.given, task)


def in_task(given: Any, task: BenchmarkTask) -> str:
    """A policy's path or name in a task."""
    return str(given).replace(PLACES[0], task.name).replace(PLACES[1], task.scenario)


def training_of(file: Path) -> dict[str, Any] | None:
    """What a training says of itself, without the rig: ``settings``, ``steps`` of the policy over all lanes and ``seconds``.

    None without such a file; ``ValueError`` for one that is damaged.
    """
    if not file.is_file():
        return None
    found = read_json("training", file, _TRAINED)
    last = (found.get("curve") or [found])[-1]
    settings = {name: value for name, value in found["settings"].items() if name not in ("rig", "teacher")}
    return {"settings": settings, "steps": last.get("steps"), "seconds": last.get("seconds")}


def contestants_of(policy: Any, task: BenchmarkTask, policy_period: float, normalize: str) -> list[Contestant]:
    """What ``policy`` is, looked at in a ``task``: of a folder each training seed. ``ValueError`` names what is allowed."""
    one = _contestant_of(policy, task, policy_period, normalize)
    if one.kind != RESIDUAL:
        return [one]
    folders = folders_of(in_task(one.given, task))
    if len(folders) == 1:
        return [one]
    return [replace(one, name=f"{one.name} {own.name}", run=k) for k, own in enumerate(folders)]


def folders_of(path: str) -> list[Path]:
    """``policy_folders``; ``ValueError`` where the extra is missing that reads them."""
    try:
        from agents.policy.seeds import policy_folders
    except ImportError as error:
        raise ValueError(f"{error}; policy = {shown(path)} needs {installation('agents')}") from error
    return policy_folders(path)


def _contestant_of(policy: Any, task: BenchmarkTask, policy_period: float, normalize: str) -> Contestant:
    text = path_of(policy)
    if text is None:
        if is_ready(policy):
            return Contestant(_called(policy), "controller", policy)
        found = acting_part(policy)
        if found is None:
            raise ValueError(f"policy = {shown(policy)}; allowed: {ALLOWED}")
        return Contestant(_called(found), "policy", found, policy_period)
    place = in_task(text, task)
    own = Contestant(Path(text).name or text, "controller", text, policy_period, normalize)
    if Path(place).suffix in SUFFIXES:
        return replace(own, kind=algorithm_in(Path(place)) if place.endswith(SUFFIXES[0]) else ONNX)
    if normalize:
        raise ValueError(f"normalize = {shown(normalize)} with policy = {shown(text)}; allowed: with FILE.zip")
    if place.rpartition(":")[0].endswith(".py"):
        return own if acting_part(from_file("policy", place)) is None else replace(own, kind="policy")
    if place in names("policy") or Path(place).is_dir():
        return replace(own, kind=RESIDUAL)
    if bare_name(place) not in names("controller"):
        known = [*names("controller"), *names("policy")]
        raise ValueError(f"policy = {shown(text)}{near(place, known)}; allowed: {ALLOWED}")
    return own


def _called(thing: Any) -> str:
    return str(getattr(thing, "__name__", type(thing).__name__))
