"""Outcomes as JSON, as lines on the screen and as a table."""

from collections.abc import Sequence
from dataclasses import asdict
from datetime import date
from pathlib import Path
from typing import Any

from birthsim_env.files import write_json, write_text
from birthsim_env.physics.rig.json_reading import read_json
from birthsim_env.physics.rig.schema import Listed
from lab.engine.results import commit
from lab.studies.kills.tries import SCENARIOS, Outcome

COLUMNS = ("times", "tries", "equal", "mixed", "broken", "leftovers", "tracebacks", "more than a line", "workers left", "other")

_OUTCOME = {
    **dict.fromkeys(("target", "scenario", "moment", "commit", "date"), str),
    **dict.fromkeys(("count", "seed", "tracebacks"), int),
    **dict.fromkeys(("broken", "leftovers", "talk", "trouble"), Listed(str)),
    **dict.fromkeys(("equal", "mixed", "alive"), bool),
    "seconds": float,
}

INTRODUCTION = Path(__file__).with_name("introduction.md")


def summary(outcome: Outcome) -> str:
    """One line; faults follow."""
    verdict = "equal" if outcome.equal else "NOT EQUAL"
    words = [
        f"{outcome.target:10} {outcome.scenario:13} {outcome.moment:16} {outcome.statuses} {verdict} {outcome.seconds:.1f} s"
    ]
    for name in ("mixed", "broken", "leftovers", "tracebacks", "talk", "alive", "trouble"):
        if found := getattr(outcome, name):
            words.append(f"    {name}: {found}")
    return "\n".join(words)


def write_outcomes(path: Path, outcomes: Sequence[Outcome], seed: int) -> list[dict[str, Any]]:
    """Write what was found, and return all of the file; outcomes of other targets and seeds that it holds stay."""
    new = {outcome.target for outcome in outcomes}
    kept = [one for one in (read_outcomes(path) if path.exists() else []) if one["target"] not in new or one["seed"] != seed]
    made = {"seed": seed, "commit": commit()[:7], "date": date.today().isoformat()}
    every = [*kept, *(asdict(outcome) | made for outcome in outcomes)]
    write_json(path, {"outcomes": every})
    return every


def read_outcomes(path: Path) -> list[dict[str, Any]]:
    """The outcomes in a file."""
    found: list[dict[str, Any]] = read_json("--out", path, {"outcomes": Listed(_OUTCOME)})["outcomes"]
    return found


def write_page(path: Path, outcomes: Sequence[dict[str, Any]]) -> None:
    """Write the table of all targets and scenarios."""
    lines = [
        INTRODUCTION.read_text(encoding="utf-8"),
        f"| command | scenario | {' | '.join(COLUMNS)} |",
        "|" + "---|" * (len(COLUMNS) + 2),
    ]
    for target in dict.fromkeys(one["target"] for one in outcomes):
        for scenario in SCENARIOS:
            chosen = [one for one in outcomes if (one["target"], one["scenario"]) == (target, scenario)]
            if chosen:
                lines.append(f"| {target} | {scenario} | {' | '.join(map(str, _counts(chosen)))} |")
    slowest, count = max(one["seconds"] for one in outcomes), sum(one["count"] for one in outcomes)
    faults = [f"- {one['target']}, {one['scenario']}, {one['moment']}: {word}" for one in outcomes for word in _faults(one)]
    lines += ["", f"{count} times in {len(outcomes)} tries. Nothing of a killed command ran for longer than {slowest:.1f} s."]
    for made in dict.fromkeys((one["commit"], one["date"]) for one in outcomes):
        names = dict.fromkeys(one["target"] for one in outcomes if (one["commit"], one["date"]) == made)
        lines.append(f"Tried at commit {made[0]}, {made[1]}: {', '.join(names)}.")
    if faults:
        lines += ["", "## What fell short", "", *faults]
    write_text(path, "\n".join(lines) + "\n")


def _counts(outcomes: Sequence[dict[str, Any]]) -> list[int]:
    names = ("equal", "mixed", "broken", "leftovers", "tracebacks", "talk", "alive", "trouble")
    return [sum(one["count"] for one in outcomes), len(outcomes), *(sum(bool(one[name]) for one in outcomes) for name in names)]


def _faults(outcome: dict[str, Any]) -> list[str]:
    words = ["results of two runs beside each other until the next run"] if outcome["mixed"] else []
    words += [f"broken: {outcome['broken'][0]}"] if outcome["broken"] else []
    words += [f"left: {', '.join(outcome['leftovers'][:3])}"] if outcome["leftovers"] else []
    words += ["a traceback"] if outcome["tracebacks"] else []
    words += ["a process left"] if outcome["alive"] else []
    return [*words, *outcome["trouble"]]
