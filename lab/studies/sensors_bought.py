"""What each set of sensors buys, per euro: a head that rests, a stiffness that is right, a circle that is followed.

A set is a sensor of the position, and with it a force sensor, gauges in the rods, an acceleration sensor, or none of them. Each
is driven by the controller that makes the best of it, on rigs and sensors that are drawn, once believing the default rig and
once told each rig, as after an identification. Prices are ranges that were assumed, not quotations; data sheets name the kind
of part whose errors are simulated (``birthsim_env.physics.electronics``, ``linkage.joint_sensors``).
"""

from pathlib import Path
from textwrap import fill
from typing import Any, NamedTuple

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.lines import Line2D

from baselines.bench.statistics import jsonable, penalize_lost, quantile
from baselines.figures.style import ACCENT, DARK, MIDDLE, PAGE, STYLE, headline, legend_below, log_ticks, save
from baselines.work.tasks import Task
from birthsim_env.physics.compiled.sources import ROOT
from birthsim_env.physics.rig.parameters import load_parameters
from birthsim_env.registry import register
from lab.engine import information
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import SPREAD, Cell, Head, markdown
from lab.engine.worlds import SEED, worlds
from lab.studies.comparison.grid import Conditions, cell_task, gather, settings_of
from lab.studies.comparison.privileged import TOLD

TRACKER, ENCODERS, FORCE, GAUGES, ACCELERATION = "tracker", "encoders", "force sensor", "rod gauges", "acceleration sensor"

PRICES: dict[str, tuple[float, float, str]] = {
    TRACKER: (2000.0, 6000.0, "electromagnetic tracker with one probe, assumed"),
    ENCODERS: (400.0, 1600.0, "two magnetostrictive rod encoders with SSI, assumed"),
    FORCE: (1000.0, 5000.0, "load cell of two or more axes at the head, with amplifier, assumed"),
    GAUGES: (200.0, 1000.0, "two rods with strain gauges and amplifiers, assumed"),
    ACCELERATION: (10.0, 200.0, "micromechanical sensor of two axes on a board, assumed"),
}
"""Euro, from and to, for what a rig needs of a sensor: assumed ranges, and of what part."""

FILE = "examples/acceleration_sensor_rig.toml"


class Bought(NamedTuple):
    """A set of sensors, and the sensor model and the controller that go with it."""

    parts: tuple[str, ...]
    sensors: str
    controller: str

    @property
    def name(self) -> str:
        return ", ".join(self.parts)

    @property
    def file(self) -> str:
        """TOML file of the rig that has them; "" for the default one."""
        return FILE if ACCELERATION in self.parts else ""

    @property
    def price(self) -> tuple[float, float]:
        """Euro, from and to."""
        return sum(PRICES[part][0] for part in self.parts), sum(PRICES[part][1] for part in self.parts)


def _sets() -> tuple[Bought, ...]:
    """Either sensor of the position with no, one, or the other sensor of the force, without and with acceleration."""
    models = {TRACKER: ("honest", "tracker-gauges"), ENCODERS: ("encoders", "encoders-gauges")}
    found = []
    for position, (plain, gauged) in models.items():
        for more in ((), (ACCELERATION,)):
            found.append(Bought((position, *more), plain, "admittance-sensorless"))
            found.append(Bought((position, FORCE, *more), plain, "admittance-adaptive"))
            found.append(Bought((position, GAUGES, *more), gauged, "admittance-adaptive"))
    return tuple(found)


SETS = _sets()

METRICS = {
    "hunting": ("BirthSIM/Probe-v3", "hunting, mm"),
    "stiffness_error": ("BirthSIM/Probe-v3", "stiffness error, %"),
    "settled_rms": ("BirthSIM/Circle-v2", "settled error of circles, mm"),
}
"""What is kept, median and 95th percentile over the worlds: environment, and head of its column."""

ROWS_APART = 0.2
"""How far above and below the middle of its row a mark stands, in rows."""

ENVIRONMENTS = tuple(dict.fromkeys(environment for environment, _ in METRICS.values()))


def _tasks(options: Options) -> dict[Any, Task]:
    found: dict[Any, Task] = {}
    for one in SETS:
        rig = load_parameters(ROOT / one.file if one.file else None)
        for rigs in (information.DEFAULT, information.TOLD):
            (settings,) = settings_of(f"{TOLD * (rigs == information.TOLD)}{one.controller}", rig).values()
            for environment in ENVIRONMENTS:
                task = cell_task(settings, Conditions(environment, one.sensors, "randomised"), options.episodes, options.seed)
                stem = f"{one.name.replace(', ', '-').replace(' ', '-')}/{rigs}-{environment.rpartition('/')[2]}"
                found[one.name, rigs, environment] = Task(stem, task.work, task.settings)
    return found


def _kept(options: Options, found: Found) -> Any:
    rows = []
    for one in SETS:
        for rigs in (information.DEFAULT, information.TOLD):
            row: dict[str, Any] = {"sensors": one.name, "rig": rigs, "price": list(one.price), "lost": 0}
            for metric, (environment, _) in METRICS.items():
                where = Conditions(environment, one.sensors, "randomised")
                cell = gather({(one.controller, where): found[one.name, rigs, environment]})[one.controller, where]
                values = penalize_lost(np.abs(cell.metrics[metric]), cell.lost, applies=True)
                row[metric] = [quantile(values, part) for part in (0.5, 0.95)]
            row["lost"] = sum(sum(found[one.name, rigs, environment]["lost"]) for environment in ENVIRONMENTS)
            rows.append(row)
    return jsonable(rows)


