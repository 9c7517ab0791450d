"""What a rig in the browser is made of: its parts, as of ``birthsim_build``, and what the worker must know besides, as JSON.

The files of ``static/page/worker`` read it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import birthsim_env
from baselines.staged import StagedController
from birthsim_build.faces.javascript import Store
from birthsim_build.image import INPUT_MEMORY, Part, Words, function_name
from birthsim_build.loops import CLOCK, INPUTS, ORDER, law_part
from birthsim_build.residual import residual_parts
from birthsim_env.info import Info
from birthsim_env.loop.stage import Stage
from birthsim_env.loop.world import plant_stage
from birthsim_env.parts.actuation import VALVE_LAYOUTS
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.parts.scenarios import SCENARIOS
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.physics import options, spools
from birthsim_env.physics.compiled.lanes import STATE_NAMES, parameter_array, parameter_column
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

WITHOUT = "only with birthsim live"
"""What the page says of a controller that is not compiled."""


@dataclass(frozen=True)
class Packed:
    """What the worker must know (``content``), the ``functions`` of the code, the module's ``index`` and the ``words`` of all
    parts."""

    content: dict[str, Any]
    functions: list[str]
    index: dict[str, Any]
    words: Words


def pack(rig: Parameters, policies: Sequence[str] = ()) -> Packed:
    """All that a rig in the browser is made of. It opens with the first of ``policies`` (folders or shipped names), where there
    is one.

    Raises ``ValueError`` for a rig with options of ``physics.options``.
    """
    if not options.are_off(parameter_array(rig, 1)) or not spools.are_perfect(parameter_array(rig, 1)):
        raise ValueError(
            "the rig has imperfect valves, tubes, a weak supply or a soft structure; allowed without a server: none"
        )
    choices, period = Choices(rig, policies), rig.electronics.control_period
    controllers = {one["name"]: one for one in choices.controllers}
    laws = {name: law for name in controllers if (law := controller(name, rig)) is not None}
    for name, one in controllers.items():
        if name not in laws:
            one["missing"] = WITHOUT
    parts = {
        "rig": {
            "plant": _part(plant_stage(Plant(rig), period)), "clock": CLOCK, "inputs": INPUTS,
            "start": _part(Stage(stages.begin, parameter_column(rig))),
            "show": _part(Stage(stages.show, memory=np.zeros((stages.SHOWN, 1)))),
        },
        "valves": {name: {"valves": _part(*valve_stages(name))} if valve_stages(name) else {} for name in VALVE_LAYOUTS},
        "scenarios": {name: scenario(name) for name in SCENARIOS},
        "sensors": {name: sensors(name, rig) for name in SENSORS},
        "controllers": laws,
    }  # fmt: skip
    functions = sorted({function_name(stage) for part in _all(parts) for stage in part.stages})
    store = Store(functions)
    hello, numbers = surroundings(rig, choices), _numbered(parts, store)
    content = {
        "birthsim": birthsim_env.__version__,
        "hello": hello,
        "settings": hello["defaults"],
        "opens": {"controller": opening_settings(rig, policies).controller},
        "stiffnesses": STIFFNESSES,
        "passes": PASSES,
        "info": {
            **{name: [group.first, group.count] for name, group in Info.groups.items()},
            "friction": [Info.size, 2], "flows": [Info.size + 2, 4],
        },
        "rig": rig_numbers(rig),
        "range": {
            name: [float(low), float(high)]
            for name, low, high in zip(STATE_NAMES, LOWEST, HIGHEST, strict=True) if np.isfinite([low, high]).all()
        },
        "parts": numbers,
        "scenarios": {
            name: {"duration": one.duration, "path": path_of(begun(name, SEED, 0), one.duration)}
            for name, one in SCENARIOS.items()
        },
        "sampled": {name: kind.sampled for name, kind in SENSORS.items()},
        "damped": {name: has_damping(build_controller(name, rig)) for name in laws},
        "numbers": {
            "patience": hand.PATIENCE, "every": recorder.EVERY, "longest": recorder.LONGEST, "slowest": clock.SLOWEST,
        },
        "header": {
            "format": recording.FORMAT, "birthsim": birthsim_env.__version__, "rig": rig.to_dict(),
            "columns": list(frames.FIELDS), "interval": recorder.EVERY * period,
        },
    }  # fmt: skip
    index = {"period": period, "order": ORDER, "zero": store.rows(None), "parts": store.parts}
    return Packed(content, functions, index, store.words)


def rig_numbers(rig: Parameters) -> dict[str, Any]:
    """The rig's column, and what of it follows from the mass and friction that are set (``settings.true_rig``)."""
    cylinders = (rig.cylinder1, rig.cylinder2)
    return {
        "column": parameter_column(rig).tolist(),
        "coulomb": [one.coulomb_friction for one in cylinders],
        "viscous": [one.viscous_friction for one in cylinders],
        "static_ratio": rig.friction.static_ratio,
    }


def scenario(name: str) -> dict[str, Part]:
    """A scenario's parts, which are the same in every episode."""
    target, force, setpoints = (_part(part.stage()) for part in begun(name, SEED, 0))  # type: ignore[union-attr]
    return {"target": target, "setpoints": setpoints, "hand": force}


def sensors(name: str, rig: Parameters) -> list[dict[str, Part]]:
    """The parts of a sensor model, for each episode."""
    model, period, episodes = SENSORS[name](rig.electronics, 1), rig.electronics.control_period, []  # type: Any, float, list[Any]
    for episode in range(EPISODES):
        model.begin(0, stream(SEED, episode, "sensors"))
        own = {"sensors": model.stage(), **({"board": model.board_stage()} if hasattr(model, "board_stage") else {})}
        for stage in own.values():
            stage.tables = tuple(table.copy() for table in stage.tables)
        episodes.append({kind: _part(*on_their_clock(stage, period, INPUT_MEMORY)) for kind, stage in own.items()})
    return episodes


def controller(name: str, rig: Parameters) -> dict[str, dict[str, Part]] | None:
    """The parts of a controller whose law is compiled, for exact and for sampled positions; None where it is not."""
    kinds = {"exact": False, "sampled": True}
    if name.startswith(f"{RESIDUAL}:"):
        policy = name.partition(":")[2]
        return {
            kind: dict(zip(("policy", "law"), residual_parts(rig, flag, policy), strict=True)) for kind, flag in kinds.items()
        }
    try:
        compiled = isinstance(build_controller(name, rig), StagedController)
    except (ImportError, ValueError):
        return None
    return {kind: {"law": law_part(name, rig, flag)} for kind, flag in kinds.items()} if compiled else None


def _part(*own: Stage) -> Part:
    return Part(own, {})


def _all(tree: Any) -> Iterator[Part]:
    if isinstance(tree, Part):
        yield tree
    else:
        for one in tree.values() if isinstance(tree, dict) else tree:
            yield from _all(one)


def _numbered(tree: Any, store: Store) -> Any:
    """The tree with the number of each part in its place."""
    if isinstance(tree, Part):
        return store.number(tree)
    if isinstance(tree, dict):
        return {name: _numbered(one, store) for name, one in tree.items()}
    return [_numbered(one, store) for one in tree]
