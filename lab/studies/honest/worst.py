"""The worst of many drawn worlds, the worst that a search finds, and which of its figures makes it so."""

import csv
import io
from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np

from baselines.bench.evaluation import Evaluation, evaluate_worlds
from baselines.bench.metrics import UNITS
from baselines.bench.statistics import jsonable, penalize_lost, quantile
from baselines.named import make_controller
from baselines.work.tasks import Result, Task
from birthsim_env.parts.drawn.randomization import documented_ranges, draw_parameters
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.parts.hands.user_forces import Ramp
from birthsim_env.parts.scenarios import environment_id, find_scenario
from birthsim_env.parts.scenarios.probe import REST
from birthsim_env.parts.sensors.model import drawn_by
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import DECLARED, Parameters, load_parameters, value_of
from birthsim_env.physics.rig.values import checked_number
from birthsim_env.registry import names, register
from lab.engine import information
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import SPREAD_AND_WORST, Cell, Head, digits, markdown
from lab.studies.comparison.grid import as_described
from lab.studies.honest.search import Seeds, drawn_places, hardest, parameters_at, rigs_at

ENVIRONMENT = environment_id("probe")
PUSHED = find_scenario("probe").duration - REST
"""s of ``ENVIRONMENT`` from the beginning of its push to its end."""
LONGEST_REST = 60.0
"""s; assumed: no rig needs longer to come to rest."""
NAMED, CAUSES = 5, 8
"""Worst drawn worlds that a row names; changes of one figure that are shown, of those that help most."""
SHOWN = 2
"""Of these changes those in the table; the data file has all."""
DATA = ("controller", "sensors", "parameter", "over_believed", "left")
"""Columns of the data file: what was changed, by which factor it differed, and the metric that is left."""


def _tasks(options: Options) -> dict[Any, Task]:
    checked_number("--rest", options.rest, "s", least=0.0, most=LONGEST_REST)
    believed = load_parameters(options.parameters or None)
    rig = (believed if options.drawn else as_described(believed)).to_dict()
    own = {name: getattr(options, name) for name in ("metric", "limit", "rest", "episodes", "seed")}
    pairs = [(name, sensors) for name in options.controller for sensors in options.sensors]
    for name in options.controller:
        make_controller(name, believed)
    return {pair: Task("-".join(pair), worst, {"controller": pair[0], "sensors": pair[1], "rig": rig, **own}) for pair in pairs}


def worst(
    controller: str, sensors: str, rig: dict[str, Any], metric: str, limit: float, rest: float, episodes: int, seed: int
) -> Result:
    """Median, 95 % and worst of a metric's sizes and of unrest, the worst worlds, and the worst that a search then finds among
    those that the rig's strength can bear, with its causes."""
    own = Parameters.from_dict(rig)
    seeds = seed + np.arange(episodes, dtype=np.int64)
    ranges = {name: pair for name, pair in documented_ranges(own, sensors).items() if name not in drawn_by(sensors)}

    def run(seeds: Seeds, places: Array) -> Evaluation:
        return _evaluated(controller, rest, own, sensors, seeds, rigs_at(places, ranges, own))

    places = drawn_places(seeds, ranges)
    done = run(seeds, places)
    sizes, signed = sizes_of(done, metric), penalize_lost(done.metrics[metric], done.lost, applies=True)
    order = np.argsort(-sizes, kind="stable")
    begun = seeds, places, _bearable(done, metric)
    found, where = hardest(lambda *world: _bearable(run(*world), metric), *begun, episodes, seed)
    figures = {name: float(value) for name, value in parameters_at(where, ranges).items()}
    return {
        "controller": controller, "sensors": sensors,
        **{name: jsonable([quantile(sizes_of(done, name), part) for part in (0.5, 0.95, 1.0)]) for name in (metric, "unrest")},
        "above": int((sizes > limit).sum()), "lost": int(sum(done.lost)),
        "named": jsonable([[done.seeds[k], float(signed[k])] for k in order[:NAMED]]),
        "found": causes(controller, sensors, own, metric, rest, found, figures),
    }  # fmt: skip


def _bearable(evaluation: Evaluation, metric: str) -> Array:
    """Sizes of a metric, less than nothing in worlds that ask for more than the rig's strength."""
    bearable = np.array(evaluation.required_strength_ratio) <= 1.0
    return np.where(bearable, np.nan_to_num(sizes_of(evaluation, metric), nan=-1.0, posinf=np.inf), -1.0)


