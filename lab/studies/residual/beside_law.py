"""Residual policies of several seeds beside the controller that they sit on, in the same worlds."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np

from agents.policy.controller import ResidualController
from agents.policy.files import WEIGHTS, read_policy
from agents.policy.seeds import policy_folders
from agents.residual.privileged import acting
from agents.residual.settings import LAWS, is_one_of
from agents.training.validation import validate
from baselines.bench.evaluation import evaluate
from baselines.bench.pieces import file_hash
from baselines.bench.statistics import LOST_ERROR, crossed_interval, jsonable, quantile
from baselines.named import make_controller
from baselines.work.tasks import Result, Task
from birthsim_env.files import finite
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.registry import names, register
from lab.engine import information
from lab.engine.results import Content
from lab.engine.study import Found, Options, Study
from lab.engine.tables import digits, markdown
from lab.engine.worlds import worlds
from lab.studies.haptics.multisine import words
from lab.studies.haptics.rendering import rendering
from lab.studies.haptics.worlds import Condition

ERRORS = {"error": "settled error, mm", "stiffness": "error along the push, %"}
STATIC = "static stiffness error, %: median", "95 %"
PUSHED = "BirthSIM/Probe-v3"
"""Where the static stiffness is measured."""

FELT = {"bandwidth": "bandwidth, Hz: mean", "jnd": "JND at 1 Hz: median", "error": "own error, mm: median"}
MORE = {"bandwidth": "more bandwidth: mean, Hz", "jnd": "less JND: mean", "error": "less own error: mean, mm"}
"""Figures of what a hand feels, and how much better they are than the controller's."""

SETPOINT, PUSH = 2000.0, 10.0
"""N/m and N, of the multisine hand."""

Key = tuple[str, str, str]
"""What is measured, "errors" or "felt"; the training, or the controller; and its seed, "" for a controller."""


def _tasks(options: Options) -> dict[Any, Task]:
    rig = load_parameters(options.parameters or None).to_dict()
    where = {"sensors": options.sensors, "rig": rig, "seed": options.seed}
    folders = _seeds_of(options.policy)
    own = read_policy(folders[0])
    runs: list[Key] = []
    for name in (own.settings.law, options.policy, *options.beside):
        runs += [("errors", name, seed) for seed in ([""] if is_one_of(name, LAWS) else [one.name for one in _seeds_of(name)])]
    if not _privileged(folders[0]):
        runs += [("felt", name, seed) for what, name, seed in runs if name in (own.settings.law, options.policy)]
    tasks = {}
    for what, name, seed in dict.fromkeys(runs):
        place = next(one for one in _seeds_of(name) if one.name == seed) if seed else folders[0]
        piece = {"policy": str(place), "law": "" if seed else name, "network": file_hash(str(place / WEIGHTS)), **where}
        count = {"episodes": options.episodes} if what == "errors" else {"rigs": options.rigs}
        stem = f"{what}-{Path(name).name}-{seed}"
        tasks[what, name, seed] = Task(stem, errors if what == "errors" else felt, {**piece, **count})
    return tasks


def _seeds_of(name: str) -> list[Path]:
    """Folders of the seeds of one training."""
    folders = policy_folders(name)
    policies = [read_policy(folder) for folder in folders]
    if len({(policy.environment, policy.settings) for policy in policies}) > 1:
        raise ValueError(f"policy = {name!r} holds policies of several settings; allowed: seeds of one training")
    return folders


def _privileged(folder: Path) -> bool:
    return bool(read_policy(folder).training.get("privileged", False))


def errors(policy: str, law: str, network: str, sensors: str, rig: dict[str, Any], seed: int, episodes: int) -> Result:
    """Per world, what ``validate`` finds of a policy, or without it of the ``law`` in its environment."""
    one = read_policy(Path(policy))
    settings = replace(one.settings, law=law) if law else one.settings
    env: Any = gymnasium.make_vec(
        one.environment,
        num_envs=episodes,
        sensors=sensors,
        parameters=Parameters.from_dict(rig),
        randomize=True,
        **settings.to_dict(),
    )
    if law:
        score = validate(env, lambda seen: np.zeros((len(seen), settings.size), np.float32), seed)
    else:
        score = validate(env, acting(one.network.acting(), env, _privileged(Path(policy))), seed)
    env.close()
    static = None if _privileged(Path(policy)) else _static(policy, law, rig, sensors, seed, episodes)
    return {
        "error": score.error.tolist(), "stiffness": score.stiffness.tolist(), "static": static,
        "within": score.feasible.tolist(), "lost": int(score.lost),
    }  # fmt: skip


