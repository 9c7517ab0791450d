"""The worst of many drawn worlds, and which of its figures makes it so."""

from typing import Any

import gymnasium
import numpy as np

from baselines.bench.evaluation import Evaluation, evaluate
from baselines.bench.metrics import UNITS
from baselines.bench.statistics import jsonable, number, penalize_lost, quantile
from baselines.identification.quantities import value_of
from baselines.registry import make_controller
from baselines.work.tasks import Result, Task
from birthsim_env.parts.drawn.randomization import documented_ranges, draw_parameters
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.parts.hands.user_forces import Ramp
from birthsim_env.parts.scenarios import PROBE_REST, SCENARIOS, environment_id
from birthsim_env.parts.sensors.sensors import SENSORS, drawn_by
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters, field_of, load_parameters
from birthsim_env.physics.rig.values import checked_number
from studies.comparison.grid import as_described
from studies.comparison.tables import markdown
from studies.results import Content
from studies.study import Options, Study

ENVIRONMENT = environment_id("probe")
PUSHED = SCENARIOS["probe"].duration - PROBE_REST
"""s of ``ENVIRONMENT`` from the beginning of its push to its end."""
LONGEST_REST = 60.0
"""s; assumed: no rig needs longer to come to rest."""
NAMED, CAUSES = 5, 8
"""Worst worlds that a row names; changes of one figure that are shown, of those that help most."""


def _tasks(options: Options) -> dict[Any, Task]:
    checked_number("--rest", options.rest, "s", least=0.0, most=LONGEST_REST)
    believed = load_parameters(options.parameters or None)
    rig = (believed if options.drawn else as_described(believed)).to_dict()
    own = {name: getattr(options, name) for name in ("metric", "limit", "rest", "worlds", "episodes", "seed")}
    pairs = [(name, sensors) for name in options.controller for sensors in options.sensors]
    for name in options.controller:
        make_controller(name, believed)
    return {
        pair: Task("-".join(pair), pair[0], worst, {"controller": pair[0], "sensors": pair[1], "rig": rig, **own})
        for pair in pairs
    }  # fmt: skip


def worst(
    controller: str, sensors: str, rig: dict[str, Any], metric: str, limit: float, rest: float, worlds: int, episodes: int,
    seed: int,
) -> Result:  # fmt: skip
    """Median, 95 % and worst of a metric's sizes and of unrest, the worst worlds, and the causes of the first ``worlds``."""
    own = Parameters.from_dict(rig)
    done = _evaluated(controller, rest, own, sensors, seed, episodes)
    sizes, signed = sizes_of(done, metric), penalize_lost(done.metrics[metric], done.lost, applies=True)
    order = np.argsort(-sizes, kind="stable")
    return {
        "controller": controller, "sensors": sensors,
        **{name: jsonable([quantile(sizes_of(done, name), part) for part in (0.5, 0.95, 1.0)]) for name in (metric, "unrest")},
        "above": int((sizes > limit).sum()), "lost": int(sum(done.lost)),
        "named": jsonable([[done.seeds[k], float(signed[k])] for k in order[:NAMED]]),
        "worlds": [causes(controller, sensors, own, metric, rest, done.seeds[k]) for k in order[:worlds]],
    }  # fmt: skip


def causes(controller: str, sensors: str, rig: Parameters, metric: str, rest: float, seed: int) -> dict[str, Any]:
    """The metric in world ``seed``, and where one figure is as the law believes, or one error of the sensors is 0."""

    def size(fixed: dict[str, float], seconds: float = rest) -> float:
        own = {figure: [low, high] for figure, low, high in rig.ranges}
        changed = Parameters.from_dict({**rig.to_dict(), "randomize": {**own, **{k: [v, v] for k, v in fixed.items()}}})
        return float(sizes_of(_evaluated(controller, seconds, changed, sensors, seed, 1), metric)[0])

    world, push, way = _world(rig, sensors, seed)
    ranges = documented_ranges(rig, sensors)
    drawn = {figure: value_of(rig, figure) for figure, (low, high) in ranges.items() if low < high}
    errors = [figure for figure in ranges if figure in drawn_by(sensors) and field_of(figure).metadata["least"] == 0.0]
    put = [*drawn.items(), *((figure, 0.0) for figure in errors)]
    rows = sorted((size({figure: value}), figure, world[figure], value) for figure, value in put)[:CAUSES]
    here = _evaluated(controller, rest, rig, sensors, seed, 1)
    return {
        "seed": seed, "push_n": push, "way_mm": way, "strength": float(here.required_strength_ratio[0]),
        **jsonable({
            "size": float(sizes_of(here, metric)[0]), "as_believed": size(drawn),
            "changes": [["s of rest", rest, 2 * rest, size({}, 2 * rest)], *([*cells, value] for value, *cells in rows)],
        }),
    }  # fmt: skip


