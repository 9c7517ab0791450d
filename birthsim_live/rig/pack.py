"""What a rig in the browser is made of: its parts, as of ``birthsim_build``, and what the worker must know besides, as JSON.

The files of ``page/worker`` read it. The code of the parts is the same for every rig and policy.
"""

import warnings
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

import birthsim_env
from baselines.controller import RESIDUAL, Controller
from baselines.named import make_controller
from baselines.staged import StagedController
from birthsim_build.faces.module import Store
from birthsim_build.image import INPUT_MEMORY, Part, function_name
from birthsim_build.loops import CLOCK, ORDER, PAIRED_VALVES, inputs_part, is_compiled, staged_part
from birthsim_build.stages import Period, enter_sensors, leave_sensors
from birthsim_env.info import Info
from birthsim_env.loop.rows import ASKED, WORLD
from birthsim_env.loop.stage import Stage, stage_of
from birthsim_env.loop.world import FurtherStates, Start, plant_stage, start_stages
from birthsim_env.parts.courses import checked_start
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.parts.scenarios import Parts, find_scenario, scenarios_for
from birthsim_env.parts.sensors.model import SensorModel
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Array, parameter_array, parameter_column
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.topology import RAIL
from birthsim_env.physics.strength import require_carried
from birthsim_env.registry import entry, names
from birthsim_env.reward import PRESSURE_RANGE, TEMPERATURE_RANGE
from birthsim_live.logs.recording import EVERY, FIELDS, FORMAT
from birthsim_live.rig import stages
from birthsim_live.rig.folder import Packed
from birthsim_live.rig.greeting import OPENS, OPENS_WITH, greeting
from birthsim_live.rig.words import LEARNING, controller_choice

EPISODES = 16
"""So many episodes have sensors of their own; then those of the first come again."""

PATH_POINTS = 400

WITHOUT = {"scenario": "only in Python", "sensors": "only in Python", "controller": "only with birthsim live"}
"""What the page says of what is not compiled, or not in its code."""

LEARNED = f"{RESIDUAL}:circle_apg"
"""The controller whose network the page exchanges for one that it learns (``learning.LEARNER``)."""

INFO = {
    "joints": "piston_position", "position": "position", "velocity": "velocity", "target": "target",
    "compliant": "compliant_target", "pressures": "pressure", "openings": "opening", "stiffness": "stiffness_setpoint",
    "pneumatic": "pneumatic_stiffness", "pneumatic_setpoint": "pneumatic_stiffness_setpoint",
}  # fmt: skip
"""Field of a frame -> what it is in ``Info``."""

NUMBERS = {"patience": 3.0, "every": EVERY, "longest": 600.0, "slowest": 0.05}
"""Assumed: s after which a hand that has not been heard of lets go (the page tells of one that rests every 0.3 s, and a window
that is frozen would pull for ever); control periods between rows of a recording; s after which it ends; least speed, of real
time."""


