"""Outcomes as JSON, as lines on the screen and as a table."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from baselines.files import write_json, write_text
from tests.kills.tries import SCENARIOS, Outcome

COLUMNS = ("tries", "equal", "mixed", "broken", "leftovers", "tracebacks", "more than a line", "workers left", "other")

INTRODUCTION = """# What killed commands leave

`make kills` runs every command once undisturbed, and then again and again: it kills it at a random moment, looks at what lies there, runs
the same command to its end, and compares every result with that of the undisturbed run, byte for byte. Half of the
moments are spread evenly over the run's time. The other half follow a random change of the folder, since files are written in a short part
of that time. Half of the runs begin with the results of an earlier run with other arguments in the same folder.

| scenario | what happens |
|---|---|
| SIGKILL, SIGTERM | the command gets the signal, its workers do not |
| SIGHUP | the whole process group gets it, as from a terminal that closes |
| Ctrl-C twice | the whole process group gets SIGINT, and once more within 0.3 s |
| disk full | the folder is on a disk in memory that is filled at a random byte; the second run has room |
| two at once | two of the same command, a random time apart, on one folder |

| column | counts tries |
|---|---|
| equal | after which results are those of the undisturbed run; for `record`: after which the file plays what was recorded, up to 1.5 s before the kill |
| mixed | after which, before the second run, results of two runs lay beside each other |
| broken | after which a file could not be read to its end |
| leftovers | with hidden files, claims, temporary files or semaphores: after a clean end of the first run, or after the second |
| tracebacks | in which a command printed one |
| more than a line | in which a command complained in more than one line |
| workers left | in which a process was alive 30 s after the command had ended |
| other | with another fault, such as an exit status that is not the signal's |

May differ: `times.json`, the cost in a piece, the search's journal `trials.journal`, and `seconds` in `training.json`.
"""


def summary(outcome: Outcome) -> str:
    """One line; faults follow."""
    verdict = "equal" if outcome.equal else "NOT EQUAL"
    words = [f"{outcome.target:10} {outcome.scenario:13} {outcome.moment:16} {outcome.statuses} {verdict} {outcome.seconds:.1f} s"]
    for name in ("mixed", "broken", "leftovers", "tracebacks", "talk", "alive", "trouble"):
        if found := getattr(outcome, name):
            words.append(f"    {name}: {found}")
    return "\n".join(words)


def write_outcomes(path: Path, outcomes: Sequence[Outcome], seed: int) -> None:
    """Write what was found; outcomes of other targets that the file holds stay."""
    new = {outcome.target for outcome in outcomes}
    kept = [one for one in (read_outcomes(path) if path.exists() else []) if one["target"] not in new]
    write_json(path, {"outcomes": [*kept, *({**asdict(outcome), "seed": seed} for outcome in outcomes)]})


def read_outcomes(path: Path) -> list[dict[str, Any]]:
    """The outcomes in a file."""
    found: list[dict[str, Any]] = json.loads(path.read_text(encoding="utf-8"))["outcomes"]
    return found


def write_page(path: Path, outcomes: Sequence[dict[str, Any]]) -> None:
    """Write the table of all targets and scenarios."""
    lines = [INTRODUCTION, f"| command | scenario | {' | '.join(COLUMNS)} |", "|" + "---|" * (len(COLUMNS) + 2)]
    for target in dict.fromkeys(one["target"] for one in outcomes):
        for scenario in SCENARIOS:
            chosen = [one for one in outcomes if (one["target"], one["scenario"]) == (target, scenario)]
            if chosen:
                lines.append(f"| {target} | {scenario} | {' | '.join(map(str, _counts(chosen)))} |")
    slowest = max(one["seconds"] for one in outcomes)
    count = len(outcomes)
    faults = [f"- {one['target']}, {one['scenario']}, {one['moment']}: {word}" for one in outcomes for word in _faults(one)]
    lines += ["", f"{count} tries in all. The last process of a killed command was gone {slowest:.1f} s after it at most."]
    if faults:
        lines += ["", "## What fell short", "", *faults]
    write_text(path, "\n".join(lines) + "\n")


def _counts(outcomes: Sequence[dict[str, Any]]) -> list[int]:
    names = ("equal", "mixed", "broken", "leftovers", "tracebacks", "talk", "alive", "trouble")
    return [len(outcomes), *(sum(bool(one[name]) for one in outcomes) for name in names)]


def _faults(outcome: dict[str, Any]) -> list[str]:
    words = ["results of two runs beside each other until the next run"] if outcome["mixed"] else []
    words += [f"broken: {outcome['broken'][0]}"] if outcome["broken"] else []
    words += [f"left: {', '.join(outcome['leftovers'][:3])}"] if outcome["leftovers"] else []
    words += ["a traceback"] if outcome["tracebacks"] else []
    words += ["a process left"] if outcome["alive"] else []
    return words + outcome["trouble"]