def _shown(content: Content) -> dict[str, str]:
    settings, named = content["settings"], {one.name: one for one in SETS}
    heads = [Head(head, SPREAD) for _, head in METRICS.values()]
    rows: list[list[Cell | Head]] = [["sensors", "euro", "controller", *information.COLUMNS, *heads, "lost"]]
    for row in content["figures"]:
        one = named[row["sensors"]]
        facts = information.informed(one.controller, one.sensors, rig=row["rig"], parameters=one.file)
        price = "{:,.0f} to {:,.0f}".format(*row["price"])
        rows.append([one.name, price, f"`{one.controller}`", *facts, *(row[metric] for metric in METRICS), str(row["lost"])])
    prices = [["sensor", "euro", "what it stands for"]]
    prices += [[part, f"{low:,.0f} to {high:,.0f}", said] for part, (low, high, said) in PRICES.items()]
    said = f"{worlds(settings['seed'], settings['episodes'])}, rigs and sensors drawn."
    table = markdown(rows, heads, alike=[str(row[3]) for row in rows[1:]])
    return {"sensors-bought.md": f"{said} {information.LEGEND}\n\n{table}\n\nPrices are assumed:\n\n{markdown(prices)}\n"}


def frontier(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Of prices and errors those that nothing cheaper beats, by price."""
    found: list[tuple[float, float]] = []
    for price, error in sorted(points):
        if not found or error < found[-1][1]:
            found.append((price, error))
    return found


def _drawn(content: Content, folder: Path) -> list[Path]:
    """A row for each set, by price, and a column for each metric: in a row of its own no mark can meet another's."""
    sets = sorted(SETS, key=_middle)
    beliefs = (
        (information.DEFAULT, "believes the default rig", ACCENT, "s", ROWS_APART),
        (information.TOLD, "is told its rig", DARK, "o", -ROWS_APART),
    )
    size = PAGE, 1.1 + 0.27 * len(sets)
    with plt.rc_context({**STYLE, "axes.grid.axis": "x"}):
        figure, (prices, *panels) = plt.subplots(1, 1 + len(METRICS), figsize=size, sharey=True, layout="constrained")
        for k, one in enumerate(sets):
            prices.hlines(-k, *one.price, color=MIDDLE, lw=2.5)
        prices.set(xscale="log", xlabel="assumed price (euro)")
        prices.set_yticks([-k for k in range(len(sets))], [fill(one.name, 24) for one in sets])
        prices.set_ylim(0.6 - len(sets), 0.6)
        best: list[str] = []
        for panel, (metric, (_, head)) in zip(panels, METRICS.items(), strict=True):
            for rigs, _, colour, marker, above in beliefs:
                rows = {row["sensors"]: row[metric][0] for row in content["figures"] if row["rig"] == rigs}
                errors = {one: float(rows[one.name]) for one in sets if not isinstance(rows[one.name], str)}
                least = frontier([(_middle(one), error) for one, error in errors.items()])
                for k, one in enumerate(sets):
                    if one not in errors:
                        where: Any = panel.get_yaxis_transform()
                        panel.text(1.0, above - k, "lost", transform=where, color=colour, ha="right", va="center", fontsize=6)
                        continue
                    filled = (_middle(one), errors[one]) in least
                    panel.plot(errors[one], above - k, marker, color=colour, mfc=colour if filled else "white", ms=3.5, mew=0.8)
                if rigs == information.TOLD and errors:
                    best.append(min(errors, key=lambda one: errors[one]).name)
            quantity, _, unit = head.rpartition(", ")
            panel.set(xscale="log", xlabel=fill(f"{quantity} ({unit})", 20))
            panel.tick_params(axis="y", length=0)
        for panel in (prices, *panels):
            log_ticks(panel.xaxis, 1.0)
            for k in range(0, len(sets), 2):
                panel.axhspan(-k - 0.5, 0.5 - k, color="0.95", lw=0, zorder=0)
        headline(figure, f"Least error where the controller is told its rig: {'; '.join(dict.fromkeys(best))}")
        looks: list[tuple[str, dict[str, Any]]] = [
            *((said, {"color": colour, "marker": marker}) for _, said, colour, marker, _ in beliefs),
            ("beats every cheaper set", {"color": "0.3", "marker": "D"}),
            ("a cheaper set is as good", {"color": "0.3", "marker": "D", "mfc": "white"}),
        ]
        legend_below(figure, also=[Line2D([], [], ls="", ms=4, label=said, **look) for said, look in looks])
        return save(figure, folder, "sensors_bought")


def _middle(one: Bought) -> float:
    """Euro, the geometric mean of its range."""
    return float(np.sqrt(np.prod(one.price)))


STUDY = Study(
    {"episodes": 48, "seed": SEED},
    _tasks,
    _kept,
    {"price": "euro", "hunting": "mm", "stiffness_error": "%", "settled_rms": "mm"},
    _shown,
    _drawn,
)
register(study="sensors-bought", about="what each set of sensors buys, per euro")(STUDY)
