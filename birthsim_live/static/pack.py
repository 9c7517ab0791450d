"""What a rig in the browser is made of, as JSON: rows, the rig, scenarios, sensors, controllers, and the page's greeting.

A stage is the name of its function, its constants, the memory of a lane that starts, and its tables. Arrays are base64 of
their bytes, little-endian, so that every bit arrives. The files of ``static/worker`` read it.
"""

from __future__ import annotations

import base64
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

import birthsim_env
from agents.policy.files import WEIGHTS, load_policy
from agents.policy.network import CLIP, EPSILON
from agents.policy.seeds import best_policy
from agents.residual.law import ResidualLaw
from baselines.staged import LawStage, StagedController
from birthsim_env import info
from birthsim_env.assembly import policy_periods
from birthsim_env.loop import rows
from birthsim_env.loop.stage import Stage
from birthsim_env.loop.world import plant_stage
from birthsim_env.observation import SIZE
from birthsim_env.parts.actuation import VALVE_LAYOUTS, ValveActuation
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.parts.scenarios import SCENARIOS
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.physics import options, spools
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import BLOCK
from birthsim_env.physics.compiled.lanes import PARAMETER_NAMES, parameter_array, parameter_column
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.rig import bridge, clock, frames, hand, recorder, recording, setpoints
from birthsim_live.rig.controllers import build_controller, has_damping
from birthsim_live.rig.session import HIGHEST, LOWEST, PATH_POINTS
from birthsim_live.rig.settings import RESIDUAL, STIFFNESSES, Choices, default_settings
from birthsim_live.server.hub import surroundings
from birthsim_live.static import stages

SEED = 0
"""Of the world: that of ``Session``."""

EPISODES = 16
"""So many episodes have sensors of their own; then those of the first come again."""

WITHOUT = "only with birthsim-live"
"""What the page says of a controller that is not compiled."""

class Packer:
    """Packs stages, and keeps the ``functions`` that they call."""

    def __init__(self) -> None:
        self.functions: dict[str, Callable[..., int]] = {}

    def stage(self, stage: Stage | LawStage) -> dict[str, Any]:
        """A stage as JSON."""
        memory = stage.fresh if isinstance(stage, LawStage) else stage.memory
        tables = () if isinstance(stage, LawStage) else stage.tables
        return {
            "function": self.function(stage.function),
            "constants": packed(stage.constants),
            "memory": None if memory is None else packed(memory),
            "tables": [{"shape": list(table.shape), "data": packed(table)} for table in tables],
        }

    def function(self, function: Any) -> str:
        """The name of a stage's function in the code."""
        name = f"{function.py_func.__module__}.{function.py_func.__name__}".replace(".", "_")
        self.functions[name] = function
        return name


def packed(array: NDArray[Any]) -> str:
    """The bytes of an array."""
    return base64.b64encode(np.ascontiguousarray(array).astype(array.dtype.newbyteorder("<")).tobytes()).decode()