def _static(policy: str, law: str, rig: dict[str, Any], sensors: str, seed: int, episodes: int) -> Any:
    """Error of the stiffness that a held push finds, per world of ``PUSHED``, %; infinite where the episode is lost."""
    believed = Parameters.from_dict(rig)
    controller = make_controller(law, believed) if law else ResidualController(believed, policy)
    found = evaluate(
        PUSHED, controller, law or policy, episodes, seed, progress=False, sensors=sensors, parameters=believed, randomize=True
    )
    return np.where(found.lost, np.inf, np.abs(found.metrics["stiffness_error"])).tolist()


@dataclass(frozen=True)
class _Learned(Condition):
    """A condition whose ``controller`` is the folder of a policy."""

    def law(self) -> ResidualController:
        return ResidualController(self.rig, self.controller)


def felt(policy: str, law: str, network: str, sensors: str, rig: dict[str, Any], seed: int, rigs: int) -> Result:
    """Means over poses and directions, per rig, under hands of ``PUSH``, and the number of lost lanes.

    A lane that is lost counts with ``LOST_ERROR`` mm, a just noticeable difference of infinity (null) and no bandwidth.
    """
    condition = Condition if law else _Learned
    where = Parameters.from_dict(rig), sensors, seed, rigs, read_policy(Path(policy)).settings.force_sensor
    found = rendering(condition(law or policy, *where), SETPOINT)
    kept, lost = np.array(found["peak"]) == PUSH, np.array(found["lost"])
    line = int(np.argmin(np.abs(np.array(found["frequency"]) - 1.0)))
    values = {
        "bandwidth": np.where(lost, 0.0, found["bandwidth"]), "jnd": np.where(lost, np.inf, found["differences"][line]),
        "error": np.where(lost, LOST_ERROR, found["error_own_mm"]),
    }  # fmt: skip
    means = {name: own[kept].reshape(-1, rigs).mean(axis=0).tolist() for name, own in values.items()}
    return {**means, "lost": int(lost[kept].sum())}


def _kept(options: Options, found: Found) -> Any:
    """Rows of both tables; a difference is "less than the controller", positive where the policies are better."""
    law = next(name for what, name, seed in found if what == "errors" and not seed)
    rows = {"within": int(sum(found["errors", law, ""]["within"])), "errors": [], "felt": []}
    rows["errors"] = list(_error_rows(found, law, options))
    if ("felt", law, "") in found:
        rows["felt"] = list(_felt_rows(found, law, options))
    return finite(jsonable(rows))


def _error_rows(found: Found, law: str, options: Options) -> Iterator[dict[str, Any]]:
    within = np.array(found["errors", law, ""]["within"])

    def of(name: str) -> list[tuple[str, Result]]:
        return [(seed, one) for (what, who, seed), one in found.items() if (what, who) == ("errors", name)]

    def less(errors: list[Result], than: Array) -> dict[str, Any]:
        gained = (than - np.stack([one["error"] for one in errors]))[:, within]
        return {"median": _interval(_median, gained), "mean": _interval(_mean, gained)}

    theirs = np.array(found["errors", law, ""]["error"])
    for name in dict.fromkeys((law, options.policy, *options.beside)):
        for seed, one in of(name):
            error, stiffness = (np.array(one[key], float)[within] for key in ERRORS)
            yield {
                "who": f"{Path(name).name} {seed}".strip(),
                "error": [quantile(error, part) for part in (0.5, 0.95)],
                "less": less([one], theirs) if name == options.policy else None,
                "stiffness": quantile(stiffness, 0.5),
                "static": None if one["static"] is None else [quantile(_array(one, "static"), part) for part in (0.5, 0.95)],
                "lost": one["lost"],
            }
        if name != law:
            mine, others = [one for _, one in of(options.policy)], [one for _, one in of(name)]
            than = theirs if name == options.policy else np.mean([one["error"] for one in others], axis=0)
            label = "all seeds" if name == options.policy else f"all seeds, less than {Path(name).name}"
            yield {"who": label, "error": None, "less": less(mine, than), "stiffness": None, "static": None, "lost": None}


