"""The tables of docs/leaderboard.md, from the entries as they stand."""

import csv
import io

from birthsim.benchmark.row import SHOWN
from birthsim.benchmark.suites import SUITES, TASKS
from lab.engine import information
from lab.engine.tables import markdown
from lab.engine.worlds import worlds
from lab.studies.leaderboard import who
from lab.studies.leaderboard.cards import cards
from lab.studies.leaderboard.entries import RULES
from lab.studies.leaderboard.gains import gains
from lab.studies.leaderboard.records import Known, every_entry, over_all, records, standings
from lab.studies.leaderboard.seeds import seeds
from lab.studies.leaderboard.to_beat import to_beat

DATA = (
    "suite",
    "task",
    "entry",
    "learned",
    "seeds",
    *(f"{name}{end}" for name in SHOWN for end in ("", " low", " high")),
    "lost",
)
"""Columns of the data file; a success is a fraction, an error has mm."""

_RANKING, _RECORDS = "Entries that have every task of the suite:", "Records of its tasks:"


def texts() -> dict[str, str]:
    """File of docs/data -> its text."""
    known = every_entry()
    said = f"{worlds(RULES['seed'], RULES['episodes'])}, the same for every entry. In brackets: 95 % intervals."
    own = {
        f"leaderboard-{suite}.md": f"{_RANKING}\n\n{_ranking(suite, known)}\n\n{_RECORDS}\n\n{records(suite, known)}"
        for suite in SUITES
    }
    own |= {
        "leaderboard-worlds.md": said,
        "to_beat.md": to_beat(known),
        "leaderboard-entries.md": _entries(known),
        "leaderboard-tasks.md": "\n\n".join(_task(task, known) for task in TASKS),
        "leaderboard-cards.md": cards(known),
        "leaderboard-gains.md": gains(known),
        "rail_apg.md": seeds("rail-ideal", "rail_apg", ("admittance-adaptive", "pid", "abry", "backstepping"), known),
    }
    return {name: f"{text}\n" for name, text in own.items()} | {"leaderboard.csv": _data(known)}


def _ranking(suite: str, known: Known) -> str:
    """Entries that have every task of a suite, the best first."""
    rows = [["entry", "score of the suite", "interval over", "success, mean of tasks", "rig", "force sensed"]]
    for one in over_all(SUITES[suite], known):
        cells = [who.title(one.name, one.said), one.shown, one.over, f"{100 * one.success:.0f} %"]
        rows.append([*cells, *who.facts(one.said)[::2]])
    return markdown(rows)


def _entries(known: Known) -> str:
    head = ["entry", "policy or controller", "learned", "tasks", *information.COLUMNS]
    head += ["training seeds", "million steps", "minutes"]
    rows = [
        [name, f"`{said['given'][0]}`", who.learned(said), who.covers(said), *who.facts(said), *who.training(said)]
        for name, said in known.items()
    ]
    return markdown([head, *rows])


def _task(task: str, known: Known) -> str:
    """All entries of a task, the best first."""
    own = standings(task, known)
    rows = [["entry", "score", "success", "error, mm", "lost"]]
    for one in own:
        feasible = one.row["episodes"] - len(one.row["infeasible"])
        lost = f"{sum(one.row['lost'])} of {feasible * len(one.row['lost'])}"
        rows.append([who.title(one.name, one.said), *map(one.shown, SHOWN), lost])
    return f"`{task}`:\n\n{markdown(rows)}"


def _data(known: Known) -> str:
    """Every entry in every task, as CSV with the columns ``DATA``."""
    table: list[list[object]] = [list(DATA)]
    for suite, tasks in SUITES.items():
        for task in tasks:
            for one in standings(task.name, known):
                estimates = [value for name in SHOWN for value in one.row[name].values()]
                seeds, lost = len(one.row["lost"]), sum(one.row["lost"])
                table.append([suite, task.name, one.name, who.learned(one.said), seeds, *estimates, lost])
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(table)
    return text.getvalue()