def causes(
    controller: str, sensors: str, rig: Parameters, metric: str, rest: float, seed: int, figures: dict[str, float]
) -> dict[str, Any]:
    """The metric in world ``seed`` with a rig of these ``figures``, and where one figure is as the controller believes, or one
    error of the sensors is 0."""
    own = {figure: [low, high] for figure, low, high in rig.ranges}

    def placed(fixed: dict[str, float]) -> Parameters:
        every = {**own, **{name: [value, value] for name, value in {**figures, **fixed}.items()}}
        return Parameters.from_dict({**rig.to_dict(), "randomize": every})

    def size(fixed: dict[str, float], seconds: float = rest) -> float:
        return float(sizes_of(_evaluated(controller, seconds, placed(fixed), sensors, [seed]), metric)[0])

    world, push, way = _world(placed({}), sensors, seed)
    ranges = documented_ranges(rig, sensors)
    drawn = {figure: value_of(rig, figure) for figure, (low, high) in ranges.items() if low < high}
    errors = [figure for figure in ranges if figure in drawn_by(sensors) and DECLARED[figure].least == 0.0]
    put = [*drawn.items(), *((figure, 0.0) for figure in errors)]
    rows = sorted((size({figure: value}), figure, world[figure], value) for figure, value in put)[:CAUSES]
    here = _evaluated(controller, rest, placed({}), sensors, [seed])
    return {
        "seed": seed, "figures": figures, "push_n": push, "way_mm": way, "strength": float(here.required_strength_ratio[0]),
        **jsonable({
            "size": float(sizes_of(here, metric)[0]), "as_believed": size(drawn),
            "changes": [["s of rest", rest, 2 * rest, size({}, 2 * rest)], *([*cells, value] for value, *cells in rows)],
        }),
    }  # fmt: skip


def _shown(content: Content) -> dict[str, str]:
    settings, metric = content["settings"], content["settings"]["metric"]
    named = f"{metric}, {UNITS[metric]}"
    head = ["controller", *information.COLUMNS, "sensors"]
    above = f"above {settings['limit']:g}"
    size, unrest = Head(named, (*SPREAD_AND_WORST, above)), Head("unrest, mm", SPREAD_AND_WORST)
    rows: list[list[Cell | Head]] = [[*head, size, unrest, "lost", Head("worst world", ("drawn", "found"))]]
    worlds = [[*head, "world found", "push, N", "motion asked for, mm", "of the rig's strength, %"]]
    eased = ["as found", "rest twice as long", "all as believed", "helps most", "helps next"]
    changed, data = [[*head, *eased]], [list(DATA)]
    for row in content["figures"]:
        facts = information.informed(row["controller"], row["sensors"], parameters=settings["parameters"])
        own, found = [f"`{row['controller']}`", *facts, row["sensors"]], row["found"]
        largest = [f"{row['named'][0][0]}: {digits(row['named'][0][1])}", f"{found['seed']}: {digits(found['size'])}"]
        rows.append([*own, [*row[metric], str(row["above"])], row["unrest"], str(row["lost"]), largest])
        asked = (found["push_n"], found["way_mm"], 100 * found["strength"])
        worlds.append([*own, str(found["seed"]), *map(digits, asked)])
        (_, _, _, rested), *changes = found["changes"]
        helps = [f"`{parameter}`: {digits(left)}" for parameter, _, _, left in changes[:SHOWN]]
        changed.append([*own, *map(digits, (found["size"], rested, found["as_believed"])), *helps])
        data += [[row["controller"], row["sensors"], *cells] for cells in _rows(found)]
    text = (
        f"{settings['episodes']} worlds of {ENVIRONMENT} from seed {settings['seed']}, rigs and scenarios randomised, "
        f"{settings['rest']:g} s of rest before the push; 95 % is the 95th percentile. A *worst world* is a seed and its "
        f"{named}: the worst that was drawn, and what {settings['episodes']} further episodes found by moving the rigs of the "
        "worst worlds within their ranges."
    )
    alike = [(str(row[4]), str(row[1]), str(row[3])) for row in rows[1:]]
    parts = [text, markdown(rows, (size, unrest), alike=alike), "The worlds that were found:", markdown(worlds)]
    cause = (
        f"The {named} of each worst world: as it was found, with twice the rest before the push, with all randomised "
        "parameters as the controller believes them, and with one of them alone as it is believed."
    )
    every = io.StringIO()
    csv.writer(every, lineterminator="\n").writerows(data)
    texts = {"worst.md": "\n\n".join(parts), "worst-causes.md": f"{cause}\n\n{markdown(changed)}"}
    return {**{name: f"{text}\n" for name, text in texts.items()}, "worst-causes.csv": every.getvalue()}


