"""What is built together: scenarios with sensors, laws, and the plant; with the code that all need."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from baselines.controller import RESIDUAL
from birthsim_build.image import Part, Words, function_name
from birthsim_build.loops import PAIRED_VALVES, World, alone_rows, image_of, law_part, plant_world, scenario_world
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import entry, names

LAW, PLANT = "law_", "plant"
"""How names of controllers alone begin, and the name of the plant alone; all others are closed loops."""


@dataclass(frozen=True)
class Bundle:
    """Worlds by (scenario, sensors), laws by (controller, whether positions are samples) and the plant alone, of one rig."""

    rig: Parameters
    worlds: dict[tuple[str, str], World]
    laws: dict[tuple[str, bool], Part]
    plant: World | None

    @property
    def functions(self) -> list[str]:
        """Names of the functions that the code must have, in order."""
        worlds = [*self.worlds.values(), *([] if self.plant is None else [self.plant])]
        parts = [*(part for world in worlds for part in world.parts.values()), *self.laws.values()]
        if self.worlds:
            parts.append(PAIRED_VALVES)
        return sorted({function_name(stage) for part in parts for stage in part.stages})

    def images(self) -> dict[str, Words]:
        """Every closed loop, every law alone and the plant alone as images, by names that C takes."""
        functions = self.functions
        named = {} if self.plant is None else {PLANT: image_of(self.plant.rows, self.plant.parts, functions)}
        for (controller, sampled), law in self.laws.items():
            named[law_name(controller, sampled)] = image_of(alone_rows(self.rig), {"law": law}, functions)
        for (scenario, sensors), world in self.worlds.items():
            for (controller, sampled), law in self.laws.items():
                if sampled == world.sampled:
                    named[loop_name(scenario, sensors, controller)] = image_of(
                        world.rows, {"law": law, **world.parts}, functions
                    )
        return named


def identifier(name: str) -> str:
    """A name as C takes it."""
    return re.sub(r"\W", "_", name)


def loop_name(scenario: str, sensors: str, controller: str) -> str:
    """The name of a closed loop as C takes it."""
    return "_".join(map(identifier, (scenario, sensors, controller)))


def law_name(controller: str, sampled: bool) -> str:
    """The name of a controller alone as C takes it."""
    return f"{LAW}{identifier(controller)}_{'sampled' if sampled else 'exact'}"


def scenario_of(environment: str) -> str:
    """The scenario of an environment's id; ``ValueError`` names those that there are."""
    known = {environment_id(name): name for name in names("scenario")}
    if environment not in known:
        raise ValueError(f"--env {environment!r}; allowed: {', '.join(known)}")
    return known[environment]


def make_bundle(
    rig: Parameters,
    scenarios: Iterable[str],
    sensors: Iterable[str],
    controllers: Sequence[str],
    policies: Sequence[str] = (),
    seed: int = 0,
    alone: bool = False,
) -> Bundle:
    """Worlds of all ``scenarios`` and ``sensors``, where episodes seeded ``seed`` begin, and laws for them.

    The ``policies``, folders or names of those that come with the package, become controllers ``residual:NAME``. Laws ``alone``
    have no worlds and no plant with them. Raises
    ``ValueError`` for what there is not or is not compiled.
    """
    pairs = [] if alone else [(scenario, kind) for scenario in scenarios for kind in sensors]
    worlds = {(scenario, kind): scenario_world(environment_id(scenario), kind, rig, seed) for scenario, kind in pairs}
    kinds = sorted({entry("sensors", kind).made.sampled for kind in sensors})
    names = [*controllers, *(f"{RESIDUAL}:{name}" for name in policies)]
    laws = {(name, kind): law_part(name, rig, kind) for name in names for kind in kinds}
    return Bundle(rig, worlds, laws, None if alone else plant_world(rig))
