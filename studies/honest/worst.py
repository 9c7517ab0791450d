"""The worst of many drawn worlds, and which of its figures makes it so.

birthsim study worst --controller admittance-adaptive --sensors honest --episodes 800 --seed 90000
"""

from __future__ import annotations

import argparse
from typing import Any

import gymnasium
import numpy as np

from baselines.bench.evaluation import Evaluation, evaluate
from baselines.bench.metrics import UNITS
from baselines.bench.statistics import number, penalize_lost, quantile
from baselines.commands.shared import EPISODES, finite_number, run, seed_number, whole_up_to
from baselines.identification.quantities import value_of
from baselines.registry import make_controller
from birthsim_env.parts.drawn.randomization import documented_ranges, draw_parameters
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.parts.hands.user_forces import Ramp
from birthsim_env.parts.scenarios import PROBE_REST, SCENARIOS, environment_id
from birthsim_env.parts.sensors.sensors import SENSORS, drawn_by
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters, field_of, load_parameters
from birthsim_env.physics.rig.values import checked_number
from studies.comparison.grid import as_described

ENVIRONMENT = environment_id("probe")
PUSHED = SCENARIOS["probe"].duration - PROBE_REST
"""s of ``ENVIRONMENT`` from the beginning of its push to its end."""
LONGEST_REST = 60.0
"""s; assumed: no rig needs longer to come to rest."""
NAMED, CAUSES = 5, 8
"""Worst worlds that a row names; changes of one figure that are shown, of those that help most."""


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="birthsim study worst", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--controller", nargs="+", required=True, metavar="NAME", help="laws of the registry")
    parser.add_argument("--sensors", action="append", choices=tuple(SENSORS), help="may be repeated (default: honest)")
    parser.add_argument("--drawn", action="store_true", help="draw the figures of honest sensors too")
    parser.add_argument(
        "--metric", choices=tuple(UNITS), default="stiffness_error", metavar="NAME", help="default: %(default)s"
    )
    parser.add_argument("--limit", type=finite_number, default=15.0, help="worlds above it are counted (default: %(default)s)")
    parser.add_argument("--rest", type=finite_number, default=PROBE_REST, help="s before the push (default: %(default)s)")
    parser.add_argument(
        "--worlds", type=whole_up_to(EPISODES), default=1, help="worst worlds that are explained (default: %(default)s)"
    )
    parser.add_argument("--episodes", type=whole_up_to(EPISODES), default=800, help="default: %(default)s")
    parser.add_argument("--seed", type=seed_number, default=90000, help="of the first world (default: %(default)s)")
    parser.add_argument("--parameters", help="TOML file of the rig as the laws believe it (default: the paper's)")
    run(parser, _worst)


def _worst(arguments: argparse.Namespace) -> None:
    checked_number("--rest", arguments.rest, "s", least=0.0, most=LONGEST_REST)
    believed = load_parameters(arguments.parameters)
    rest = f"{arguments.rest:g} s of rest before the push"
    print(f"{arguments.episodes} worlds of {ENVIRONMENT} from seed {arguments.seed}, rigs and scenarios drawn, {rest}.")
    print("Median, 95 % and worst.\n")
    above = f"{arguments.metric}, {UNITS[arguments.metric]} | above {arguments.limit:g}"
    print(f"| law | sensors | {above} | unrest, mm | lost | worst worlds |")
    print("|---|---|---|---|---|---|---|")
    found = []
    for name in arguments.controller:
        for sensors in arguments.sensors or ["honest"]:
            rig = believed if arguments.drawn else as_described(believed)
            done = _evaluated(name, arguments.rest, rig, sensors, arguments.seed, arguments.episodes)
            sizes = sizes_of(done, arguments.metric)
            order = np.argsort(-sizes, kind="stable")
            signed = penalize_lost(done.metrics[arguments.metric], done.lost, applies=True)
            listed = ", ".join(f"{done.seeds[k]} ({number(signed[k])})" for k in order[:NAMED])
            cells = (
                three(sizes),
                str((sizes > arguments.limit).sum()),
                three(sizes_of(done, "unrest")),
                str(sum(done.lost)),
                listed,
            )
            print(f"| {name} | {sensors} | {' | '.join(cells)} |", flush=True)
            found += [(name, sensors, rig, done.seeds[k]) for k in order[: arguments.worlds]]
    for name, sensors, rig, seed in found:
        _explain(name, arguments, rig, sensors, seed)


def _explain(name: str, arguments: argparse.Namespace, rig: Parameters, sensors: str, seed: int) -> None:
    """Print the metric in world ``seed`` where one figure is as the law believes, and where one error of the sensors is 0."""

    def size(fixed: dict[str, float], rest: float = arguments.rest) -> float:
        own = {figure: [low, high] for figure, low, high in rig.ranges}
        changed = Parameters.from_dict({**rig.to_dict(), "randomize": {**own, **{k: [v, v] for k, v in fixed.items()}}})
        return float(sizes_of(_evaluated(name, rest, changed, sensors, seed, 1), arguments.metric)[0])

    world, push, way = _world(rig, sensors, seed)
    ranges = documented_ranges(rig, sensors)
    drawn = {figure: value_of(rig, figure) for figure, (low, high) in ranges.items() if low < high}
    rows = [(size({figure: value}), figure, f"{world[figure]:.4g}", f"{value:.4g}") for figure, value in drawn.items()]
    errors = [figure for figure in ranges if figure in drawn_by(sensors) and field_of(figure).metadata["least"] == 0.0]
    rows += [(size({figure: 0.0}), figure, f"{world[figure]:.4g}", "0") for figure in errors]
    here = _evaluated(name, arguments.rest, rig, sensors, seed, 1)
    told = f"{arguments.metric} {number(sizes_of(here, arguments.metric)[0])} {UNITS[arguments.metric]}, a push of {push:.3g} N"
    told += f" over {way:.3g} mm, {100 * here.required_strength_ratio[0]:.0f} % of the rig's strength"
    print(f"\n{name}, {sensors} sensors, world {seed}: {told}\n")
    print(f"| figure | of this world | put to | {arguments.metric}, {UNITS[arguments.metric]} |\n|---|---|---|---|")
    print(f"| s of rest | {arguments.rest:g} | {2 * arguments.rest:g} | {number(size({}, 2 * arguments.rest))} |")
    for value, *cells in sorted(rows)[:CAUSES]:
        print(f"| {' | '.join(cells)} | {number(value)} |")
    print(f"| all that are drawn | | as believed | {number(size(drawn))} |", flush=True)


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


def three(values: Array) -> str:
    """Median, 95 % and worst."""
    return ", ".join(number(quantile(values, fraction)) for fraction in (0.5, 0.95, 1.0))


def _evaluated(name: str, rest: float, rig: Parameters, sensors: str, seed: int, episodes: int) -> Evaluation:
    hand = {} if rest == PROBE_REST else {"user_force": Ramp((5.0, 40.0), "axes", rest)}
    setting: dict[str, Any] = {"sensors": sensors, "parameters": rig, "duration": rest + PUSHED, **hand}
    return evaluate(ENVIRONMENT, make_controller(name, rig), name, episodes, seed, False, randomize=True, **setting)
