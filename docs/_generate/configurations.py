"""What ``birthsim train --config`` knows by name: what each configuration trains, how long, and what of it is shipped."""

import tomllib
from functools import cache
from statistics import median
from typing import Any

from agents.reader.settings import load_reader_settings, reader_configurations
from agents.training.configuration import FOLDER, configuration_names, load_configuration
from birthsim_env.physics.rig.json_reading import read_json

POLICIES = FOLDER.parent / "policies"


def configurations() -> str:
    """A row for each configuration, and for each that teaches a reader of rigs."""
    rows = [_row(name) for name in configuration_names()]
    for name in reader_configurations():
        settings = load_reader_settings(name)
        rows.append(f"| `{name}` | by supervision | {settings.sensors} | - | {settings.updates:,} updates | - |")
    head = "| configuration | algorithm, what it drives | sensors | lanes | policy steps | shipped: seeds, s of a seed |"
    return "\n".join([head, "|---|---|---|---|---|---|", *rows])


def _row(name: str) -> str:
    training, residual = load_configuration(name)
    drives = "valves alone" if residual.law == "none" else f"corrects `{residual.law}`"
    sensors = training.sensors if residual.force_sensor else f"{training.sensors}, no force sensor"
    shipped = [f"`{policy}`: {seeds}, {seconds:.0f}" for policy, (seeds, seconds) in _shipped(name).items()]
    cells = f"`{training.algorithm}`, {drives}", sensors, f"{training.lanes}", f"{training.steps:,}", "; ".join(shipped) or "-"
    return f"| `{name}` | {' | '.join(cells)} |"


def _shipped(name: str) -> dict[str, tuple[int, float]]:
    """Of each policy in the package that this configuration describes best, its seeds and their median time, s."""
    found = {}
    for folder in sorted(path for path in POLICIES.iterdir() if path.is_dir()):
        trainings = [
            read_json("training", path, {"settings": dict, "curve": list}) for path in folder.glob("seed_*/training.json")
        ]
        known = {one: _likeness(one, trainings[0]["settings"]) for one in configuration_names()}
        best = max(known, key=lambda one: known[one])
        if best == name and known[best] > 0:
            found[folder.name] = len(trainings), median(one["curve"][-1]["seconds"] for one in trainings)
    return found


def _likeness(name: str, settings: dict[str, Any]) -> float:
    """How many values of a configuration a training has, and more where its environment is the same; 0 where it has others."""
    given = _given(name)
    environment = given["environment"] == settings["environment"]
    rest = {key: value for key, value in given.items() if key != "environment"}
    same = all(settings.get(key) == value for key, value in rest.items())
    return len(rest) + (0.5 if environment else 0.0) if same else 0.0


@cache
def _given(name: str) -> dict[str, Any]:
    content = tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))
    return {**content.get("training", {}), **content.get("residual", {})}
