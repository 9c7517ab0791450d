"""What a training is: its settings, and the files that hold them, one per scenario."""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any, TypeVar

from agents.residual.settings import ResidualSettings
from agents.training.algorithm import HYPERPARAMETERS, Algorithm
from birthsim_env.assembly import one_of
from birthsim_env.ids import rig_for
from birthsim_env.parts.drawn.frictions import with_friction
from birthsim_env.parts.drawn.randomization import RANDOMIZE
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.reading import read_toml
from birthsim_env.physics.rig.values import checked_count, checked_number, in_line, make_plain, near, path_of, shown, whole_of
from birthsim_env.registry import entry, names

COUNTS = {
    "steps": (1, 10**10), "seed": (0, 2**32 - 1), "lanes": (1, 2**16), "rollout": (1, 2**16), "batch": (2, 2**20),
    "epochs": (1, 1000), "gradient_steps": (1, 1000), "memory": (0, 2048), "horizon": (0, 2**16),
    "validation_lanes": (1, 2**16), "validations": (1, 10**4),
}  # fmt: skip
"""Least and largest of what is counted; a batch of one has no spread to normalise its advantages by."""

LAYERS, WIDEST = 8, 2048
"""Hidden layers, and units in one."""

TARGETS = ("spring", "impedance")
"""Where an end effector should be: on the compliant target (19), or where ``admittance``'s mass, damper and spring would be."""

COLLECTED = 2**22
"""Steps of all lanes that an algorithm keeps between updates: some hundred floats each."""

SPECIAL: dict[str, Any] = {
    "target": TARGETS[0], "beside": (), "noise": 0.0, "memory": 0, "privileged": False, "horizon": 0, "most_cost": 0.0,
}  # fmt: skip
"""Settings that only some algorithms take, and what they are for the others."""

OF_ALGORITHM: Any = None
"""A setting that is what the algorithm says (``agents.training.algorithm.HYPERPARAMETERS``)."""

FOLDER = Path(__file__).resolve().parent.parent / "configurations"


S = TypeVar("S", "TrainingSettings", ResidualSettings)


@dataclass(frozen=True)
class TrainingSettings:
    """An experiment and its algorithm, whose hyperparameters are its own where they are None.

    PPO uses ``rollout``, ``epochs`` and ``gae_lambda``, recurrent PPO also ``memory``, the cells of its policy's memory; SAC
    and TQC use ``gradient_steps``, per step of all lanes; the analytic policy gradient (apg) uses ``rollout``, ``memory``,
    ``learning_rate`` and ``discount``. Its gradients go back through the memory to the beginning of a rollout, and through the
    plant for ``horizon`` policy steps, of which a rollout is a multiple; 0 is the rollout. Where ``most_cost`` m (mm) is not
    zero, a policy step costs it c m/(c + m) instead of c, so that rigs that are too weak for what is asked do not decide where
    all go. It alone takes another ``target`` than the spring, and worlds ``beside`` those of ``environment``, which share the
    lanes evenly: each an id, and after a space the name of a hand where it is not the scenario's. It alone adds ``noise`` to
    actions, a normal one whose standard deviation falls linearly to zero: within the overlap of valves a policy that drives
    them has no gradient without it. The learning rate falls linearly to a hundredth. The training ends early once the pooled
    settled error of its policy in validation is ``until`` percent below that of the paper's law; with 100 it never ends early.
    Training draws rigs that oscillate more easily than those of validation, by a ``margin`` (``agents.training.margin``). A
    ``privileged`` policy observes the true parameters of the rig (``agents.residual.privileged``), and runs in no controller.
    ``friction`` names what the friction of rigs is drawn from, in training and in validation (``parts.drawn.frictions``).
    Raises ``ValueError`` naming what cannot be.
    """

    environment: str = "BirthSIM/CircleResidual-v2"
    algorithm: str = "ppo"
    steps: int = 3_000_000
    seed: int = 0
    sensors: str = "ideal"
    randomize: bool | str = True
    lanes: int = OF_ALGORITHM
    rollout: int = OF_ALGORITHM
    batch: int = OF_ALGORITHM
    epochs: int = OF_ALGORITHM
    gradient_steps: int = OF_ALGORITHM
    learning_rate: float = OF_ALGORITHM
    discount: float = OF_ALGORITHM
    gae_lambda: float = OF_ALGORITHM
    log_std: float = OF_ALGORITHM
    hidden: tuple[int, ...] = OF_ALGORITHM
    memory: int = OF_ALGORITHM
    validation_lanes: int = 64
    validations: int = 6
    until: float = 100.0
    privileged: bool = False
    target: str = "spring"
    beside: tuple[str, ...] = ()
    margin: float = 0.0
    noise: float = 0.0
    horizon: int = 0
    most_cost: float = 0.0
    friction: str = ""

    def __post_init__(self) -> None:
        for name, allowed in (
            ("algorithm", tuple(names("algorithm"))),
            ("sensors", tuple(names("sensors"))),
            ("randomize", RANDOMIZE),
            ("privileged", (True, False)),
            ("target", TARGETS),
        ):
            one_of(name, getattr(self, name), allowed)
        algorithm = algorithm_of(self.algorithm)
        for name, value in algorithm.defaults().items():
            if getattr(self, name) is OF_ALGORITHM:
                object.__setattr__(self, name, value)
        if not isinstance(self.environment, str):
            raise ValueError(f"environment = {shown(self.environment)}; allowed: the id of a residual environment")
        for name, (few, many) in COUNTS.items():
            object.__setattr__(self, name, checked_count(name, getattr(self, name), few, many))
        for name, unit, low, high in (
            *((name, "-", 0.0, 1.0) for name in ("learning_rate", "discount", "gae_lambda")),
            ("until", "%", 0.0, 100.0),
        ):
            checked_number(name, getattr(self, name), unit, above=low, most=high)
        checked_number("most_cost", self.most_cost, "mm", least=0.0, most=1e4)
        checked_number("log_std", self.log_std, "-", least=-20.0, most=2.0)
        for name in ("margin", "noise"):
            checked_number(name, getattr(self, name), "-", least=0.0, most=1.0)
        make_plain(self)
        widths = [whole_of(width) or 0 for width in self.hidden] if isinstance(self.hidden, tuple) else []
        if not (all(1 <= width <= WIDEST for width in widths) and 1 <= len(widths) <= LAYERS):
            raise ValueError(f"hidden = {shown(self.hidden)}; allowed: 1 to {LAYERS} whole numbers from 1 to {WIDEST}")
        object.__setattr__(self, "hidden", tuple(widths))
        if not (isinstance(self.beside, tuple) and all(isinstance(one, str) for one in self.beside)):
            raise ValueError(f"beside = {shown(self.beside)}; allowed: ids of residual environments, with hands after a space")
        for name, plain in SPECIAL.items():
            if name not in algorithm.takes and getattr(self, name) != plain:
                raise ValueError(
                    f"{name} = {shown(getattr(self, name))} with algorithm = {self.algorithm!r}; allowed: {plain!r}"
                )
        groups = 1 + len(self.beside)
        for name in ("lanes", "validation_lanes"):
            if getattr(self, name) % groups:
                raise ValueError(
                    f"{name} = {getattr(self, name)}; allowed: a multiple of {groups}, one part for each of the worlds"
                )
        self._check_friction()
        if complaint := algorithm.complaint(self):
            raise ValueError(complaint)
        if algorithm.collects and self.lanes * self.rollout > COLLECTED:
            raise ValueError(
                f"lanes = {self.lanes} with rollout = {self.rollout}; allowed: a product of at most {COLLECTED}, the steps "
                "between two updates"
            )

    def _check_friction(self) -> None:
        if not self.friction:
            return
        one_of("friction", self.friction, ("", *names("friction")))
        if self.randomize not in (True, "plant"):
            raise ValueError(
                f"friction = {self.friction!r} with randomize = {self.randomize!r}; allowed: randomize = True or "
                "'plant', which draw rigs"
            )

    def rig(self, parameters: Any = None) -> Parameters:
        """The rig that ``parameters=`` describes, about which rigs are drawn."""
        return with_friction(rig_for(self.environment, parameters), self.friction)

    def to_dict(self) -> dict[str, Any]:
        """As JSON takes it."""
        return {**asdict(self), "hidden": list(self.hidden), "beside": list(self.beside)}

    def without_algorithm(self) -> dict[str, Any]:
        """The hyperparameters that are those of its algorithm, as ``OF_ALGORITHM``: another one takes its own instead."""
        own = algorithm_of(self.algorithm).defaults()
        return {name: OF_ALGORITHM for name in HYPERPARAMETERS if getattr(self, name) == own[name]}

    def worlds(self) -> list[tuple[str, dict[str, Any]]]:
        """The id of each kind of worlds, and its hand as an argument, where it is not the scenario's."""
        named = [one.partition(" ") for one in (self.environment, *self.beside)]
        return [(name, {"user_force": hand} if hand else {}) for name, _, hand in named]


