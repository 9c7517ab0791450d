"""Over what part of full flow controllers cross the overlap of their valves: wear against error, ``valves.crossing``.

All valves have the catalogue's curve, which the controller knows. A narrow crossing follows every wish of the controller and
throws spools from side to side about zero flow; a wide one leaves small wishes to the overlap. Wear is how often the command of
a valve turns while a head is held and pushed (Probe), the error that of circles. The crossing was chosen on the worlds from
``CHOSEN`` on; those of the option ``seed`` judge it.
"""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import pyplot as plt

from baselines.bench.evaluation import evaluate
from baselines.bench.statistics import jsonable, penalize_lost, quantile
from baselines.figures.style import ACCENT, DARK, LINES, PAGE, STYLE, headline, legend_below, save
from baselines.named import make_controller
from baselines.work.tasks import Result, Task
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.servovalves import LINEAR, MPYE_5_M5, Curve
from birthsim_env.registry import register
from lab.engine import information
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import SPREAD, Cell, Head, markdown
from lab.engine.worlds import SEED, worlds

CHOSEN = 920_000
"""First seed of the worlds on which the crossing was chosen."""

HELD, MOVED = "BirthSIM/Probe-v3", "BirthSIM/Circle-v2"
COLUMNS = {
    "held_turns": (HELD, "valve_turns", "turns of a valve, 1/s, held"),
    "moved_turns": (MOVED, "valve_turns", "moved"),
    "settled": (MOVED, "settled_rms", "settled error of circles, mm"),
    "stiffness": (HELD, "stiffness_error", "error of stiffness, %"),
}
"""What is kept, median and 95th percentile over the worlds: environment, metric, and the head of its column."""


def measure(controller: str, sensors: str, curve: list[float], crossing: float, episodes: int, seed: int) -> Result:
    """``COLUMNS`` of a controller whose rig has a valve ``curve``, which it knows; a lost head is infinitely bad."""
    rig = Parameters().replace({**Curve(*curve).changes(), "valves.crossing": crossing})
    found: dict[str, Any] = {}
    for environment in dict.fromkeys(one for one, _, _ in COLUMNS.values()):
        law = make_controller(controller, rig)
        setting: Any = {"parameters": rig, "sensors": sensors, "randomize": True}
        result = evaluate(environment, law, controller, episodes, seed, progress=False, **setting)
        for name, (own, metric, _) in COLUMNS.items():
            if own == environment:
                values = penalize_lost(np.abs(result.metrics[metric]), result.lost)
                found[name] = [quantile(values, 0.5), quantile(values, 0.95)]
    return {name: jsonable(row) for name, row in found.items()}


def _tasks(options: Options) -> dict[Any, Task]:
    tasks: dict[Any, Task] = {}
    for controller in options.controller:
        for sensors in options.sensors:
            for kind, seed in (("chosen", CHOSEN), ("judged", options.seed)):
                shared = {"controller": controller, "sensors": sensors, "episodes": options.episodes, "seed": seed}
                for crossing in (None, *options.crossing):
                    curve = list(LINEAR if crossing is None else MPYE_5_M5)
                    own = {"curve": curve, "crossing": Parameters().valves.crossing if crossing is None else crossing}
                    name = f"{controller}-{sensors}-{kind}-{crossing or 'linear'}"
                    tasks[controller, sensors, kind, crossing] = Task(name, measure, {**shared, **own})
    return tasks


def _kept(_: Options, found: Found) -> Any:
    return [
        {"controller": controller, "sensors": sensors, "worlds": kind, "crossing": crossing, **result}
        for (controller, sensors, kind, crossing), result in found.items()
    ]


def _crossing(value: float | None) -> str:
    return "valves without overlap" if value is None else f"{100 * value:g} %"


def _shown(content: Content) -> dict[str, str]:
    heads = [Head(head, SPREAD) for _, _, head in COLUMNS.values()]
    rows: list[list[Cell | Head]] = [["controller", *information.COLUMNS, "sensors", "crossing", *heads]]
    for row in content["figures"]:
        if row["worlds"] == "judged":
            facts = information.informed(row["controller"], row["sensors"])
            rows.append(
                [f"`{row['controller']}`", *facts, row["sensors"], _crossing(row["crossing"]), *(row[name] for name in COLUMNS)]
            )
    count = content["settings"]["episodes"]
    chosen = f"The crossing was chosen on {worlds(CHOSEN, count)}, which the picture has too."
    said = f"{worlds(content['settings']['seed'], count)}. {chosen}"
    return {"valve-crossing.md": f"{said}\n\n{markdown(rows)}\n"}


def _cost(rows: list[dict[str, Any]], sensors: str, crossing: float) -> float:
    """By which part a ``crossing`` has a larger settled error than valves without overlap, on the worlds that judge."""
    settled = {row["crossing"]: row["settled"][0] for row in rows if (row["sensors"], row["worlds"]) == (sensors, "judged")}
    return float(settled[crossing] / settled[None] - 1.0)


def _drawn(content: Content, folder: Path) -> list[Path]:
    rows = [row for row in content["figures"] if row["controller"] == content["settings"]["controller"][0]]
    own = Parameters().valves.crossing
    with plt.rc_context(STYLE):
        kinds = list(dict.fromkeys(row["sensors"] for row in rows))
        figure, axes = plt.subplots(1, len(kinds), figsize=(PAGE, 2.6), layout="constrained", squeeze=False)
        for panel, sensors in zip(axes[0], kinds, strict=True):
            for worlds, colour, line in (("chosen", DARK, LINES[1]), ("judged", ACCENT, LINES[0])):
                mine = [row for row in rows if row["sensors"] == sensors and row["worlds"] == worlds]
                curve = np.array([(row["settled"][0], row["held_turns"][0]) for row in mine if row["crossing"] is not None])
                panel.plot(*curve.T, color=colour, ls=line, marker=".", label=f"worlds on which it was {worlds}")
                for row in mine:
                    if row["crossing"] in (None, own):
                        mark = "x" if row["crossing"] is None else "o"
                        panel.plot(row["settled"][0], row["held_turns"][0], mark, color=colour, fillstyle="none")
            panel.set(title=f"{sensors} sensors", xlabel="settled error of circles (mm)")
            low, high = panel.get_ylim()
            panel.set_ylim(bottom=0.0 if low < high / 2.0 else low)
        axes[0, 0].set_ylabel("turns of a valve (1/s)")
        cost = 100 * _cost(rows, kinds[0], own)
        words = f"With {kinds[0]} sensors a crossing of {100 * own:g} % of full flow (o) errs by {cost:.2g} % more"
        headline(figure, f"{words} than without overlap (x)")
        legend_below(figure)
        return save(figure, folder, "valve_crossing")


STUDY = Study(
    options={
        "crossing": (0.003, 0.01, 0.02, 0.03, 0.05, 0.1),
        "controller": ("admittance-adaptive",),
        "sensors": ("ideal", "lab", "honest"),
        "episodes": 32,
        "seed": SEED,
    },
    tasks=_tasks,
    keep=_kept,
    units={"crossing": "1", "held_turns": "1/s", "moved_turns": "1/s", "settled": "mm", "stiffness": "%"},
    show=_shown,
    draw=_drawn,
    words={"seed": "first seed of the worlds that judge it"},
)
register(study="valve-crossing", about="how controllers cross the overlap of valves")(STUDY)
