"""``birthsim study leaderboard``: runs entries of lab/leaderboard again, which repeat bit for bit, and writes the tables."""

import json
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from birthsim.benchmark.scoring import NAME, SENSORS, judge, plan
from birthsim.command_line.settings import MANY, Processes, whole
from birthsim_env.files import write_text
from birthsim_env.physics.rig.values import near, shown
from birthsim_env.registry import register
from lab.engine.results import written
from lab.engine.shelf import DATA
from lab.studies.leaderboard.entries import ENTRIES, RULES, against_rules, entries, entry, own_entries, policies_of
from lab.studies.leaderboard.tables import texts
from lab.studies.leaderboard.to_beat import README, in_readme

UNLIKE = ("seconds", "versions")
"""What differs from run to run, and from machine to machine."""


@dataclass(kw_only=True)
class Settings(Processes):
    """Run entries of lab/leaderboard again, say which repeats in every bit, and write the tables of docs/leaderboard.md.

    With --renew what is found takes the place of an entry, and those of own.toml are made where they are missing.
    """

    entries: Annotated[list[str] | None, MANY, Parameter(metavar="NAME...")] = None
    """Only these."""
    episodes: Annotated[int, whole(1, RULES["episodes"])] = RULES["episodes"]
    """Of each task the first ones alone are repeated."""
    renew: bool = False
    """Entries are written anew, as they are found."""
    tables: bool = False
    """Nothing is run; only the tables are written, from the entries as they stand."""


@register(study="leaderboard", about="whether entries of lab/leaderboard repeat, bit for bit")
def main(settings: Settings) -> None:
    """Exit with 1 where an entry does not repeat; the tables are written where all do."""
    problems = {path.stem: _problem(path, settings) for path in _chosen(settings)}
    for name, said in problems.items():
        print(f"{shown(name)}: {said or 'written anew' if settings.renew else said or 'repeats in every bit'}", flush=True)
    if any(problems.values()):
        raise SystemExit(1)
    for path, text in pages().items():
        write_text(path, text)


def pages() -> dict[Path, str]:
    """File -> its text: those of docs/data, and README with the table of what is to beat."""
    own = texts()
    return {DATA / name: text for name, text in own.items()} | {README: in_readme(own["to_beat.md"])}


def _chosen(settings: Settings) -> list[Path]:
    if settings.renew and settings.episodes != RULES["episodes"]:
        raise ValueError(f"--episodes {settings.episodes} with --renew; allowed: {RULES['episodes']}")
    known = {path.stem: path for path in entries()}
    if settings.renew:
        known |= {name: ENTRIES / f"{name}.json" for name in own_entries()}
    for name in settings.entries or ():
        if name not in known:
            raise ValueError(f"--entries {shown(name)}{near(name, known)}; allowed: {', '.join(known)}")
    return [] if settings.tables else [known[name] for name in settings.entries or known]


def _problem(path: Path, settings: Settings) -> str:
    """What is wrong with an entry, damage too."""
    try:
        return renewed(path, settings.jobs) if settings.renew else problem(path, settings.episodes, settings.jobs)
    except ValueError as error:
        return str(error)


def renewed(path: Path, jobs: int = 1) -> str:
    """What of an entry the rules do not allow; "" where it was run and written anew."""
    own = own_entries().get(path.stem)
    if own is not None:
        row = found([own[0]], own[1], path.stem, jobs=jobs)
    elif broken := against_rules(said := entry(path), path):
        return broken
    else:
        row = found(policies_of(said, path), tasks_of(said), said["entry"], said["policy_period"][0], jobs=jobs)
    write_text(path, written(row))
    return ""


def problem(path: Path, episodes: int = RULES["episodes"], jobs: int = 1) -> str:
    """What is wrong with an entry; "" where it follows the rules and the first ``episodes`` of each of its tasks repeat.

    Raises ``ValueError`` where it is no row of ``birthsim score``.
    """
    said = entry(path)
    if broken := against_rules(said, path):
        return broken
    again = found(policies_of(said, path), tasks_of(said), said["entry"], said["policy_period"][0], episodes, jobs)
    if episodes < RULES["episodes"]:
        pairs = [("sha256", said.get("sha256"), again["sha256"])]
        for one, own in zip(said["tasks"], again["tasks"], strict=True):
            pairs.append((f"errors of {one['task']}", [run[:episodes] for run in one["errors"]], own["errors"]))
    else:
        pairs = [(name, _alike(said.get(name)), _alike(again.get(name))) for name in sorted({*said, *again} - set(UNLIKE))]
    differs = [name for name, one, own in pairs if one != own]
    return f"other {' and '.join(differs)} here" if differs else ""


def tasks_of(said: dict[str, Any]) -> list[str]:
    """Names of an entry's tasks."""
    return [one["task"] for one in said["tasks"]]


def found(
    policies: list[str], tasks: list[str], name: str, period: float = 0.01, episodes: int = RULES["episodes"], jobs: int = 1
) -> dict[str, Any]:
    """The row of an entry as it is found now."""
    own = plan(policies, None, SENSORS, True, None, tasks, episodes, RULES["seed"], period, None, name)
    with tempfile.TemporaryDirectory() as folder:
        judge(own, Path(folder), jobs, None, True)
        row: dict[str, Any] = json.loads((Path(folder) / NAME).read_text(encoding="utf-8"))
    return row


def _alike(value: Any) -> Any:
    """A part of a row without what differs from run to run."""
    if isinstance(value, list) and all(isinstance(one, dict) for one in value):
        return [{name: own for name, own in one.items() if name not in UNLIKE} for one in value]
    return value