def _shown(content: Content) -> dict[str, str]:
    settings, metric = content["settings"], content["settings"]["metric"]
    named = f"{metric}, {UNITS[metric]}"
    rows = [["controller", "sensors", named, f"above {settings['limit']:g}", "unrest, mm", "lost", "worst worlds"]]
    parts = []
    for found in content["figures"]:
        sizes = [", ".join(map(_number, found[name])) for name in (metric, "unrest")]
        listed = ", ".join(f"{seed} ({_number(size)})" for seed, size in found["named"])
        rows.append([
            found["controller"], found["sensors"], sizes[0], str(found["above"]), sizes[1], str(found["lost"]), listed,
        ])  # fmt: skip
        parts += [_explained(found, world, named) for world in found["worlds"]]
    text = (
        f"{settings['episodes']} worlds of {ENVIRONMENT} from seed {settings['seed']}, rigs and scenarios randomised, "
        f"{settings['rest']:g} s of rest before the push. Cells are median, 95th percentile and worst."
    )
    return {"worst.md": "\n\n".join([text, markdown(rows), *parts]) + "\n"}


def _explained(found: dict[str, Any], world: dict[str, Any], named: str) -> str:
    text = (
        f"{found['controller']}, {found['sensors']} sensors, world {world['seed']}: {named.replace(',', '')} "
        f"{_number(world['size'])}, a push of {world['push_n']:.3g} N over {world['way_mm']:.3g} mm, "
        f"{100 * world['strength']:.0f} % of the rig's strength."
    )
    rows = [["figure", "of this world", "put to", named]]
    rows += [[figure, f"{own:.4g}", f"{put:.4g}", _number(size)] for figure, own, put, size in world["changes"]]
    return f"{text}\n\n{markdown([*rows, ['all that are randomised', '', 'as believed', _number(world['as_believed'])]])}"


def _number(value: float | str) -> str:
    return value if isinstance(value, str) else number(value)


def _world(rig: Parameters, sensors: str, seed: int) -> tuple[dict[str, float], float, float]:
    """Figures of the rig and its sensors in world ``seed``; its push, N, and the way that it asks for, mm."""
    env: Any = gymnasium.make_vec(
        ENVIRONMENT, sensors=sensors, parameters=rig, randomize=True, policy_period=PROBE_REST + PUSHED / 2
    )
    env.reset(seed=[seed])
    # Before the step: a lane whose episode ends in it is drawn anew.
    shown = {name: float(values[0]) for name, values in getattr(env.simulation.sensors, "figures", {}).items()}
    _, _, _, _, info = env.step(np.zeros((1, env.single_action_space.shape[0]), dtype=np.float32))
    env.close()
    info = info.get("final_info", info)
    ranges = {name: pair for name, pair in documented_ranges(rig, sensors).items() if name not in drawn_by(sensors)}
    drawn = draw_parameters(rig, ranges, stream(seed, 0, "parameters"))
    figures = {name: value_of(drawn, name) for name in ranges}
    figures |= {f"electronics.{name}": value for name, value in shown.items()}
    way = info["compliant_target"] - info["target"]
    return figures, float(np.hypot(*info["user_force"][0])), float(1e3 * np.hypot(*way[0]))


def sizes_of(evaluation: Evaluation, metric: str) -> Array:
    """The sizes of a metric per episode, infinite where the lane was lost."""
    return np.abs(penalize_lost(evaluation.metrics[metric], evaluation.lost, applies=True))


def _evaluated(name: str, rest: float, rig: Parameters, sensors: str, seed: int, episodes: int) -> Evaluation:
    hand = {} if rest == PROBE_REST else {"user_force": Ramp((5.0, 40.0), "axes", rest)}
    setting: dict[str, Any] = {"sensors": sensors, "parameters": rig, "duration": rest + PUSHED, **hand}
    return evaluate(ENVIRONMENT, make_controller(name, rig), name, episodes, seed, False, randomize=True, **setting)


STUDY = Study(
    (__name__,),
    {
        "controller": ("admittance-adaptive", "admittance-sensorless", "backstepping"), "sensors": ("honest",), "drawn": False,
        "metric": "stiffness_error", "limit": 15.0, "rest": PROBE_REST, "worlds": 1, "episodes": 800, "seed": 90000,
        "parameters": "",
    },
    _tasks, lambda _, found: list(found.values()), {**UNITS, "push_n": "N", "way_mm": "mm"}, _shown,
    allowed={"sensors": tuple(SENSORS), "metric": tuple(UNITS)},
    words={
        "controller": "registered names", "drawn": "randomise the figures of honest sensors too",
        "limit": "worlds above it are counted", "rest": "s before the push", "worlds": "worst worlds that are explained",
        "seed": "of the first world", "parameters": "TOML file of the rig as the controllers believe it",
    },
)  # fmt: skip