def _felt_rows(found: Found, law: str, options: Options) -> Iterator[dict[str, Any]]:
    def better(ones: list[Result]) -> dict[str, Any]:
        gained = {key: np.stack([_array(one, key) - _array(found["felt", law, ""], key) for one in ones]) for key in FELT}
        return {key: _interval(_mean, own if key == "bandwidth" else -own) for key, own in gained.items()}

    policies = {seed: one for (what, name, seed), one in found.items() if (what, name) == ("felt", options.policy)}
    for seed, one in {"": found["felt", law, ""], **policies}.items():
        middle = {
            key: float(np.mean(_array(one, key))) if key == "bandwidth" else quantile(_array(one, key), 0.5) for key in FELT
        }
        yield {"who": seed or law, **middle, "better": better([one]) if seed else None, "lost": one["lost"]}
    yield {"who": "all seeds", **dict.fromkeys(FELT), "better": better(list(policies.values())), "lost": None}


def _array(one: Result, key: str) -> Array:
    return np.array([np.inf if value is None else value for value in one[key]])


def _interval(statistic: Callable[[Array], float], values: Array) -> list[float]:
    """A statistic of ``values`` (seeds, N) with its interval over seeds and episodes."""
    return [statistic(values), *crossed_interval(statistic, values)]


def _median(values: Array) -> float:
    return float(np.median(values))


def _mean(values: Array) -> float:
    return float(np.mean(values))


def _shown(content: Content) -> dict[str, str]:
    figures, settings = content["figures"], content["settings"]
    head = [f"{ERRORS['error']}: median", "95 %", "less: median of the pairs, mm", "mean, mm"]
    rows = [["controller", *information.COLUMNS, *head, f"{ERRORS['stiffness']}: median", *STATIC, "lost"]]
    for row in figures["errors"]:
        less = [_entry((row["less"] or {}).get(key)) for key in ("median", "mean")]
        error, static = (map(_entry, row[name] or ("", "")) for name in ("error", "static"))
        compared = [*error, *less, _entry(row["stiffness"]), *static, _entry(row["lost"])]
        rows.append([row["who"], *_told(row["who"], settings), *compared])
    parts = [
        f"{worlds(settings['seed'], settings['episodes'])}, `{settings['sensors']}` sensors, randomised rigs; "
        f"{figures['within']} are within the rig's strength. Differences compare the same worlds, with 95 % intervals. "
        f"The static stiffness is that of a held push in as many worlds of `{PUSHED}`.",
        markdown(rows, [*head[:2], rows[0][8], *STATIC]),
    ]
    if figures["felt"]:
        rows = [["controller", *information.COLUMNS, *FELT.values(), *MORE.values(), "lost"]]
        for row in figures["felt"]:
            better = [_entry((row["better"] or {}).get(key)) for key in MORE]
            felt = [*(_entry(row[key]) for key in FELT), *better, _entry(row["lost"])]
            rows.append([row["who"], *_told(row["who"], settings), *felt])
        parts += [
            f"What a hand feels: {words(PUSH, settings['seed'])}, at {SETPOINT:g} N/m on "
            f"{settings['rigs']} randomised rigs, means "
            "over three poses and two directions.",
            markdown(rows),
        ]
    return {"beside-law.md": "\n\n".join(parts) + "\n"}


def _told(who: str, settings: dict[str, Any]) -> list[str]:
    """The information of a row, which a controller, a policy or one of its seeds has; empty for differences."""
    name = who.partition(" ")[0]
    if name.startswith("seed_"):
        name = Path(settings["policy"]).name
    if name == "all":
        return [""] * len(information.COLUMNS)
    policies = [one for one in (settings["policy"], *settings["beside"]) if Path(one).name == name and one not in LAWS]
    return information.informed(f"residual:{policies[0]}" if policies else name, settings["sensors"])


def _entry(value: Any) -> str:
    if isinstance(value, list):
        middle, low, high = map(_entry, value)
        return f"{middle} ({low} to {high})"
    return str(value or "") if value is None or isinstance(value, str) else digits(value)


STUDY = Study(
    {
        "policy": "circle_honest_student",
        "beside": ("admittance-sensorless",),
        "sensors": "honest",
        "parameters": "examples/honest_sensors_rig.toml",
        "episodes": 128,
        "seed": 170000,
        "rigs": 16,
    },
    _tasks,
    _kept,
    {"error": "mm", "stiffness": "%", "bandwidth": "Hz", "jnd": ""},
    _shown,
    allowed={"sensors": tuple(names("sensors"))},
    words={
        "policy": "a folder of birthsim train or distill, or a shipped policy",
        "parameters": "TOML file of the rig",
        "beside": f"what else runs: one or more of {', '.join(LAWS)}, or policies",
        "rigs": "under multisine hands",
        "seed": "of the first episode",
    },
)
register(study="beside-law", about="policies of several seeds beside their controller")(STUDY)