def pack(rig: Parameters, policies: Sequence[str], functions: list[str] | None = None, others: Sequence[str] = ()) -> Packed:
    """All that a rig in the browser is made of, with ``policies`` (folders or shipped names) and, of ``others`` than the
    controllers that are listed, those that are compiled; for code that has ``functions``, without them for code that is to be
    built.

    Raises ``ValueError`` for a rig that cannot do what the page opens with.
    """
    column = parameter_array(rig, 1)

    def plant(rigs: Array) -> Stage:
        return plant_stage(rigs, np.zeros((FurtherStates.size, 1)), period)

    # The code serves worn valves and tubes too, and a start that leaves what any of them remembers.
    worn, tubes = column.copy(), column.copy()
    worn[at.PLAY], tubes[at.TUBE_LENGTH] = 0.01, 1.0
    learns = [LEARNING] if policies and not rig.linkage.is_rail else []
    chosen = [*names("controller", listed=True), *(f"{RESIDUAL}:{one}" for one in policies), *learns, *others]
    period = rig.electronics.control_period
    start, rest = start_stages(np.zeros((Start.size, 1)), column[:, 0], plant(tubes))
    laws = {name: law for name in chosen if is_compiled(law := _made(name, rig))}
    made: dict[str, dict[str, Any]] = {
        "scenarios": {name: scenario(name, rig) for name in scenarios_for(rig)},
        "sensors": {name: sensors(name, rig) for name in names("sensors")},
        "controllers": {name: controller_parts(law) for name, law in laws.items()},
    }
    parts = {kind: {name: own for name, own in group.items() if _serves(own, functions)} for kind, group in made.items()}
    controllers = [controller_choice(name) for name in chosen if name in parts["controllers"] or name not in others]
    tree = {
        "rig": {
            "plant": _part(plant(column)), "clock": CLOCK, "inputs": inputs_part(rig),
            "start": _part(start), "rest": _part(rest),
            "show": _part(Stage(stages.show, memory=np.zeros((stages.SHOWN, 1)))),
        },
        "valves": {"two_valves": {}, "one_valve": {"valves": PAIRED_VALVES}},
        **parts,
    }  # fmt: skip
    if functions is None:
        functions = sorted(_needed([tree, _part(plant(worn)), _part(plant(tubes)), *_of_rails()]))
    store, hello = Store(functions), greeting(rig, controllers)
    for kind, group in (("scenario", "scenarios"), ("sensors", "sensors"), ("controller", "controllers")):
        for one in hello["choices"][kind]:
            if one["name"] not in parts[group]:
                one["missing"] = WITHOUT[kind]
    for one in hello["choices"]["scenario"]:
        if "missing" not in one and (problem := _problem(one["name"], rig)):
            one |= {"missing": "not with this rig", "about": problem}
    numbers = _numbered(tree, store)
    content = {
        "birthsim": birthsim_env.__version__,
        "functions": functions,
        "hello": hello,
        "opens": {"controller": OPENS},
        "python": [],
        "signals": [WORLD, ASKED],
        "info": {
            **{name: [Info.groups[own].first, FIELDS[name]] for name, own in INFO.items()},
            "friction": [Info.size, 2], "flows": [Info.size + 2, 4],
        },
        "rig": rig_numbers(rig),
        "range": {
            at.STATE_NAMES[row]: limits
            for rows, limits in ((at.PRESSURES, PRESSURE_RANGE), (at.TEMPERATURES, TEMPERATURE_RANGE)) for row in rows
        },
        "parts": numbers,
        "scenarios": {
            name: {"duration": (lasts := find_scenario(name).duration), "path": path_of(begun(name, rig), lasts)}
            for name in parts["scenarios"]
        },
        "sampled": {name: entry("sensors", name).made.sampled for name in parts["sensors"]},
        "damped": {name: "damping_factor" in laws[name].COMMAND_OPTIONS for name in parts["controllers"]},
        "numbers": NUMBERS,
        "header": {
            "format": FORMAT, "birthsim": birthsim_env.__version__, "rig": rig.to_dict(), "columns": list(FIELDS),
            "interval": EVERY * period,
        },
    }  # fmt: skip
    index = {"period": period, "order": ORDER, "zero": store.rows(None), "parts": store.parts}
    return Packed(content, index, store.words)


def rig_numbers(rig: Parameters) -> dict[str, Any]:
    """The rig's column, and what of it follows from the mass and friction that are set; a locked cylinder 1 is not ``free``."""
    cylinders = (rig.cylinder1, rig.cylinder2)
    return {
        "column": parameter_column(rig).tolist(),
        "free": rig.linkage.free,
        "coulomb": [one.coulomb_friction for one in cylinders],
        "pressed": [one.pressure_friction for one in cylinders],
        "viscous": [one.viscous_friction for one in cylinders],
    }


def begun(name: str, rig: Parameters) -> Parts:
    """Target, hand and setpoints of a nominal scenario, which are the same in every episode."""
    parts: Parts = find_scenario(name).on(rig).nominal()
    for part, channel in zip(parts, ("reference", "user_force", "stiffness"), strict=True):
        part.prepare(1)  # type: ignore[attr-defined]
        part.begin(0, stream(0, 0, channel))  # type: ignore[attr-defined]
    return parts


