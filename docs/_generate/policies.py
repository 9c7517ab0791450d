"""Cards of the policies that come with the package: how each was trained, how good it is in its own task, where it is weak."""

import csv
import json
from pathlib import Path
from statistics import mean
from typing import Any

from _generate.environments.scores import FILE, page_of
from _generate.tables import table
from baselines.bench.statistics import number
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.rig.parameters import load_parameters
from birthsim_env.registry import entries, names

ROOT = Path(__file__).resolve().parents[2]
MEASURED = ("learned", "by-gradients")
"""Results of ``birthsim study`` that have rows of policies."""

USELESS = 50
"""A return below which a policy is of no use."""
FAR, LOOSE = 10.0, 10.0
"""mm in the worst world, and % of a stiffness, from which on an error counts as a weakness."""

EQUAL = "../laboratory/equal_information.md"
NOTES = {
    "circle_honest_apg": f"gains [hundredths of a millimetre]({EQUAL}) over the controller that it corrects",
    "circle_honest_student": f"renders stiffness at rest worse than [the controller that it corrects]({EQUAL})",
    "circle_lab": "hardly better than the controller that it corrects",
}
"""Policy -> what no rule finds."""

ALGORITHMS = {"ppo": "PPO", "apg": "[gradients](../gradients.md)"}


def policies() -> str:
    """A table of trainings, and one of what they reached."""
    results = _results()
    trained, reached = [], []
    for one in entries("policy"):
        seeds = sorted(one.made.glob("seed_*/training.json"))
        settings = json.loads(seeds[0].read_text(encoding="utf-8"))["settings"]
        trained.append(_trained(one.name, settings, len(seeds)))
        reached.append(_reached(one.name, settings, results.get(one.name)))
    how = ["policy", "environment, sensors", "corrects", "algorithm", "million steps", "seeds", "rig"]
    what = ["policy", "return, `ideal`", "return, `lab`", "settled error, mm", "95 %", "stiffness error at rest, %", "95 %"]
    tables = table([*how, "sees"], trained), table([*what, "known weaknesses"], reached)
    return f"## How they were trained\n\n{tables[0]}\n\n## What they reach\n\n{ABOUT}\n\n{tables[1]}"


ABOUT = (
    "In the task of their training, on randomised rigs. Returns are means over the training seeds, with the worst and best "
    "seed in brackets ([scale](../scores.md)). Errors are medians and 95th percentiles over worlds and seeds, with the sensors "
    "of the training ([learned](../laboratory/learned.md), [by gradients](../gradients.md#a-policy-by-gradients)). A dash was "
    f"not measured. Weaknesses are a return below {USELESS}, an error of more than {FAR:g} mm in the worst world, and a "
    f"stiffness that is off by more than {LOOSE:g} %: that of the air in the median, that at rest in one world of twenty."
)


def _trained(name: str, settings: dict[str, Any], seeds: int) -> list[str]:
    teacher = settings.get("teacher")
    algorithm = f"DAgger from teachers by {ALGORITHMS[teacher['algorithm']]}" if teacher else ALGORITHMS[settings["algorithm"]]
    steps = (teacher or settings)["steps"]
    law = "valves alone" if settings["law"] == "none" else f"`{settings['law']}`"
    seen = ["force"] * settings["force_sensor"] + ["estimates"] * settings["informed"] + ["memory"] * bool(teacher)
    scenario = _scenario(settings["environment"])
    called = environment_id(scenario).removeprefix("BirthSIM/")
    return [
        f"`{name}`",
        f"[{called}](../environments/{page_of(scenario)}.md), `{settings['sensors']}`",
        law,
        algorithm,
        f"{steps / 1e6:g}",
        str(seeds),
        _rig(settings["rig"]),
        ", ".join(seen),
    ]


def _scenario(environment: str) -> str:
    """The scenario of an id with a controller inside."""
    return next(one for one in names("scenario") if environment_id(one, "Residual") == environment)


def _rig(rig: dict[str, Any]) -> str:
    """About which rig the training drew others: the default, or that of a file of the examples."""
    if "randomize" not in rig:
        return "default"
    for path in sorted((ROOT / "examples").glob("*_rig.toml")):
        own = load_parameters(path).to_dict()
        if own.get("randomize") == rig["randomize"]:
            return f"`{path.stem}`"
    raise ValueError(f"randomize = {rig['randomize']}; allowed: that of a file in examples")


def _results() -> dict[str, dict[str, Any]]:
    """Policy -> what the studies of policies measured of it."""
    found: dict[str, dict[str, Any]] = {}
    for name in MEASURED:
        found |= json.loads((ROOT / "lab" / "results" / f"{name}.json").read_text(encoding="utf-8"))["figures"]
    return found


def _reached(name: str, settings: dict[str, Any], result: dict[str, Any] | None) -> list[str]:
    scores = {sensors: _scores(name, settings, sensors) for sensors in ("ideal", "lab")}
    shown = [f"{mean(own):.0f} [{min(own)}, {max(own)}]" if own else "-" for own in scores.values()]
    weak = [f"of no use with `{sensors}` sensors" for sensors, own in scores.items() if own and mean(own) < USELESS]
    weak += [NOTES[name]] if name in NOTES else []
    if result is None:
        return [f"`{name}`", *shown, "-", "-", "-", "-", "; ".join(weak)]
    (felt,) = (values for who, values in result["felt"].items() if "seeds" in who)
    errors = {row[0]: row[3:] for row in result["metrics"]["rows"] if "seeds" in row[2]}
    median, often, worst = errors["settled_rms"]
    if worst == "lost" or float(worst) > FAR:
        weak.append("loses the head in the worst world" if worst == "lost" else f"{float(worst):.0f} mm in the worst world")
    air = [errors[f"pneumatic_rms_{cylinder}"][0] for cylinder in (1, 2)]
    if max(map(float, air)) > LOOSE:
        weak.append(f"pneumatic stiffness off by {float(air[0]):.0f} and {float(air[1]):.0f} %")
    stiffness = felt["stiffness_error"]
    if stiffness[1] > LOOSE:
        weak.append(f"stiffness at rest off by {stiffness[1]:.0f} % in one world of twenty")
    return [f"`{name}`", *shown, median, often, *(number(one) for one in stiffness[:2]), "; ".join(weak)]


def _scores(name: str, settings: dict[str, Any], sensors: str) -> list[int]:
    """Of the training seeds, in the task of the training."""
    plain = environment_id(_scenario(settings["environment"])).removeprefix("BirthSIM/").rpartition("-v")[0]
    with FILE.open(encoding="utf-8") as file:
        return [
            int(row["normalised return"])
            for row in csv.DictReader(file)
            if (row["scenario"], row["sensors"], row["rig"]) == (plain, sensors, "randomised")
            and row["controller"].startswith(f"{name} seed")
        ]
