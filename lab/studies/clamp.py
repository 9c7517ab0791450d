"""How much controllers tremble in hands of several stiffnesses, on rigs that are drawn and frictions of the sweep."""

from itertools import product
from typing import Any, cast

import numpy as np

from baselines.bench.pieces import controller_settings, file_stem
from baselines.bench.statistics import jsonable, penalize_lost, quantile
from baselines.named import make_controller
from baselines.staged import StagedController
from baselines.work.tasks import Result, Task
from birthsim_env.parts.drawn.frictions import with_friction
from birthsim_env.physics.compiled.sources import ROOT
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.registry import register
from lab.engine import information
from lab.engine.information import Row
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import SPREAD, Cell, Head, markdown
from lab.engine.worlds import worlds
from lab.studies.haptics.worlds import POSES, Condition, lost_lanes
from lab.studies.held import CLAMP, DAMPING, hold
from lab.studies.sensorless.privileged import Privileged
from lab.studies.shaken import STIFFNESS, at_rest

SENSORS = "honest"

LANES = 64
"""Worlds of a piece."""


BEST = (Row("admittance-adaptive"), Row("admittance-adaptive", information.TOLD))
"""Of these each friction is shown."""

ROWS = (
    *BEST,
    Row("admittance-backstepping"),
    Row("limited:admittance-adaptive"),
    Row("admittance-sensorless"),
    Row("admittance-sensorless", information.TOLD, "examples/acceleration_sensor_rig.toml"),
    Row("disturbance-observer"),
    Row("pid"),
    Row("backstepping"),
)

HANDS = ((5e3, DAMPING), (1e4, DAMPING), (CLAMP, 20.0), (CLAMP, DAMPING), (CLAMP, 200.0), (5e4, DAMPING))
"""N/m and N s/m; assumed."""

DRAWN = "lugre-drawn"
"""The friction of the table of hands: that of the rigs that are drawn everywhere."""

KEPT = {"force": "N", "press": "N", "air": "l/min", "turns": "1/s"}


def measure(
    controller: str, source: str, rig: dict[str, Any], told: bool, stiffness: float, damping: float, seed: int, lanes: int
) -> Result:
    """Of worlds with the seeds ``seed`` on, lists over them by names of ``KEPT``, and which were lost.

    ``source`` only tells controllers of different files apart.
    """
    condition = Condition(controller, Parameters.from_dict(rig), SENSORS, seed, lanes, force_sensor=True)
    rigs, reference = condition.drawn(), at_rest(lanes, POSES, STIFFNESS)
    law = condition.law()
    if told:
        law = Privileged([cast(StagedController, make_controller(controller, one)) for one in rigs])
    port = condition.port(law, rigs, reference)
    felt = hold(port, reference, stiffness, damping)
    return {**{name: felt[name].tolist() for name in KEPT}, "lost": lost_lanes(port, rigs).tolist()}


def _cases(options: Options) -> list[tuple[Row, tuple[float, float], str]]:
    """What is measured: row, hand and friction."""
    hands = [(row, hand, DRAWN) for row, hand in product(ROWS, HANDS)]
    return hands + [(row, (CLAMP, DAMPING), friction) for row, friction in product(BEST, options.friction)]


def _tasks(options: Options) -> dict[Any, Task]:
    found = {}
    for row, (stiffness, damping), friction in _cases(options):
        rig = with_friction(load_parameters(ROOT / row.file if row.file else None), friction)
        own = controller_settings(row.controller, rig)
        last = options.seed + options.episodes
        for first in range(options.seed, last, LANES):
            hand = {"stiffness": stiffness, "damping": damping, "seed": first, "lanes": min(LANES, last - first)}
            stem = f"{friction}/{file_stem(row.controller)}-{row.rig}-{stiffness:g}-{damping:g}-{first}"
            more = {"told": row.rig == information.TOLD, **hand}
            found[row, (stiffness, damping), friction, first] = Task(stem, measure, {**own, **more})
    return found


def _kept(options: Options, found: Found) -> Any:
    figures = []
    for row, hand, friction in _cases(options):
        pieces = [result for key, result in found.items() if key[:3] == (row, hand, friction)]
        lost = np.concatenate([piece["lost"] for piece in pieces])
        one = {**row._asdict(), "stiffness": hand[0], "damping": hand[1], "friction": friction, "lost": int(lost.sum())}
        for name in KEPT:
            values = penalize_lost(np.concatenate([piece[name] for piece in pieces]), lost)
            one[name] = [quantile(values, share) for share in (0.5, 0.95, 1.0)]
        figures.append(one)
    return jsonable(figures)


def _shown(content: Content) -> dict[str, str]:
    settings = content["settings"]
    by = {
        (Row(one["controller"], one["rig"], one["file"]), (one["stiffness"], one["damping"]), one["friction"]): one
        for one in content["figures"]
    }
    heads = [Head(f"{stiffness / 1e3:g} kN/m, {damping:g} N s/m", SPREAD) for stiffness, damping in HANDS]
    clamp = f"{CLAMP / 1e3:g} kN/m, {DAMPING:g} N s/m"
    others = (Head("presses, N", SPREAD), Head("air, l/min", SPREAD), "lost")
    whole: list[list[Cell | Head]] = [["controller", *information.COLUMNS, *heads, *others]]
    for row in ROWS:
        held = [by[row, hand, DRAWN] for hand in HANDS]
        middle = by[row, (CLAMP, DAMPING), DRAWN]
        lost = str(sum(one["lost"] for one in held))
        name = f"`{row.controller}`" + (" with an acceleration sensor" if row.file else "")
        felt = [one["force"][:2] for one in held]
        whole.append([name, *row.facts(SENSORS), *felt, middle["press"][:2], middle["air"][:2], lost])
    frictions: list[list[Cell | Head]] = [
        ["controller", *information.COLUMNS, *(Head(f"`{name}`", SPREAD) for name in settings["friction"])]
    ]
    for row in BEST:
        felt = [by[row, (CLAMP, DAMPING), name]["force"][:2] for name in settings["friction"]]
        frictions.append([f"`{row.controller}`", *row.facts(SENSORS), *felt])
    said = (
        f"{worlds(settings['seed'], settings['episodes'])}, {SENSORS} sensors, rigs drawn, spring of {STIFFNESS / 1e3:g} kN/m. "
        "Columns of hands: the force that the hand feels, N peak to peak, in the last 2 s of 5, by the hand's stiffness and "
        f"damping. What it is pressed with on average, and air, are those of the hand of {clamp}. 95 % is the 95th percentile. "
        f"{information.LEGEND}"
    )
    sweep = "[sweep](../explanation/friction.md#is-it-the-friction-that-controllers-expect)"
    other = f"In the hand of {clamp}, frictions of the {sweep}:"
    return {"clamp.md": f"{said}\n\n{markdown(whole)}\n\n{other}\n\n{markdown(frictions)}\n"}


STUDY = Study(
    {"friction": ("lugre", "lugre-soft", "lugre-stiff", "coulomb", "gms"), "episodes": 64, "seed": 87_000_000},
    _tasks,
    _kept,
    KEPT,
    _shown,
    words={"friction": "names of the sweep", "episodes": "rigs that are drawn"},
)
register(study="clamp", about="how much controllers tremble in a stiff hand")(STUDY)
