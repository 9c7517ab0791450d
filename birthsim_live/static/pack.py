"""What a rig in the browser is made of, as JSON: rows, the rig, scenarios, sensors, controllers, and the page's greeting.

A stage is the name of its function, its constants, the memory of a lane that starts, and its tables. Arrays are base64 of
their bytes, little-endian, so that every bit arrives. The files of ``static/page/worker`` read it.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

import birthsim_env
from agents.policy.files import load_policy
from agents.policy.seeds import best_policy, shipped_names
from agents.policy.stage import policy_stage
from agents.residual.law import ResidualLaw
from baselines.staged import LawStage, StagedController
from birthsim_build.image import INPUT_MEMORY, function_name
from birthsim_build.layout import FIRST, Inputs
from birthsim_build.stages import enter_scenario, outside
from birthsim_env.assembly import policy_periods
from birthsim_env.info import Info
from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.stage import Stage
from birthsim_env.loop.world import plant_stage
from birthsim_env.parts.actuation import VALVE_LAYOUTS
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.parts.scenarios import SCENARIOS
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.physics import options, spools
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import PARAMETER_NAMES, parameter_array, parameter_column
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig import clock, frames, hand, recorder, recording, stages
from birthsim_live.rig.controllers import build_controller, has_damping
from birthsim_live.rig.lane import PASSES, begun, on_their_clock, path_of, valve_stages
from birthsim_live.rig.session import HIGHEST, LOWEST
from birthsim_live.rig.settings import RESIDUAL, STIFFNESSES, Choices, opening_settings
from birthsim_live.server.hub import surroundings

SEED = 0
"""Of the world: that of ``Session``."""

EPISODES = 16
"""So many episodes have sensors of their own; then those of the first come again."""

INPUTS = "inputs"
"""What a stage has as its memory whose memory are the inputs."""

WITHOUT = "only with birthsim-live"
"""What the page says of a controller that is not compiled."""


class Packer:
    """Packs stages, and keeps the ``functions`` (``module:name``) that they call, in the order of their numbers."""

    def __init__(self) -> None:
        self.functions: list[str] = []

    def stage(self, stage: Stage | LawStage) -> dict[str, Any]:
        """A stage as JSON."""
        memory = stage.fresh if isinstance(stage, LawStage) else stage.memory
        tables = () if isinstance(stage, LawStage) else stage.tables
        return {
            "function": self.number(stage),
            "constants": packed(stage.constants),
            "memory": INPUTS if memory is INPUT_MEMORY else None if memory is None else packed(memory),
            "tables": [{"shape": list(table.shape), "data": packed(table)} for table in tables],
        }

    def number(self, stage: Stage | LawStage) -> int:
        """The number of a stage's function in the code."""
        name = function_name(cast(Stage, stage))
        if name not in self.functions:
            self.functions.append(name)
        return self.functions.index(name)


def packed(array: NDArray[Any]) -> str:
    """The bytes of an array."""
    return base64.b64encode(np.ascontiguousarray(array).astype(array.dtype.newbyteorder("<")).tobytes()).decode()


def pack(rig: Parameters, packer: Packer, policies: Sequence[str] = ()) -> dict[str, Any]:
    """All that a rig in the browser is made of; the functions of its stages are the packer's. It opens with the first of
    ``policies`` (folders or shipped names), where there is one.

    Raises ``ValueError`` for a rig with options of ``physics.options``.
    """
    if not options.are_off(parameter_array(rig, 1)) or not spools.are_perfect(parameter_array(rig, 1)):
        raise ValueError(
            "the rig has imperfect valves, tubes, a weak supply or a soft structure; allowed without a server: none"
        )
    choices, period = Choices(rig, policies), rig.electronics.control_period
    controllers = {one["name"]: one for one in choices.controllers}
    made = {name: law for name in controllers if (law := controller(name, rig, packer)) is not None}
    for name, one in controllers.items():
        if name not in made:
            one["missing"] = WITHOUT
    hello = surroundings(rig, choices)
    return {
        "birthsim": birthsim_env.__version__,
        "hello": hello,
        "settings": hello["defaults"],
        "opens": {"controller": opening_settings(rig, policies).controller},
        "stiffnesses": STIFFNESSES,
        "period": period,
        "rows": {
            **{name.upper(): group.first for layout in (World, Seen) for name, group in layout.groups.items()},
            "WORLD": World.size, "SEEN": Seen.size,
            "inputs": {name: group.first for name, group in Inputs.groups.items()},
        },
        "info": {
            **{name: [group.first, group.count] for name, group in Info.groups.items()},
            "friction": [Info.size, 2], "flows": [Info.size + 2, 4],
        },
        "rig": rig_numbers(rig),
        "inputs": packed(FIRST), "passes": PASSES,
        "range": {"low": packed(LOWEST), "high": packed(HIGHEST), "names": at.STATE_NAMES},
        "stages": {
            "plant": packer.stage(plant_stage(Plant(rig), period)),
            "begin": packer.stage(Stage(stages.begin, parameter_column(rig))),
            "show": packer.stage(Stage(stages.show, memory=np.zeros((stages.SHOWN, 1)))),
            "enter": packer.stage(Stage(enter_scenario, memory=INPUT_MEMORY)),
            "outside": packer.stage(Stage(outside, memory=INPUT_MEMORY)),
            "valves": {name: [packer.stage(stage) for stage in valve_stages(name)] for name in VALVE_LAYOUTS},
        },
        "scenarios": {name: scenario(name, packer) for name in SCENARIOS},
        "sensors": {name: sensors(name, rig, packer) for name in SENSORS},
        "controllers": made,
        "numbers": numbers_of_the_page(),
        "header": {
            "format": recording.FORMAT, "birthsim": birthsim_env.__version__, "rig": rig.to_dict(),
            "columns": list(frames.FIELDS), "interval": recorder.EVERY * period,
        },
    }  # fmt: skip


