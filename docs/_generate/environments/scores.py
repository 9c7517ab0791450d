"""What others reach in an environment, from docs/data/scores.csv, and how open that leaves it."""

import csv
import math
from pathlib import Path

from _generate.tables import table
from birthsim.benchmark.suites import SUITES
from birthsim_env.parts.scenarios import environment_id, find_scenario, scored_scenarios
from birthsim_env.physics.rig.topology import RAIL
from birthsim_env.scores import BEST, is_scored, reference_scores

FILE = Path(__file__).resolve().parents[2] / "data" / "scores.csv"
POLICY, NOBODY = "best learned policy", "none"
CLOSE = 3
"""A policy that is no more behind the best controller reaches it."""


def score_to_beat(scenario: str) -> str:
    """What others reach in an environment, how open that leaves it, and its tasks in the benchmark's suites."""
    rows = []
    for sensors in ("ideal", "lab"):
        paper, best, policy = scores(scenario, sensors)
        rows.append([f"`{sensors}`", paper, best, policy, _openness(best, policy)])
    head = ["sensors", "paper's controller", "best controller", "best learned policy", "how open"]
    return "\n\n".join([table(head, rows), *_suites_of(environment_id(scenario))])


def what_to_beat() -> str:
    """A row for every scored environment with ``lab`` sensors, the most open first."""
    found = [(scenario, scores(scenario, "lab")) for scenario in scored_scenarios()]
    found.sort(key=lambda one: _behind(one[1][1], one[1][2]), reverse=True)
    rows = [
        [f"[{environment_id(scenario)}](../environments/{page_of(scenario)}.md)", *own, _openness(own[1], own[2])]
        for scenario, own in found
    ]
    return table(["environment", "paper's controller", "best controller", "best learned policy", "how open"], rows)


def _behind(best: str, policy: str) -> float:
    """How many points the best policy is behind the best controller; without a policy nothing says."""
    return -math.inf if policy == NOBODY else int(best.partition(",")[0]) - int(policy.partition(",")[0])


def _openness(best: str, policy: str) -> str:
    if policy == NOBODY:
        return "open: no policy has been trained"
    behind = _behind(best, policy)
    return f"open: the best policy is {behind} behind" if behind > CLOSE else "closed: a policy reaches the best controller"


def _suites_of(name: str) -> list[str]:
    """A sentence for each suite that has tasks in an environment."""
    tasks = {suite: [f"`{task.name}`" for task in SUITES[suite] if task.environment == name] for suite in SUITES}
    called = "Tasks of the [benchmark](../benchmark.md)'s suite"
    return [f"{called} `{suite}`: {', '.join(own)}." for suite, own in tasks.items() if own]


def scores(scenario: str, sensors: str) -> list[str]:
    """On randomised rigs: of the paper's controller, and of the best ones with their names."""
    name = environment_id(scenario)
    if not is_scored(name):
        return [NOBODY] * 3
    with FILE.open(encoding="utf-8") as file:
        rows = [(row["scenario"], row["sensors"], row["rig"], row["controller"], row["score"]) for row in csv.DictReader(file)]
    plain = name.removeprefix("BirthSIM/").rpartition("-v")[0]
    known = {who: score for *where, who, score in rows if where == [plain, sensors, "randomised"]}
    roles = reference_scores(name, sensors)
    cells = [known[roles["paper's law"]["controller"]]]
    for role in (BEST, POLICY):
        who = roles[role]["controller"] if role in roles else ""
        cells.append(f"{known[who]}, `{who.partition(' ')[0]}`" if who else NOBODY)
    return cells


def page_of(scenario: str) -> str:
    """The page of docs/environments that shows a scenario."""
    return "rail" if find_scenario(scenario).linkage == RAIL else scenario
