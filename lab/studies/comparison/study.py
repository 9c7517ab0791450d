"""Every controller in the same worlds: what is compared where, and the figures that are kept of it."""

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from baselines.bench.statistics import jsonable
from baselines.work.tasks import Result, Task
from birthsim_env.physics.rig.parameters import load_parameters
from birthsim_env.registry import names, register
from lab.engine.information import LEGEND
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study, no_pictures
from lab.engine.worlds import COUNT, SEED, worlds
from lab.studies.comparison.grid import (
    COMPARED,
    ENVIRONMENTS,
    LEARNED,
    METRICS,
    PLANTS,
    Conditions,
    all_conditions,
    cell_task,
    default_controllers,
    gather,
    settings_of,
    statistics,
)
from lab.studies.comparison.headline import CONTROLLERS, headline, is_shown
from lab.studies.comparison.tables import (
    CIRCLE,
    FORCEPS,
    IN_FULL,
    PROBE,
    RATIO,
    SUMMARY,
    Figures,
    by_sensors,
    data,
    losses,
    overview,
    settled,
)

COLUMNS = ("environment", "sensors", "plant", "hand", "controller", "metric", *SUMMARY, *RATIO, "lost", "episodes")
"""Of the figures; ``SUMMARY`` is in the metric's unit."""

Key = tuple[str, Conditions, str]
"""What the figures call it, where it is measured, and which of its training seeds it is, if it was trained."""


JointReference = Callable[[str, Conditions], bool]
"""Whether a controller, by name, is measured under some conditions."""


def anywhere(name: str, where: Conditions) -> bool:
    """Every controller is, everywhere."""
    return True


def with_own_hand(name: str, where: Conditions) -> bool:
    """Every controller is, where the hand is the environment's own."""
    return not where.hand


def cells(options: Options, wanted: JointReference = anywhere) -> dict[Key, Task]:
    """The pieces: every controller under all conditions that the options leave and that are ``wanted``."""
    rig = load_parameters(options.parameters or None)
    conditions = all_conditions(options.env, options.sensors, options.plant)
    if not conditions:
        raise ValueError(f"--plant {' '.join(options.plant)}; allowed: with --sensors honest, whose figures can be drawn")
    if "residual" in options.controller:
        raise ValueError(f"--controller 'residual'; allowed: {LEARNED}POLICY, a folder or one of {', '.join(names('policy'))}")
    found = {
        (name, where, member): cell_task(own, where, options.episodes, options.seed)
        for name in dict.fromkeys(options.controller)
        for member, own in settings_of(name, rig).items()
        for where in conditions
        if wanted(name, where)
    }
    if not found:
        asked = f"--controller {' '.join(options.controller)} --sensors {' '.join(options.sensors)}"
        raise ValueError(f"{asked}; allowed: a policy with the sensors that it was trained for")
    return found


def together(found: Found) -> dict[tuple[str, Conditions], Result]:
    """The results of all training seeds as those of one controller."""
    joined: dict[tuple[str, Conditions], Result] = {}
    for (name, where, _), result in found.items():
        one = joined.setdefault((name, where), {"metrics": {}, "lost": [], "cost": result["cost"]})
        one["lost"] = [*one["lost"], *result["lost"]]
        one["metrics"] = {metric: [*one["metrics"].get(metric, ()), *values] for metric, values in result["metrics"].items()}
    return joined


def kept(options: Options, found: Found) -> Any:
    """Every figure as a row with ``COLUMNS``, to six digits: tables have three."""
    rows = []
    for cell in statistics(gather(together(found))):
        place = [cell[name] for name in COLUMNS[:5]]
        for metric in IN_FULL:
            if metric in cell["metrics"]:
                ratio = cell["ratios"].get(metric)
                ratios = [ratio and _digits(ratio[name]) for name in SUMMARY[:3]]
                own = [_digits(cell["metrics"][metric][name]) for name in SUMMARY]
                rows.append([*place, metric, *own, *ratios, cell["lost"], cell["episodes"]])
    return jsonable({"columns": list(COLUMNS), "rows": rows})


def _digits(value: float) -> float | None:
    return None if math.isnan(value) else float(f"{value:.6g}")


def cells_of(content: Content) -> list[dict[str, Any]]:
    """The cells, as ``statistics`` had them, from a result."""
    cells: dict[tuple[Any, ...], dict[str, Any]] = {}
    for row in content["figures"]["rows"]:
        found = dict(zip(COLUMNS, [math.inf if entry == "lost" else entry for entry in row], strict=True))
        cell = cells.setdefault(tuple(row[:5]), {name: found[name] for name in (*COLUMNS[:5], "lost", "episodes")})
        cell.setdefault("metrics", {})[found["metric"]] = {name: _number(found[name]) for name in SUMMARY}
        ratio = {name: _number(found[column]) for name, column in zip(SUMMARY, RATIO, strict=False)}
        cell.setdefault("ratios", {}).update({} if math.isnan(ratio["median"]) else {found["metric"]: ratio})
    return list(cells.values())


def _number(value: float | None) -> float:
    return math.nan if value is None else value


