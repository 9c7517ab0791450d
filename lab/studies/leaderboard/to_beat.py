"""The table of README and of the site's first page: what is good already, and what is to beat."""

import re

from birthsim.benchmark.suites import BOTH, SUITES, BenchmarkTask, find_suite
from birthsim_env.physics.compiled.sources import ROOT
from lab.engine.tables import markdown
from lab.studies.leaderboard import who
from lab.studies.leaderboard.records import Known, over_all

README = ROOT / "README.md"

PAPERS = "backstepping"
"""The entry of the paper's controller."""

KINDS = {
    "ideal": "ideal sensors",
    "lab": "`lab` sensors",
    "honest": "`honest` sensors",
    "honest-no-force": "`honest`, no force sensor",
    "honest-friction": "`honest`, other friction",
    "honest-wide": "`honest`, extreme rigs",
}
"""A task's name without its scenario -> words, of the rig with two cylinders."""

RAIL = "one cylinder on a rail"


def to_beat(known: Known) -> str:
    """For each kind of tasks the paper's controller, and the best entries that have all of them, learned and not."""
    rows = [["tasks", "paper's controller", "best classical", "its score", "its success", "best learned", "its score"]]
    for words, tasks in _groups().items():
        found = over_all(tasks, known)
        papers = next((one.shown for one in found if one.name == PAPERS), "-")
        classical = next((one for one in found if not who.is_learned(one.said)), None)
        learned = next((one for one in found if who.is_learned(one.said)), None)
        best = [f"`{classical.name}`", classical.shown, f"{100 * classical.success:.0f} %"] if classical else ["-"] * 3
        taught = [f"`{learned.name}`", learned.shown] if learned else ["-"] * 2
        rows.append([f"{words} ({len(tasks)})", papers, *best, *taught])
    return markdown(rows)


def _groups() -> dict[str, list[BenchmarkTask]]:
    """Words -> tasks of a row."""
    kinds = {words: [task for task in find_suite(BOTH) if task.name.partition("-")[2] == kind] for kind, words in KINDS.items()}
    return {**kinds, RAIL: list(SUITES["rail"])}


def in_readme(table: str) -> str:
    """README with a table in the place of the only one that it has."""
    text = README.read_text(encoding="utf-8")
    assert len(_TABLE.findall(text)) == 1, README
    return _TABLE.sub(lambda _: table.rstrip() + "\n", text)


_TABLE = re.compile(r"^(?:\|[^\n]*\n)+", re.MULTILINE)
