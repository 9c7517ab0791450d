"""The closed loops that are built: environment, sensors and controller as parts, the same stages as in Python."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeGuard, cast

import gymnasium
import numpy as np

from baselines.named import compiled_names, make_controller
from baselines.staged import StagedController
from birthsim_build.image import INPUT_MEMORY, Part, Words, packed_image, packed_part, packed_rows
from birthsim_build.stages import enter_scenario, outside, pair_valves
from birthsim_env.loop import pipeline
from birthsim_env.loop.rows import DAMPING, FEEDFORWARD, MOTION, PRESSURE, SEEN, STATE, WORLD
from birthsim_env.loop.stage import Stage
from birthsim_env.loop.world import guide_stage, plant_stage
from birthsim_env.physics.compiled.lanes import PARAMETERS, STATES, Array
from birthsim_env.physics.idle import idle_pressures
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters

_BUILT = {
    "actuation": ("policy", "law", "valves"),
    "target": ("clock", "target"),
    "start": (),
    "hand": ("hand", "inputs", "start", "rest"),
    "outcome": ("show",),
}
ORDER = tuple(name for step in pipeline.ORDER for name in _BUILT.get(step, (step,)))
"""Parts in the order in which a control period runs them: that of an environment, with a person's inputs, on which a start on
the page depends. The page alone has policy, start, rest (what its plant then remembers) and show."""

CLOCK = Part((Stage(enter_scenario, memory=INPUT_MEMORY),), {})
"""The part before those of a scenario, as ``inputs_part`` is behind them."""

PAIRED_VALVES = Part((Stage(pair_valves, sees_world=False),), {})
"""The part ``valves`` of a rig with one 5/3 valve per cylinder; with two there is none."""


def inputs_part(rig: Parameters) -> Part:
    """What a person does, of whose force a rail bears what acts across it."""
    guide = (guide_stage(),) if rig.linkage.is_rail else ()
    return Part((Stage(outside, memory=INPUT_MEMORY), *guide), {})


@dataclass(frozen=True)
class World:
    """A scenario with its sensors where an episode begins: ``rows`` (WORLD + SEEN,), and all parts but the law."""

    rows: Array
    parts: dict[str, Part]
    sampled: bool


def scenario_world(environment: str, sensors: str, rig: Parameters, seed: int = 0) -> World:
    """The nominal scenario ``environment`` (an id) where the episode seeded ``seed`` begins."""
    period = rig.electronics.control_period
    env: Any = gymnasium.make_vec(environment, num_envs=1, sensors=sensors, parameters=rig, policy_period=period)
    env.reset(seed=seed)
    simulation = env.unwrapped.simulation
    groups = {name: simulation.pipeline.group(name) for name in pipeline.ORDER if name not in ("actuation", "outcome")}
    # What a rail bears of a hand's force it bears of a person's too, behind which its guide stands.
    guide = guide_stage().function
    groups["hand"] = [stage for stage in groups["hand"] if stage.function is not guide]
    parts = {name: Part(tuple(stages), {}) for name, stages in groups.items() if stages}
    parts |= {"clock": CLOCK, "inputs": inputs_part(rig)}
    parts = {name: parts[name] for name in ORDER if name in parts}
    return World(np.concatenate(simulation.rows())[:, 0], parts, simulation.sensors.sampled)


def law_part(controller: str, rig: Parameters, sampled: bool) -> Part:
    """A controller as a part, from what is measured to openings. Raises ``ValueError`` for one that is not compiled."""
    return staged_part(compiled_law(controller, rig), sampled)


def compiled_law(controller: str, rig: Parameters) -> StagedController:
    """A controller that believes in ``rig``. Raises ``ValueError`` for one that is not compiled."""
    law = make_controller(controller, rig)
    if not is_compiled(law):
        raise ValueError(f"controller = {controller!r}; allowed: a compiled one: {', '.join(compiled_names())}")
    return law


def is_compiled(law: object) -> TypeGuard[StagedController]:
    """Whether a controller is nothing but stages."""
    return isinstance(law, StagedController) and law.is_compiled()


def staged_part(law: StagedController, sampled: bool) -> Part:
    """A compiled law as a part."""
    law.prepare(1, sampled)
    placed = law.more_rows(1) if law.asks else [(np.zeros((DAMPING - FEEDFORWARD, 1)), FEEDFORWARD)]
    rows = {WORLD + first + k: value for array, first in placed for k, value in enumerate(array[:, 0].tolist())}
    return Part(tuple(cast(list[Stage], law.stages())), rows)


def alone_rows(rig: Parameters) -> Array:
    """Rows (WORLD + SEEN,) of a controller alone before anything is measured: zeros, but of the cells that a rail lacks.

    Laws read those all the same: they show what is in the idle cylinder, whose valves are shut.
    """
    rows = np.zeros(WORLD + SEEN)
    for chamber, pressure in idle_pressures(rig).items():
        rows[WORLD + PRESSURE + chamber] = pressure
    return rows


def plant_world(rig: Parameters) -> World:
    """The plant alone: at mid stroke, at rest, with pressures that balance the weight; from openings and the hand's force."""
    plant, period = Plant(rig), rig.electronics.control_period
    rows = np.zeros(WORLD + SEEN)
    rows[:PARAMETERS], rows[STATE : STATE + STATES] = plant.lane_parameters[:, 0], plant.state[:, 0]
    rows[MOTION : MOTION + 4] = plant.end_effector()[:, 0]
    return World(rows, {"plant": Part((plant_stage(plant.lane_parameters, plant.memory, period),), {})}, False)


def image_of(rows: Array, parts: Mapping[str, Part], functions: Sequence[str]) -> Words:
    """The image of a loop of ``parts``, run in the order of ``ORDER``; ``functions`` are those of the code."""
    several = [parts[name] for name in ORDER if name in parts]
    return packed_image(packed_rows(rows, several), [packed_part(part, functions) for part in several])
