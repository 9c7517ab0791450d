"""``birthsim study leaderboard``: runs every entry of leaderboard/ again, which has to repeat bit for bit; writes the table.

An entry is the ``evaluation.json`` of one controller under ``RULES``, by any name. A controller of one's own is a file beside.
"""

import json
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from baselines.bench.statistics import number, penalize_lost, summarize
from baselines.commands.settings import Configured
from birthsim_env import normalized_score
from birthsim_env.files import write_text
from birthsim_env.physics.compiled.sources import ROOT
from studies.tables import markdown

ENTRIES, TABLE = ROOT / "leaderboard", ROOT / "docs" / "data" / "leaderboard.md"
RULES: dict[str, Any] = {"sensors": "lab", "randomize": "all", "episodes": 64, "seed": 80000}
"""Arguments of ``birthsim evaluate`` that every entry has; seeds that guided nothing here."""

OWN = ("env", "controller", "policy")
"""Arguments in which entries differ; all others have their defaults."""


@dataclass(kw_only=True)
class Settings(Configured):
    """Run every entry of leaderboard/ again, say which repeats in every bit, and write docs/data/leaderboard.md."""


def main(_: Settings) -> None:
    """Exit with 1 where an entry does not repeat."""
    problems = {path.stem: problem(path) for path in entries()}
    for name, said in problems.items():
        print(f"{name}: {said or 'repeats in every bit'}", flush=True)
    write_text(TABLE, table())
    raise SystemExit(int(any(problems.values())))


def entries() -> list[Path]:
    """The files of the entries."""
    return sorted(ENTRIES.glob("*.json"))


def problem(path: Path) -> str:
    """What is wrong with an entry; "" where it follows the rules and repeats."""
    said = json.loads(path.read_text(encoding="utf-8"))
    if broken := against_rules(said):
        return broken
    given = said["arguments"]
    policy = ["--policy", given["policy"]] if given["policy"] else []
    line = [sys.executable, "-m", "birthsim", "evaluate", "--env", given["env"], "--controller", *given["controller"], *policy]
    line += [part for name, value in RULES.items() for part in (f"--{name}", str(value))]
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run([*line, "--out", folder], cwd=ROOT, capture_output=True, text=True, check=False)
        if done.returncode:
            return done.stderr.strip().rpartition("\n")[2]
        found = json.loads((Path(folder) / "evaluation.json").read_text(encoding="utf-8"))
    differs = [key for key in said if said[key] != found.get(key)]
    return f"other {' and '.join(differs)} here" if differs else ""


def against_rules(said: dict[str, Any]) -> str:
    """What of an entry the rules do not allow, or ""."""
    if len(said["results"]) != 1:
        return f"{len(said['results'])} controllers; allowed: one"
    for name, value in said["arguments"].items():
        allowed = RULES.get(name)
        if name not in OWN and value not in ([], allowed):
            return f"{name} = {value!r}; allowed: {allowed!r}"
    return ""


def table() -> str:
    """The entries in Markdown, by environment and score, with the mean score of their episodes."""
    rows = []
    for path in entries():
        said = json.loads(path.read_text(encoding="utf-8"))
        environment, (result,) = said["arguments"]["env"], said["results"]
        returns = np.array(result["returns"]["1.0"], dtype=float)
        score = float(np.mean(normalized_score(environment, returns, RULES["sensors"])))
        error = summarize(penalize_lost(result["episodes"]["settled_rms"], result["lost"], applies=True))
        figures = [f"{score:.1f}", *(number(error[key]) for key in ("median", "q95")), str(sum(result["lost"]))]
        rows.append((environment, -score, [f"`{environment}`", path.stem, f"`{result['controller']}`", *figures]))
    head = ["environment", "entry", "controller", "score", "settled error, mm, median", "95th percentile", "lost of 64"]
    return markdown([head, *(row for _, _, row in sorted(rows))]) + "\n"