def tables(content: Content, name: str) -> dict[str, str]:
    """The overview, the losses where there are several environments, and every metric as CSV."""
    figures, settings = cells_of(content), content["settings"]
    several = len({cell["environment"] for cell in figures}) > 1
    parts = [
        f"{measured_on(settings)} Intervals are bootstrapped; a lost episode counts as infinitely bad. {LEGEND}",
        overview(figures), *([losses(figures)] if several else []),
        "Every metric, with its interval, its worst episode and its ratio to that of the paper's controller: "
        f"[{name}.csv](../data/{name}.csv)",
    ]  # fmt: skip
    return {f"{name}.md": "\n\n".join(parts) + "\n", f"{name}.csv": data(figures)}


def measured_on(settings: dict[str, Any]) -> str:
    """The worlds of a comparison, in a sentence."""
    return f"{worlds(settings['seed'], settings['episodes'])}, the same for every controller."


def _cuts(content: Content) -> dict[str, str]:
    """The master table, and what the page on moving hands takes of it."""
    figures = cells_of(content)
    where = {(CIRCLE, "randomised", sensors) for sensors in COMPARED}
    moving = [cell for cell in figures if (cell["environment"], cell["plant"], cell["sensors"]) in where]
    return tables(content, "comparison") | (
        {"moving.md": f"{measured_on(content['settings'])} {LEGEND}\n\n{overview(moving)}\n"} if moving else {}
    )


def _table_of(text: Callable[[Figures], str], name: str, content: Content) -> dict[str, str]:
    return {f"{name}.md": f"{measured_on(content['settings'])} {LEGEND}\n\n{text(cells_of(content))}\n"}


def _by_sensors(name: str, content: Content) -> dict[str, str]:
    return _table_of(partial(by_sensors, parameters=content["settings"]["parameters"]), name, content)


def _headline(content: Content) -> dict[str, str]:
    said = (
        "Settled error, mm: median [95 % interval]; a column for each kind of sensors. "
        f"{measured_on(content['settings'])} Rigs are randomised, but for the first column. A lost or refused world counts as "
        f"infinitely bad. {LEGEND} Policies: five training seeds, with the sensors of their training."
    )
    return {"circle.md": f"{said}\n\n{headline(cells_of(content))}\n"}


def pictures(content: Content, folder: Path) -> list[Path]:
    """Both pictures of the figures, with the sensors of the tables."""
    # pyplot takes half a second to load.
    from lab.studies.comparison.figure import draw_comparison

    figures = cells_of(content)
    return draw_comparison([cell for cell in figures if cell["sensors"] in COMPARED] or figures, folder)


def comparison(
    name: str,
    show: Callable[[Content], dict[str, str]] | None = None,
    wanted: JointReference = anywhere,
    draw: Callable[[Content, Path], list[Path]] = no_pictures,
    **options: Any,
) -> Study:
    """A study of some controllers under some conditions; ``options`` are defaults that differ from those of the comparison."""
    return Study(
        {
            "env": ENVIRONMENTS,
            "controller": tuple(default_controllers()),
            "sensors": ("ideal", "lab", "honest"),
            "plant": tuple(PLANTS),
            "episodes": COUNT,
            "seed": SEED,
            "parameters": "",
            **options,
        },
        partial(cells, wanted=wanted),
        kept,
        METRICS,
        show or partial(tables, name=name),
        draw,
        partial=True,
        allowed={"env": ENVIRONMENTS, "sensors": tuple(names("sensors")), "plant": tuple(PLANTS)},
        words={
            "controller": "registered names, with options, path/to/file.py:Class, residual:POLICY, told:NAME",
            "plant": "what differs from episode to episode beside the scenario",
            "parameters": "TOML file of the rig",
        },
    )


COMPARISON = comparison("comparison", _cuts, draw=pictures)
CIRCLES = comparison(
    "circle",
    _headline,
    is_shown,
    env=(CIRCLE,),
    controller=CONTROLLERS,
    plant=("nominal", "randomised", "described-sensors"),
)
BOUNDED = comparison(
    "bound",
    wanted=with_own_hand,
    env=(CIRCLE, PROBE),
    controller=("backstepping", "admittance-backstepping", "nonlinear-mpc"),
    sensors=("ideal", "lab"),
    plant=("nominal", "randomised"),
    episodes=8,
)
HONEST = comparison(
    "honest",
    partial(_by_sensors, "honest"),
    env=(CIRCLE, PROBE),
    plant=("randomised", "described-sensors"),
    controller=("admittance-adaptive", "admittance-backstepping", "admittance-sensorless", "backstepping"),
)
LIMITED = comparison(
    "limited",
    partial(_table_of, settled, "limited"),
    with_own_hand,
    env=(CIRCLE, FORCEPS),
    plant=("randomised",),
    sensors=("lab", "honest"),
    controller=("backstepping", "limited:backstepping", "admittance-adaptive", "limited:admittance-adaptive"),
)
ACCELERATION = comparison(
    "acceleration",
    partial(_by_sensors, "acceleration"),
    env=(CIRCLE, PROBE),
    sensors=("lab", "honest"),
    plant=("randomised", "described-sensors"),
    controller=("admittance-adaptive", "admittance-sensorless"),
    parameters="examples/acceleration_sensor_rig.toml",
)
register(study="acceleration", about="what an acceleration sensor adds")(ACCELERATION)
register(study="bound", about="how far controllers are from a planner that looks ahead")(BOUNDED)
register(study="circle", about="controllers and policies on circles that guided no decision")(CIRCLES)
register(study="comparison", about="every controller under all conditions")(COMPARISON)
register(study="honest", about="what honest sensors cost")(HONEST)
register(study="limited", about="what a limiter costs")(LIMITED)
