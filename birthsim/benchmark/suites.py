"""Suites of tasks, declared once: environments, sensors, options.

``classic`` is saturated, for debugging; ``open`` is not. ``rail`` has the tasks of one cylinder.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from baselines.estimation.rig_filter import TOLD
from birthsim.benchmark.scale import ends
from birthsim_env.assembly import one_of
from birthsim_env.ids import rig_for
from birthsim_env.parts.drawn.frictions import with_friction
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import near, shown
from birthsim_env.registry import entry, names

WIDE = {name: list(bounds) for name, bounds in TOLD.items()}
"""Ranges of rigs far beyond those of training: 1 to 10 kg, 4 to 9 bar, and bores, friction, lag and dead volume."""


@dataclass(frozen=True)
class BenchmarkTask:
    """An environment with sensors and options, in which rig and scenario are drawn.

    Parameters
    ----------
    name : str
        In tables and rows.
    environment : str
        Its id.
    sensors : str
        The sensor model.
    force_sensor : bool
        Whether the hand's force is measured.
    friction : str
        What the friction of plants is drawn from, see ``birthsim_env.parts.drawn.frictions``; "" is as the rig says.
    ranges : mapping
        Ranges of the rig's parameters, dotted name -> (low, high), instead of the documented ones.
    """

    name: str
    environment: str
    sensors: str = "ideal"
    force_sensor: bool = True
    friction: str = ""
    ranges: Mapping[str, Any] = field(default_factory=dict)

    @property
    def rig(self) -> Parameters:
        """The rig as controllers and policies believe it."""
        return rig_for(self.environment, None)

    @property
    def world(self) -> dict[str, Any]:
        """The environment's arguments, as JSON takes them."""
        world: dict[str, Any] = {"sensors": self.sensors, "randomize": True}
        if not self.force_sensor:
            world["force_sensor"] = False
        if self.friction or self.ranges:
            drawn = with_friction(self.rig, self.friction).to_dict()
            world["parameters"] = {**drawn, "randomize": {**drawn.get("randomize", {}), **self.ranges}}
        return world

    @property
    def options(self) -> dict[str, Any]:
        """What differs from the environment's defaults, besides its sensors."""
        chosen = {"force_sensor": self.force_sensor, "friction": self.friction, "ranges": dict(self.ranges)}
        usual = {"force_sensor": True, "friction": "", "ranges": {}}
        return {name: value for name, value in chosen.items() if value != usual[name]}

    @property
    def scenario(self) -> str:
        """The name of the scenario of its environment."""
        return next(one for one in names("scenario") if environment_id(one) == self.environment)

    @property
    def is_scored(self) -> bool:
        """Whether there is a scale of scores for it."""
        return ends(self.name) is not None


def _tasks(scenarios: str, sensors: str, suffix: str = "", **options: Any) -> tuple[BenchmarkTask, ...]:
    return tuple(
        BenchmarkTask(f"{scenario}-{sensors}{suffix}", environment_id(scenario), sensors, **options)
        for scenario in scenarios.split()
    )


ALL = "circle probe descent forceps dystocia vacuum"

SUITES: dict[str, tuple[BenchmarkTask, ...]] = {
    "classic": (*_tasks(ALL, "ideal"), *_tasks("circle", "lab")),
    "open": (
        *_tasks("probe descent forceps dystocia vacuum", "lab"),
        *_tasks(ALL, "honest"),
        *_tasks(ALL, "honest", "-no-force", force_sensor=False),
        *_tasks("circle probe", "honest", "-friction", friction="drawn"),
        *_tasks("circle probe", "honest", "-wide", ranges=WIDE),
    ),
    # A bench has an encoder at its rod. While the hand's force grows in rail-stiffness, damping keeps even a perfect controller
    # away from where the spring alone would be. So only those are judged there that do not feel the hand, and err by far more.
    "rail": (
        *_tasks("rail rail-steps", "ideal"),
        *_tasks("rail rail-steps", "encoders"),
        *_tasks("rail", "encoders", "-friction", friction="drawn"),
        *_tasks("rail rail-stiffness", "encoders", "-no-force", force_sensor=False),
    ),
}
"""Name -> tasks. A change of a suite takes a new name."""

BOTH = "all"
"""Name of ``classic`` and ``open`` together; tasks of a rail have other spaces."""

TASKS = {one.name: one for tasks in SUITES.values() for one in tasks}
"""Name -> task, of every suite."""


def find_suite(name: str) -> tuple[BenchmarkTask, ...]:
    """The tasks of a suite, or of ``BOTH``; ``ValueError`` names those that there are."""
    known = {**SUITES, BOTH: (*SUITES["classic"], *SUITES["open"])}
    if not isinstance(name, str) or name not in known:
        asked = near(name, known) if isinstance(name, str) else ""
        raise ValueError(f"suite = {shown(name)}{asked}; allowed: {', '.join(known)}")
    return known[name]


def find_task(name: str) -> BenchmarkTask:
    """The task of a name; ``ValueError`` names those that there are."""
    if not isinstance(name, str) or name not in TASKS:
        asked = near(name, TASKS) if isinstance(name, str) else ""
        raise ValueError(f"task = {shown(name)}{asked}; allowed: {', '.join(TASKS)}")
    return TASKS[name]


def task_of(environment: str, sensors: str, force_sensor: bool) -> BenchmarkTask:
    """A single task, as it is called in a suite where it is in one."""
    own = BenchmarkTask("", environment, entry("sensors", sensors).name, one_of("force_sensor", force_sensor, (True, False)))
    for task in TASKS.values():
        if (task.environment, task.world) == (own.environment, own.world):
            return task
    name = environment.removeprefix("BirthSIM/").rpartition("-v")[0].lower()
    return BenchmarkTask(f"{name}-{sensors}{'' if force_sensor else '-no-force'}", environment, sensors, force_sensor)