def _rows(found: dict[str, Any]) -> list[list[str]]:
    """Of a world that was found each change: the parameter, the world's over the believed one, and what is left."""
    changes = [[name, f"{was / put:.3g}" if put else "an error put to 0", left] for name, was, put, left in found["changes"]]
    ends = [["as found", "", found["size"]], ["all that are randomised", "", found["as_believed"]]]
    return [[name, over, left if isinstance(left, str) else f"{left:.3g}"] for name, over, left in [ends[0], *changes, ends[1]]]


def _world(rig: Parameters, sensors: str, seed: int) -> tuple[dict[str, float], float, float]:
    """Figures of the rig and its sensors in world ``seed``; its push, N, and the way that it asks for, mm."""
    env: Any = gymnasium.make_vec(ENVIRONMENT, sensors=sensors, parameters=rig, randomize=True)
    env.reset(seed=[seed])
    shown = {name: float(values[0]) for name, values in getattr(env.simulation.sensors, "parameters", {}).items()}
    simulation = env.simulation
    simulation.run(round((REST + PUSHED / 2) / simulation.period))
    force, target = simulation.force, simulation.reference.position
    way = simulation.reference.compliant_target(force) - target
    env.close()
    ranges = {name: pair for name, pair in documented_ranges(rig, sensors).items() if name not in drawn_by(sensors)}
    drawn = draw_parameters(rig, ranges, stream(seed, 0, "parameters"))
    figures = {name: value_of(drawn, name) for name in ranges}
    figures |= {f"electronics.{name}": value for name, value in shown.items()}
    return figures, float(np.hypot(*force[:, 0])), float(1e3 * np.hypot(*way[:, 0]))


def sizes_of(evaluation: Evaluation, metric: str) -> Array:
    """The sizes of a metric per episode, infinite where the lane was lost."""
    return np.abs(penalize_lost(evaluation.metrics[metric], evaluation.lost, applies=True))


def _evaluated(
    name: str, rest: float, rig: Parameters, sensors: str, seeds: Sequence[int] | Seeds, rigs: Array | None = None
) -> Evaluation:
    """In the worlds of ``seeds``, whose ``rigs`` (PARAMETERS, N) are drawn where none are given."""
    hand = {} if rest == REST else {"user_force": Ramp((5.0, 40.0), "axes", rest)}
    setting: dict[str, Any] = {"sensors": sensors, "parameters": rig, "duration": rest + PUSHED, **hand}
    setting["randomize"] = True if rigs is None else "sensors" if drawn_by(sensors) else "scenario"
    law, own = make_controller(name, rig), [int(seed) for seed in seeds]
    return evaluate_worlds(ENVIRONMENT, law, name, own, rigs, progress=False, **setting)


def _kept(options: Options, found: Found) -> Any:
    return list(found.values())


STUDY = Study(
    {
        "controller": ("admittance-adaptive", "admittance-sensorless", "backstepping"),
        "sensors": tuple(names("sensors")),
        "drawn": False,
        "metric": "stiffness_error",
        "limit": 15.0,
        "rest": REST,
        "episodes": 800,
        "seed": 90000,
        "parameters": "",
    },
    _tasks,
    _kept,
    {**UNITS, "push_n": "N", "way_mm": "mm"},
    _shown,
    allowed={"sensors": tuple(names("sensors")), "metric": tuple(UNITS)},
    words={
        "controller": "registered names",
        "drawn": "randomise the parameters of honest sensors too",
        "limit": "worlds above it are counted",
        "rest": "s before the push",
        "seed": "of the first world",
        "parameters": "TOML file of the rig as the controllers believe it",
    },
)
register(study="worst", about="the worst worlds, and the parameters that cause them")(STUDY)
