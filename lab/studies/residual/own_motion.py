"""How far policies and their controller are from the motion that the controller's own impedance asks for, as hands move.

Beside them stand the controller without the errors of its sensors that change in an episode, and what the others leave to any.
"""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from agents.policy.files import WEIGHTS, read_policy
from agents.policy.pieces import evaluate_learned
from agents.policy.seeds import policy_folders
from agents.training.configuration import TARGETS
from agents.training.validation import validate
from baselines.bench.pieces import controller_settings, evaluation_tasks, file_hash, file_stem, gathered
from baselines.bench.statistics import crossed_interval, quantile
from baselines.work.tasks import Result, Task
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.registry import register
from lab.engine import information
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import SPREAD_AND_WORST, Cell, Head, digits, markdown
from lab.engine.worlds import worlds
from lab.studies.honest.sensor_floor import motion_floor, static_only

HANDS = ("steps", "sine", "noise", "guided")
PARTS = (0.5, 0.95, 1.0)
"""Median, 95th percentile and worst."""

STATIC = "BirthSIM/Probe-v3"

STEADY, FLOOR = BOUNDS = ("its sensors without noise, delays and bias", "no controller has less")
"""The controller where sensors err by scale, distortion, gain and crosstalk alone; and what those leave to any controller."""


def own_motion(
    policy: str, who: str, network: str, hand: str, sensors: str, rig: dict[str, Any], seed: int, episodes: int
) -> Result:
    """Per world, the distance from the declared motion, mm, of a policy, of its controller or of one of ``BOUNDS``."""
    one, believed = read_policy(Path(policy)), Parameters.from_dict(rig)
    env: Any = gymnasium.make_vec(
        one.environment,
        num_envs=episodes,
        sensors=sensors,
        randomize=True,
        user_force=hand,
        parameters=static_only(believed) if who == STEADY else believed,
        **one.settings.to_dict(),
    )
    if who == FLOOR:
        found = {"error": motion_floor(env, believed, seed).tolist(), "lost": 0}
    else:
        zero = np.zeros((episodes, one.settings.size), np.float32)
        score = validate(env, (lambda seen: zero) if who in ("", STEADY) else one.network.acting(), seed, TARGETS[1])
        found = {"error": score.error.tolist(), "within": score.feasible.tolist(), "lost": score.lost}
    env.close()
    return found


def _tasks(options: Options) -> dict[Any, Task]:
    rig, tasks = load_parameters(options.parameters or None), dict[Any, Task]()
    world = {"sensors": options.sensors, "randomize": True}
    folders = policy_folders(options.policy)
    law = read_policy(folders[0]).settings.law
    bounds = BOUNDS if options.sensors == "honest" else ()
    for name, place in (*((name, folders[0]) for name in ("", *bounds)), *((one.name, one) for one in folders)):
        network = file_hash(str(place / WEIGHTS))
        for hand in HANDS:
            settings = {
                "policy": str(place), "who": name, "network": network, "hand": hand, "sensors": options.sensors,
                "rig": rig.to_dict(), "seed": options.seed, "episodes": options.episodes,
            }  # fmt: skip
            tasks[hand, name] = Task(f"{hand}-{file_stem(name)}", own_motion, settings)
        if name in bounds:
            continue
        own = {"controller": "residual", "source": network, "rig": rig.to_dict(), "policy": str(place)}
        pushed, work = (own, evaluate_learned) if name else (controller_settings(law, rig), None)
        pieces = evaluation_tasks(f"pushed-{name}", pushed, STATIC, world, options.episodes, options.seed, work)
        tasks |= {(STATIC, name, k): piece for k, piece in enumerate(pieces)}
    return tasks


def _kept(options: Options, found: Found) -> Any:
    law = read_policy(policy_folders(options.policy)[0]).settings.law
    names = list(dict.fromkeys(name for hand, name, *_ in found if hand == HANDS[0]))
    bounds, seeds = [name for name in names if name in BOUNDS], [name for name in names if name not in ("", *BOUNDS)]
    groups = {law: [""], f"{options.policy}, {len(seeds)} seeds": seeds, **{name: [name] for name in bounds}}
    rows = []
    for hand in HANDS:
        within = np.array(found[hand, ""]["within"])
        errors = {name: np.array(found[hand, name]["error"])[within] for name in names}
        for who, own in groups.items():
            less = errors[""] - np.stack([errors[name] for name in own])
            rows.append(
                {
                    "hand": hand,
                    "who": who,
                    "error": [quantile(errors[""] - less, part) for part in PARTS],
                    "within": int(within.sum()),
                    "less": None if who == law else [_mean(less), *crossed_interval(_mean, less)],
                    "lost": sum(found[hand, name]["lost"] for name in own),
                }
            )
    static = {}
    for name in ("", *seeds):
        pieces = [result for (what, who, *_), result in found.items() if (what, who) == (STATIC, name)]
        sizes = np.abs(gathered(name, pieces).metrics["stiffness_error"])
        static[name or law] = [quantile(sizes, part) for part in PARTS]
    return {"moving": rows, "static": static}


def _mean(values: Array) -> float:
    return float(np.mean(values))


def _shown(content: Content) -> dict[str, str]:
    settings, figures = content["settings"], content["figures"]
    error, less = (
        Head("from its declared motion, mm", SPREAD_AND_WORST),
        Head("less than the controller, mm", ("mean", "95 % interval")),
    )
    rows: list[list[Cell | Head]] = [["hand", "controller", *information.COLUMNS, error, less, "lost"]]
    for row in figures["moving"]:
        mean, *ends = row["less"] or ("",)
        saved = [mean, " to ".join(map(digits, ends))]
        rows.append([row["hand"], row["who"], *_told(row["who"], settings), row["error"], saved, str(row["lost"])])
    stiffness = Head("static stiffness error, %", SPREAD_AND_WORST)
    static: list[list[Cell | Head]] = [["controller", *information.COLUMNS, stiffness]]
    static += [[name, *_told(name, settings), sizes] for name, sizes in figures["static"].items()]
    said = (
        f"{worlds(settings['seed'], settings['episodes'])}, `{settings['sensors']}` sensors, randomised rigs, those "
        f"within the rig's strength. Differences compare the same worlds, with 95 % intervals. Below: `{STATIC}`."
    )
    moving = markdown(rows, (error,), alike=[(str(hand), who in BOUNDS) for hand, who, *_ in rows[1:]])
    return {"own-motion.md": "\n\n".join([said, moving, markdown(static, (stiffness,))]) + "\n"}


def _told(who: str, settings: dict[str, Any]) -> list[str]:
    """The information of a controller, of a policy or one of its seeds; that of a bound is no controller's."""
    if who in BOUNDS:
        return ["-"] * len(information.COLUMNS)
    policy = settings["policy"]
    learned = who.startswith("seed_") or who.partition(",")[0] == policy
    return information.informed(f"residual:{policy}" if learned else who, settings["sensors"])


STUDY = Study(
    {
        "policy": "circle_honest_apg",
        "sensors": "honest",
        "parameters": "examples/honest_sensors_rig.toml",
        "episodes": 128,
        "seed": 74_000_000,
    },
    _tasks,
    _kept,
    {"error": "mm", "less": "mm", "static": "%"},
    _shown,
    words={
        "policy": "a folder of birthsim train, or a shipped policy",
        "parameters": "TOML file of the rig",
        "seed": "of the first episode",
    },
)
register(study="own-motion", about="policies beside the impedance they are to render")(STUDY)