def scenario(name: str, rig: Parameters) -> dict[str, Part]:
    """A scenario's parts; none where one of them is not compiled."""
    target, force, setpoints = begun(name, rig)
    named = {"target": (target, "sample"), "setpoints": (setpoints, "sample"), "hand": (force, "force")}
    stages = {kind: stage for kind, part in named.items() if (stage := stage_of(*part))}
    return {kind: _part(stage) for kind, stage in stages.items()} if len(stages) == len(named) else {}


def path_of(scenario: Parts, duration: float) -> list[list[float]]:
    """Where the target goes within ``duration`` s, m; one point where it rests."""
    instants = np.linspace(0.0, duration, PATH_POINTS)
    points = np.round(np.concatenate([scenario[0].sample(np.array([t]))[:2] for t in instants], axis=1).T, 6)
    return (points if np.ptp(points, axis=0).any() else points[:1]).tolist()  # type: ignore[no-any-return]


def _problem(name: str, rig: Parameters) -> str:
    """Why a rig cannot do a scenario: its target leaves the workspace, or the rig cannot carry its weight there."""
    target, _, setpoints = begun(name, rig)
    try:
        start = checked_start(target, setpoints, np.array([0]), 1, find_scenario(name).duration, rig)
        require_carried(start[:2], rig)
    except ValueError as error:
        if name == OPENS_WITH[rig.linkage.kind]:
            raise
        return str(error)
    return ""


def sensors(name: str, rig: Parameters) -> list[dict[str, Part]]:
    """The parts of a sensor model, for each episode; none where it is not compiled. The stages have a clock of their own."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the list of models says what one needs of the rig, and this packs all
        model: SensorModel = entry("sensors", name).made(rig.electronics, 1)
    period, episodes = rig.electronics.control_period, list[Any]()
    enter, leave = (Stage(one, Period.numbers(period=period), INPUT_MEMORY) for one in (enter_sensors, leave_sensors))
    for episode in range(EPISODES):
        model.begin(0, stream(0, episode, "sensors"))
        own = {"sensors": stage_of(model, "measure")}
        if model.has_board:
            own["board"] = stage_of(model, "put_out", "board_stage")
        stages = {kind: stage for kind, stage in own.items() if stage}
        if len(stages) < len(own):
            return []
        for stage in stages.values():
            stage.tables = tuple(table.copy() for table in stage.tables)
        episodes.append({kind: _part(enter, stage, leave) for kind, stage in stages.items()})
    return episodes


def _made(name: str, rig: Parameters) -> Controller | None:
    """The controller ``name``; None where it cannot be made. ``ValueError`` for a policy that is none."""
    try:
        return make_controller(LEARNED if name == LEARNING else name, rig)
    except (ImportError, ValueError):
        if name.startswith(RESIDUAL):
            raise
        return None


def controller_parts(law: StagedController) -> dict[str, dict[str, Part]]:
    """The parts of a compiled controller, for exact and for sampled positions."""
    parts = {}
    for kind, sampled in (("exact", False), ("sampled", True)):
        whole = staged_part(law, sampled)
        # What guards the signals comes first, before a policy or else before the law.
        policies = len(law.policy_stages())
        count = policies + 1 if policies else 0
        policy = {"policy": Part(whole.stages[:count], whole.rows)} if count else {}
        parts[kind] = {**policy, "law": Part(whole.stages[count:], {} if count else whole.rows)}
    return parts


def _part(*own: Stage) -> Part:
    return Part(own, {})


def _of_rails() -> list[Any]:
    """Parts of rigs with one cylinder: the code of every rig has their functions too."""
    rail = Parameters().replace({"linkage.kind": RAIL})
    return [inputs_part(rail), *(scenario(name, rail) for name in scenarios_for(rail))]


def _needed(tree: Any) -> set[str]:
    """Names of the functions that parts need."""
    return {function_name(stage) for part in _all(tree) for stage in part.stages}


def _serves(tree: Any, functions: list[str] | None) -> bool:
    """Whether there are parts, and code that has ``functions`` has theirs."""
    return bool(tree) and (functions is None or _needed(tree) <= set(functions))


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
