"""What is to beat: the records of the benchmark in a matrix, and the returns that controllers and policies reach."""

import csv
import json
from pathlib import Path
from typing import Any

from _generate.tables import table
from birthsim.benchmark.suites import TASKS
from birthsim_env.parts.scenarios import environment_id, find_scenario
from birthsim_env.physics.rig.topology import RAIL
from birthsim_env.registry import entries, names
from birthsim_env.scores import BEST, reference_returns
from lab.studies.leaderboard.records import every_entry, openness, standings
from lab.studies.leaderboard.who import title

FILE = Path(__file__).resolve().parents[2] / "data" / "scores.csv"
POLICY = "best learned policy"

COLUMNS = {
    "`ideal`": ("ideal",),
    "`lab`": ("lab",),
    "`honest`; on a rail `encoders`": ("honest", "encoders"),
    "the same, force not measured": ("honest-no-force", "encoders-no-force"),
}
"""Heading -> how names of the benchmark's tasks end; an environment has at most one of them."""


def what_to_beat() -> str:
    """A row for each environment that has tasks, and a cell for each of four kinds of sensors."""
    known, rows = every_entry(), []
    for scenario in names("scenario"):
        tasks = [[task for kind in kinds if (task := f"{scenario}-{kind}") in TASKS] for kinds in COLUMNS.values()]
        if any(tasks):
            called = environment_id(scenario).removeprefix("BirthSIM/")
            cells = [_cell(own[0], known) if own else "" for own in tasks]
            rows.append([f"[{called}](../environments/{page_of(scenario)}.md)", *cells])
    return table(["environment", *COLUMNS], rows)


def _cell(task: str, known: dict[str, Any]) -> str:
    """How open a task is, its record, and that of learned entries where it is another."""
    own = standings(task, known)
    lines = [f"**{openness(own)}**"]
    if own:
        lines.append(f"{own[0].score:.0f}, {title(own[0].name, own[0].said)}")
        learned = next((one for one in own if one.is_learned), None)
        if learned is not own[0]:
            lines.append(f"learned: {learned.score:.0f}, {learned.name}" if learned else "learned: none")
    return "<br>".join(lines)


def returns(scenario: str) -> str:
    """What others are paid in an environment, on the scale of returns."""
    rows = [[f"`{sensors}`", *_returns(scenario, sensors)] for sensors in ("ideal", "lab")]
    return table(["sensors", "paper's controller", "best classical controller", "best policy that is shipped"], rows)


def _returns(scenario: str, sensors: str) -> list[str]:
    """On randomised rigs: of the paper's controller, and of the best ones with their names."""
    name = environment_id(scenario)
    with FILE.open(encoding="utf-8") as file:
        columns = ("scenario", "sensors", "rig", "controller", "normalised return")
        rows = [[row[column] for column in columns] for row in csv.DictReader(file)]
    plain = name.removeprefix("BirthSIM/").rpartition("-v")[0]
    known = {who: score for *where, who, score in rows if where == [plain, sensors, "randomised"]}
    roles = reference_returns(name, sensors)
    cells = [known[roles["paper's law"]["controller"]]]
    for role in (BEST, POLICY):
        who = roles[role]["controller"] if role in roles else ""
        cells.append(f"{known[who]}, `{who.partition(' ')[0]}`" if who else _without(scenario, sensors))
    return cells


def _without(scenario: str, sensors: str) -> str:
    """What is said where there is no return: whether a policy comes with the package that was trained there."""
    files = (next(one.made.glob("seed_*/training.json")) for one in entries("policy"))
    trained = (json.loads(file.read_text(encoding="utf-8"))["settings"] for file in files)
    there = (environment_id(scenario, "Residual"), sensors)
    return "not measured" if there in ((own["environment"], own["sensors"]) for own in trained) else "none"


def page_of(scenario: str) -> str:
    """The page of docs/environments that shows a scenario."""
    return "rail" if find_scenario(scenario).linkage == RAIL else scenario