def rig_numbers(rig: Parameters) -> dict[str, Any]:
    """The rig's column, and what of it follows from the mass and friction that are set (``settings.true_rig``)."""
    cylinders = (rig.cylinder1, rig.cylinder2)
    return {
        "column": packed(parameter_column(rig)),
        "rows": {name: row for row, name in enumerate(PARAMETER_NAMES)},
        "coulomb": [one.coulomb_friction for one in cylinders],
        "viscous": [one.viscous_friction for one in cylinders],
        "static_ratio": rig.friction.static_ratio,
    }


def scenario(name: str, packer: Packer) -> dict[str, Any]:
    """A scenario: its stages, which are the same in every episode, and the path of its target."""
    parts: Any = begun(name, SEED, 0)
    target, force, setpoints = (packer.stage(part.stage()) for part in parts)
    duration = SCENARIOS[name].duration
    return {"duration": duration, "target": target, "force": force, "setpoints": setpoints, "path": path_of(parts, duration)}


def sensors(name: str, rig: Parameters, packer: Packer) -> dict[str, Any]:
    """A sensor model: its stages, and for each episode what its random numbers have put into their tables."""
    model: Any = SENSORS[name](rig.electronics, 1)
    episodes = []
    for episode in range(EPISODES):
        model.begin(0, stream(SEED, episode, "sensors"))
        own = [model.stage(), *([model.board_stage()] if hasattr(model, "board_stage") else [])]
        own = [one for stage in own for one in on_their_clock(stage, rig.electronics.control_period, INPUT_MEMORY)]
        episodes.append([[packed(table) for table in stage.tables] for stage in own])
    drawn = [
        [k for k, tables in enumerate(zip(*every, strict=True)) if len(set(tables)) > 1]
        for every in zip(*episodes, strict=True)
    ]
    begun = [[{k: tables[k] for k in changing} for tables, changing in zip(every, drawn, strict=True)] for every in episodes]
    return {"sampled": model.sampled, "stages": [packer.stage(stage) for stage in own], "begun": begun}


def controller(name: str, rig: Parameters, packer: Packer) -> dict[str, Any] | None:
    """A controller whose law is compiled, for measured and for sampled positions; None where it is not."""
    if name.startswith(f"{RESIDUAL}:"):
        return residual(name.partition(":")[2], rig, packer)
    try:
        law = build_controller(name, rig)
    except (ImportError, ValueError):
        return None
    return _law(law, packer) if isinstance(law, StagedController) else None


def _law(law: StagedController, packer: Packer) -> dict[str, Any]:
    kinds = {kind: [packer.stage(one) for one in law.law_stages(kind == "sampled")] for kind in ("measured", "sampled")}
    return {**kinds, "damped": has_damping(law)}


def residual(policy: str, rig: Parameters, packer: Packer) -> dict[str, Any]:
    """A law with a policy on top, whose stage is in a file of its own."""
    settings = load_policy(best_policy(policy)).settings
    law = ResidualLaw(rig, settings)
    told = {"size": settings.size, "shown": law.shown.shape[0], "force_sensor": settings.force_sensor}
    return {**_law(law, packer), "policy": {"file": policy_file(policy), **told}}


def policy_file(policy: str) -> str:
    """Where the stage of a policy is, below the folder of the rig."""
    return f"policies/{re.sub(r'[^A-Za-z0-9_-]+', '.', policy)}.json"


def packed_policies(rig: Parameters, packer: Packer, policies: Sequence[str] = ()) -> dict[str, dict[str, Any]]:
    """File -> the stage of every policy that comes with the package and of ``policies``, of several seeds the best."""
    files = {}
    for name in (*shipped_names(), *policies):
        stored = load_policy(best_policy(name))
        periods, law = policy_periods(stored.settings.policy_period, rig), ResidualLaw(rig, stored.settings)
        stage = policy_stage(stored.network, periods, stored.settings.size, law.shown.shape[0], parameter_column(rig), 1)
        files[policy_file(name)] = packer.stage(stage)
    return files


def numbers_of_the_page() -> dict[str, float]:
    """Constants of ``birthsim_live.rig``, which the worker shares."""
    return {
        "patience": hand.PATIENCE,
        "every": recorder.EVERY, "longest": recorder.LONGEST, "slowest": clock.SLOWEST,
    }  # fmt: skip
