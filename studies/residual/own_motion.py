"""How far policies and their controller are from the motion that the controller's own impedance asks for, as hands move."""

from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from agents.commands.evaluate import evaluate_learned
from agents.policy.files import WEIGHTS, load_policy
from agents.policy.seeds import policy_folders
from agents.training.configuration import TARGETS
from agents.training.validation import validate
from baselines.bench.pieces import controller_settings, evaluation_tasks, file_hash, gathered
from baselines.bench.statistics import crossed_interval, number, quantile
from baselines.work.tasks import Result, Task
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from studies.results import Content
from studies.study import Found, Options, Study
from studies.tables import markdown

HANDS = ("steps", "sine", "noise", "guided")
PARTS = (0.5, 0.95, 1.0)
"""Median, 95th percentile and worst."""

STATIC = "BirthSIM/Probe-v2"


def own_motion(
    policy: str, seed_name: str, network: str, hand: str, sensors: str, rig: dict[str, Any], seed: int, episodes: int
) -> Result:
    """Per world, the distance from the declared motion, mm, of a policy, or without a ``seed_name`` of its controller."""
    one = load_policy(Path(policy))
    env: Any = gymnasium.make_vec(
        one.environment, num_envs=episodes, sensors=sensors, parameters=Parameters.from_dict(rig), randomize=True,
        user_force=hand, **one.settings.to_dict(),
    )  # fmt: skip
    zero = np.zeros((episodes, one.settings.size), np.float32)
    score = validate(env, one.network.acting() if seed_name else lambda seen: zero, seed, TARGETS[1])
    env.close()
    return {"error": score.error.tolist(), "within": score.feasible.tolist(), "lost": score.lost}


def _tasks(options: Options) -> dict[Any, Task]:
    rig, tasks = load_parameters(options.parameters or None), dict[Any, Task]()
    world = {"sensors": options.sensors, "randomize": True}
    folders = policy_folders(options.policy)
    law = load_policy(folders[0]).settings.law
    for name, place in (("", folders[0]), *((one.name, one) for one in folders)):
        network = file_hash(str(place / WEIGHTS))
        for hand in HANDS:
            settings = {
                "policy": str(place), "seed_name": name, "network": network, "hand": hand, "sensors": options.sensors,
                "rig": rig.to_dict(), "seed": options.seed, "episodes": options.episodes,
            }  # fmt: skip
            tasks[hand, name] = Task(f"{hand}-{name}", own_motion, settings)
        own = {"controller": "residual", "source": network, "rig": rig.to_dict(), "policy": str(place)}
        pushed, work = (own, evaluate_learned) if name else (controller_settings(law, rig), None)
        pieces = evaluation_tasks(f"pushed-{name}", pushed, STATIC, world, options.episodes, options.seed, work)
        tasks |= {(STATIC, name, k): piece for k, piece in enumerate(pieces)}
    return tasks


def _kept(options: Options, found: Found) -> Any:
    law = load_policy(policy_folders(options.policy)[0]).settings.law
    names = list(dict.fromkeys(name for hand, name, *_ in found if hand == HANDS[0]))
    rows = []
    for hand in HANDS:
        within = np.array(found[hand, ""]["within"])
        errors = {name: np.array(found[hand, name]["error"])[within] for name in names}
        less = np.stack([errors[""] - errors[name] for name in names if name])
        for who, own in ((law, errors[""][None]), (f"{options.policy}, {len(less)} seeds", errors[""] - less)):
            rows.append({
                "hand": hand, "who": who, "error": [quantile(own, part) for part in PARTS], "within": int(within.sum()),
                "less": None if who == law else [_mean(less), *crossed_interval(_mean, less)],
                "lost": sum(found[hand, name]["lost"] for name in names if bool(name) == (who != law)),
            })  # fmt: skip
    static = {}
    for name in names:
        pieces = [result for (what, who, *_), result in found.items() if (what, who) == (STATIC, name)]
        sizes = np.abs(gathered(name, pieces).metrics["stiffness_error"])
        static[name or law] = [quantile(sizes, part) for part in PARTS]
    return {"moving": rows, "static": static}


def _mean(values: Array) -> float:
    return float(np.mean(values))


def _shown(content: Content) -> dict[str, str]:
    settings, figures = content["settings"], content["figures"]
    rows = [["hand", "controller", "from its declared motion, mm", "less than the controller: mean, mm", "lost"]]
    for row in figures["moving"]:
        less = "" if row["less"] is None else "{} ({} to {})".format(*map(number, row["less"]))
        rows.append([row["hand"], row["who"], " / ".join(map(number, row["error"])), less, str(row["lost"])])
    static = [["controller", "static stiffness error, %"]]
    static += [[name, " / ".join(map(number, sizes))] for name, sizes in figures["static"].items()]
    head = (
        f"{settings['episodes']} circles from seed {settings['seed']}, `{settings['sensors']}` sensors, randomised rigs, those "
        f"within the rig's strength. Differences compare the same worlds, with 95 % intervals. Below: `{STATIC}`."
    )
    return {
        "own-motion.md": "\n\n".join(
            [head, markdown(rows, rows[0][2:3], alike=[row[0] for row in rows[1:]]), markdown(static, static[0])]
        )
        + "\n"
    }


STUDY = Study(
    (__name__, "agents.commands.evaluate"),
    {
        "policy": "circle_honest_apg", "sensors": "honest", "parameters": "examples/honest_sensors_rig.toml",
        "episodes": 128, "seed": 74_000_000,
    },
    _tasks, _kept, {"error": "mm", "less": "mm", "static": "%"}, _shown,
    words={
        "policy": "a folder of birthsim train, or a shipped policy", "parameters": "TOML file of the rig",
        "seed": "of the first episode",
    },
)  # fmt: skip