def algorithm_of(name: str) -> Algorithm:
    """The algorithm of a name; raises ``ValueError`` where none is registered."""
    made: Algorithm = entry("algorithm", name).made()
    return made


def configuration_names() -> list[str]:
    """The configurations that come with the package."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def load_configuration(name: str | os.PathLike[str]) -> tuple[TrainingSettings, ResidualSettings]:
    """Settings from a TOML file with tables ``[training]`` and ``[residual]``, or from one that comes with the package.

    Raises ``ValueError`` naming the file and what it has that is unknown.
    """
    text = path_of(name) or ""
    path = FOLDER / f"{text}.toml" if text in configuration_names() else Path(text)
    if not os.path.isfile(path):
        raise ValueError(
            f"configuration = {shown(text or name)} is no file{near(text, configuration_names())}; allowed: "
            f"{', '.join(configuration_names())}, or a TOML file"
        )
    content = read_toml("configuration", path)
    for table in content:
        if table not in ("training", "residual"):
            raise ValueError(f"configuration = {str(path)!r}: table {shown(table)}; allowed: training, residual")
        if not isinstance(content[table], dict):
            raise ValueError(f"configuration = {str(path)!r}: {table} = {shown(content[table])}; allowed: a table [{table}]")
    training, residual = content.get("training", {}), content.get("residual", {})
    try:
        return override(TrainingSettings(), **training), override(ResidualSettings(), **residual)
    except ValueError as error:
        raise ValueError(f"configuration = {str(path)!r}: {error}") from error


def override(settings: S, **values: Any) -> S:
    """``settings`` with other values, lists as tuples; raises ``ValueError`` for names that they have not.

    Another algorithm brings its own hyperparameters, in the place of those that were the first one's.
    """
    known = [field.name for field in fields(settings)]
    for name, value in values.items():
        if name not in known:
            raise ValueError(f"{in_line(name)} = {shown(value)} is unknown; allowed: {', '.join(known)}")
        values[name] = tuple(value) if isinstance(value, list) else value
    if isinstance(settings, TrainingSettings) and values.get("algorithm", settings.algorithm) != settings.algorithm:
        values = {**settings.without_algorithm(), **values}
    return replace(settings, **values)
