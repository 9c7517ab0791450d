"""The experiments, one a file: what the end effector should do, what the hand does, and what stiffness is asked for.

All values in them are assumed unless a source stands beside them; (0.5, 0) m is the centre of the workspace.
``docs/obstetrics.md`` lists every value with its source.
"""

import inspect
import re
from typing import Any, ClassVar, Self

from birthsim_env.parts.hands.user_forces import UserForce
from birthsim_env.parts.references import Trajectory
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.physics.rig.topology import TWO_CYLINDERS
from birthsim_env.registry import entries, entry

MEASURED_RIG = "its rig has the valves and seals that others measured (docs/validation.md), and its worlds are drawn anew"

Parts = tuple[Trajectory, UserForce, StiffnessSchedule]
"""What a scenario is made of: target, hand and stiffness setpoints."""


class Scenario:
    """One experiment. It is registered in its own file by ``@register(scenario="name", about="...")``.

    The first line of its docstring says what happens in it, for the table of ``BirthSIMEnv``. Its id is
    ``BirthSIM/Name-vVERSION``, and ``BirthSIM/NameResidual-vVERSION`` with a controller inside.
    """

    title: ClassVar[str]
    """What stands above pictures of it."""

    duration: ClassVar[float]
    """s until it ends."""

    version: ClassVar[int] = 0
    """The version in its id. A change of trajectories or rewards takes a new one."""

    changed: ClassVar[str] = "its trajectories or rewards changed"
    """What changed with ``version``, for whoever asks for a former one."""

    studied: ClassVar[bool] = False
    """Whether studies measure it. Reference scores, fingerprints and a training's configuration are then stored of it."""

    scored: ClassVar[bool] = False
    """Whether reference scores are stored of it though studies do not measure it."""

    linkage: ClassVar[str] = TWO_CYLINDERS
    """``linkage.kind`` of the rigs that it is for; without ``parameters`` it is done with the default one of them."""

    def on(self, rig: Parameters) -> Self:
        """Itself, as it is on a rig; ``ValueError`` for a rig that it is not for."""
        if rig.linkage.kind != self.linkage:
            raise ValueError(f"parameters: linkage.kind = {rig.linkage.kind!r} in {self.title!r}; allowed: {self.linkage!r}")
        return self

    @property
    def experiment(self) -> str:
        """What happens in it, in a line."""
        return (inspect.getdoc(self) or "").partition("\n")[0].rstrip(".")

    def nominal(self) -> Parts:
        """Its parts, the same in every episode."""
        raise NotImplementedError(f"{type(self).__name__}.nominal() is missing; it returns target, hand and setpoints")

    def varied(self) -> Parts:
        """Its parts where ``randomize`` draws it: numbers are ranges (low, high). By default nothing is drawn."""
        return self.nominal()


def find_scenario(name: str) -> Scenario:
    """The scenario that is registered under a name; ``ValueError`` names those that there are."""
    found: Scenario = entry("scenario", name).made()
    return found


def rig_of(name: str, parameters: Any) -> Parameters:
    """The rig of the scenario ``name``: ``parameters``, as ``load_parameters`` takes them, else the default that it is for."""
    if parameters is not None:
        return load_parameters(parameters)
    return Parameters().replace({"linkage.kind": find_scenario(name).linkage})


def scenarios_for(rig: Parameters) -> list[str]:
    """Names of the scenarios that can be done with a rig."""
    return [one.name for one in entries("scenario") if one.made.linkage == rig.linkage.kind]


def studied_scenarios() -> list[str]:
    """Names of the scenarios that studies measure, and of which numbers are stored."""
    return [one.name for one in entries("scenario") if one.made.studied]


def scored_scenarios() -> list[str]:
    """Names of the scenarios of which reference scores are stored."""
    return [one.name for one in entries("scenario") if one.made.studied or one.made.scored]


def environment_id(scenario: str, kind: str = "") -> str:
    """Gymnasium's id of a scenario; ``kind`` "Residual" is the one with a law inside."""
    versions = {one.name: one.made.version for one in entries("scenario")}
    if scenario not in versions:
        entry("scenario", scenario)  # refuses it
    name = "".join(word.capitalize() for word in re.split(r"\W|_", scenario))
    return f"BirthSIM/{name}{kind}-v{versions[scenario]}"