def pack(rig: Parameters, packer: Packer) -> dict[str, Any]:
    """All that a rig in the browser is made of; the functions of its stages are the packer's.

    Raises ``ValueError`` for a rig with options of ``physics.options``.
    """
    if not options.are_off(parameter_array(rig, 1)) or not spools.are_perfect(parameter_array(rig, 1)):
        raise ValueError("the rig has imperfect valves, tubes, a weak supply or a soft structure; allowed without a server: none")
    choices, period = Choices(rig), rig.electronics.control_period
    controllers = {one["name"]: one for one in choices.controllers}
    made = {name: law for name in controllers if (law := controller(name, rig, packer)) is not None}
    for name, one in controllers.items():
        if name not in made:
            one["missing"] = WITHOUT
    hello = surroundings(rig, choices)
    return {
        "birthsim": birthsim_env.__version__,
        "hello": hello,
        "settings": default_settings(rig).model_dump(),
        "stiffnesses": STIFFNESSES,
        "block": BLOCK,
        "period": period,
        "rows": {name: getattr(rows, name) for name in dir(rows) if name.isupper() and isinstance(getattr(rows, name), int)},
        "info": {name: [part.start, part.stop - part.start] for name, part in info.SLICES.items()},
        "rig": rig_numbers(rig),
        "range": {"low": packed(LOWEST), "high": packed(HIGHEST), "names": at.STATE_NAMES},
        "stages": {
            "plant": packer.stage(plant_stage(Plant(rig), period)),
            "begin": packer.stage(Stage(stages.begin, parameter_column(rig))),
            "show": packer.stage(Stage(stages.show, memory=np.zeros((info.ROWS, 1)))),
            "neurons": packer.function(stages.neurons),
            "valves": {name: packer.stage(ValveActuation(name).stages(1, False)[0]) for name in VALVE_LAYOUTS},
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
    parts = SCENARIOS[name].nominal()
    for part in parts:
        part.prepare(1)
        part.begin(0, stream(SEED, 0, "reference"))
    instants = np.linspace(0.0, SCENARIOS[name].duration, PATH_POINTS)
    points = np.round(np.concatenate([parts[0].sample(np.array([t]))[:2] for t in instants], axis=1).T, 6)
    trajectory, force, schedule = (packer.stage(part.stage()) for part in parts)
    return {
        "duration": SCENARIOS[name].duration,
        "trajectory": trajectory,
        "force": force,
        "schedule": schedule,
        "path": (points if np.ptp(points, axis=0).any() else points[:1]).tolist(),
    }


def sensors(name: str, rig: Parameters, packer: Packer) -> dict[str, Any]:
    """A sensor model: its stages, and for each episode what its random numbers have put into their tables."""
    model: Any = SENSORS[name](rig.electronics, 1)
    episodes = []
    for episode in range(EPISODES):
        model.begin(0, stream(SEED, episode, "sensors"))
        own = [model.stage(), *([model.board_stage()] if hasattr(model, "board_stage") else [])]
        episodes.append([[packed(table) for table in stage.tables] for stage in own])
    drawn = [
        [k for k, tables in enumerate(zip(*every, strict=True)) if len(set(tables)) > 1] for every in zip(*episodes, strict=True)
    ]
    begun = [
        [{k: tables[k] for k in changing} for tables, changing in zip(every, drawn, strict=True)] for every in episodes
    ]
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
    """A law with a policy on top: what the policy sees is a stage too, and its network is in ``file``."""
    settings = load_policy(best_policy(policy)).settings
    law = ResidualLaw(rig, settings)
    shown, column = law.shown.shape[0], parameter_column(rig)
    observation = np.zeros((1, SIZE + settings.size + shown), dtype=np.float32)
    see = Stage(stages.see, np.array([settings.size, shown, *column]), tables=(observation,))
    return {
        **_law(law, packer),
        "policy": {
            "file": f"policies/{policy}.safetensors",
            "size": settings.size,
            "shown": shown,
            "periods": policy_periods(settings.policy_period, rig),
            "force_sensor": settings.force_sensor,
            "see": packer.stage(see),
            "clip": CLIP,
            "epsilon": EPSILON,
        },
    }


def network_file(policy: str) -> bytes:
    """The content of the safetensors file of a policy that comes with the package."""
    return (best_policy(policy) / WEIGHTS).read_bytes()


def numbers_of_the_page() -> dict[str, float]:
    """Constants of ``birthsim_live.rig``, which the worker shares."""
    return {
        "least_time": bridge.LEAST_TIME, "pace": bridge.PACE, "negligible": bridge.NEGLIGIBLE,
        "setpoint_transition": setpoints.TRANSITION, "hand_transition": hand.TRANSITION,
        "drag_limit": hand.DRAG_LIMIT, "drag_damping": hand.DRAG_DAMPING,
        "least_force": frames.LEAST_FORCE, "least_given": frames.LEAST_GIVEN,
        "every": recorder.EVERY, "longest": recorder.LONGEST, "slowest": clock.SLOWEST,
    }  # fmt: skip
