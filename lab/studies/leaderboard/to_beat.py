"""The table of README and of the site's first page: what is good already, and what is to beat."""

import re
from typing import Any

from birthsim.benchmark.row import overall
from birthsim.benchmark.suites import TASKS, BenchmarkTask
from birthsim_env.physics.compiled.sources import ROOT
from lab.engine.tables import markdown
from lab.studies.leaderboard import who

README = ROOT / "README.md"

Known = dict[str, dict[str, Any]]

PAPERS = "backstepping"
"""The entry of the paper's controller."""

KINDS = {
    "ideal": "ideal sensors",
    "lab": "`lab` sensors: late and noisy",
    "honest": "`honest` sensors: biased and distorted too",
    "honest-no-force": "`honest`, no force sensor",
    "honest-friction": "`honest`, unexpected friction",
    "honest-wide": "`honest`, rigs far outside the training ranges",
}
"""A task's name without its scenario -> words."""


def to_beat(known: Known) -> str:
    """For each kind of tasks the paper's controller, and the best entries that have all of them, learned and not."""
    rows = [["tasks", "paper's controller", "best controller", "its score", "its success", "best learned", "its score"]]
    for kind, words in KINDS.items():
        tasks = [task for task in TASKS.values() if task.name.partition("-")[2] == kind]
        classical = _best({name: said for name, said in known.items() if not who.is_learned(said)}, tasks)
        learned = _best({name: said for name, said in known.items() if who.is_learned(said)}, tasks)
        papers = _best({name: said for name, said in known.items() if name == PAPERS}, tasks)
        rows.append([f"{words} ({len(tasks)})", papers[1], *classical, *learned[:2]])
    return markdown(rows)


def in_readme(table: str) -> str:
    """README with a table in the place of the only one that it has."""
    text = README.read_text(encoding="utf-8")
    assert len(_TABLE.findall(text)) == 1, README
    return _TABLE.sub(lambda _: table.rstrip() + "\n", text)


_TABLE = re.compile(r"^(?:\|[^\n]*\n)+", re.MULTILINE)


def _best(known: Known, tasks: list[BenchmarkTask]) -> tuple[str, str, str]:
    """Of the entries that have all of some tasks the best: its name, its score with an interval, its success."""
    found = []
    for name, said in known.items():
        rows = {row["task"]: row for row in said["tasks"]}
        if all(task.name in rows for task in tasks) and (whole := overall([rows[task.name] for task in tasks])):
            success = sum(rows[task.name]["success"]["value"] for task in tasks) / len(tasks)
            score = f"{whole['iqm']:.1f} [{whole['low']:.1f}, {whole['high']:.1f}]"
            found.append((-whole["iqm"], f"`{name}`", score, f"{100 * success:.0f} %"))
    return min(found)[1:] if found else ("-", "-", "-")
