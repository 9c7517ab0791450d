"""``birthsim study leaderboard``: runs every entry of leaderboard/ again, which has to repeat bit for bit; writes the table.

An entry is the ``evaluation.json`` of one controller under ``RULES``, by any name. It names a registered controller, a policy
that is shipped or in a folder beside it, or a Python file beside it, and nothing else of an entry is run or reaches a command.
"""

import os
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from baselines.bench.statistics import number, penalize_lost, summarize
from baselines.controller import RESIDUAL
from baselines.named import make_controller, resolved
from birthsim.command_line.settings import Configured
from birthsim.commands.evaluate import Settings as Evaluated
from birthsim_env import Parameters, normalized_score, reference_scores
from birthsim_env.files import write_text
from birthsim_env.physics.compiled.sources import ROOT
from birthsim_env.physics.rig.json_reading import read_json
from birthsim_env.physics.rig.schema import Each, Listed
from birthsim_env.physics.rig.values import in_line, shown
from birthsim_env.registry import names, register
from birthsim_env.splits import TEST
from lab.engine import information
from lab.engine.tables import markdown
from lab.engine.worlds import worlds

ENTRIES, TABLE = ROOT / "lab" / "leaderboard", ROOT / "docs" / "data" / "leaderboard.md"
RULES: dict[str, Any] = {"sensors": "lab", "randomize": "all", "episodes": 64, "seed": TEST.first}
"""Arguments of ``birthsim evaluate`` that every entry has."""

OWN = ("env", "controller")
"""Arguments in which entries differ; all others have their defaults."""

_RESULT = {
    "controller": str, "episodes": {"settled_rms": Listed((float, None), 1)}, "lost": Listed(bool, 1),
    "returns": {"1.0": Listed(float, 1)},
}  # fmt: skip
_ENTRY = {"arguments": {"env": str, "controller": Listed(str)}, "rig": Each(dict), "results": Listed(_RESULT)}

_NAME = re.compile(r"[\w-]+")
_BESIDE = re.compile(r"([A-Za-z_]\w*\.py):[A-Za-z_]\w*")
_REGISTERED = re.compile(r"(limited:)?[a-z][\w-]*(\[[\w.,=+-]+\])?")


@dataclass(kw_only=True)
class Settings(Configured):
    """Run every entry of leaderboard/ again, say which repeats in every bit, and write docs/data/leaderboard.md."""


@register(study="leaderboard", about="whether entries of leaderboard/ repeat, bit for bit")
def main(_: Settings) -> None:
    """Exit with 1 where an entry does not repeat; the table is written where all do."""
    problems = {path.stem: _problem(path) for path in entries()}
    for name, said in problems.items():
        print(f"{shown(name)}: {said or 'repeats in every bit'}", flush=True)
    if any(problems.values()):
        raise SystemExit(1)
    write_text(TABLE, table())


def _problem(path: Path) -> str:
    """What is wrong with an entry, damage too."""
    try:
        return problem(path)
    except ValueError as error:
        return str(error)


def entries() -> list[Path]:
    """The files of the entries."""
    return sorted(ENTRIES.glob("*.json"))


def problem(path: Path) -> str:
    """What is wrong with an entry; "" where it follows the rules and repeats.

    Raises ``ValueError`` where it is no ``evaluation.json``.
    """
    said = entry(path)
    if broken := against_rules(said, path.parent):
        return broken
    given = said["arguments"]
    # Where its file lies, which Python does not search for modules.
    line = [sys.executable, "-P", "-m", "birthsim", "evaluate", "--env", given["env"], "--controller", *given["controller"]]
    line += [part for name, value in RULES.items() for part in (f"--{name}", str(value))]
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [*line, "--out", folder],
            cwd=path.parent,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            return in_line(done.stderr.strip().rpartition("\n")[2]) or f"birthsim evaluate ended with {done.returncode}"
        found = entry(Path(folder) / "evaluation.json")
    differs = sorted(key for key in {*said, *found} if said.get(key) != found.get(key))
    return f"other {' and '.join(differs)} here" if differs else ""


def against_rules(said: dict[str, Any], folder: Path = ENTRIES) -> str:
    """What of an entry in ``folder`` the rules do not allow, or ""; nothing that it names is run."""
    if len(said["results"]) != 1:
        return f"{len(said['results'])} controllers; allowed: one"
    given, known = said["arguments"], Evaluated(out=folder).shown()
    if unknown := [name for name in given if name not in known]:
        return f"argument {shown(unknown[0])}; allowed: {', '.join(known)}"
    for name in known:
        value, allowed = given.get(name), RULES.get(name)
        usual: list[Any] = [[]] if name == "set" else []
        if name not in OWN and not any(value == one and type(value) is type(one) for one in (allowed, *usual)):
            return f"{name} = {shown(value)}; allowed: {allowed!r}"
    if len(given["controller"]) != 1:
        return f"controller = {shown(given['controller'])}; allowed: a list of one name"
    return _not_known(given["env"]) or _not_allowed(given["controller"][0], folder)


def _not_known(environment: str) -> str:
    """What is wrong with an entry's environment, or ""."""
    try:
        reference_scores(environment)
    except ValueError as error:
        return str(error)
    return ""


def _not_allowed(name: str, folder: Path) -> str:
    """What is wrong with an entry's controller, or ""."""
    said = f"controller = {shown(name)}"
    if beside := _BESIDE.fullmatch(name):
        file = folder / beside[1]
        return (
            ""
            if os.path.isfile(file) and not os.path.islink(file)
            else f"{said}; allowed: a file beside the entry, and no link"
        )
    if name.startswith(f"{RESIDUAL}:"):
        return (
            ""
            if _is_policy(name.removeprefix(f"{RESIDUAL}:"), folder)
            else (f"{said}; allowed: {RESIDUAL}: and a shipped policy, or the name of a folder beside the entry, without links")
        )
    registered = [one for one in names("controller") if one != RESIDUAL]
    if not _REGISTERED.fullmatch(name) or resolved(name)[0] not in registered:
        return (
            f"{said}; allowed: {', '.join(registered)}, with options as in pid[bandwidth=60]; {RESIDUAL}:POLICY; FILE.py:NAME "
            "of a file beside the entry"
        )
    try:
        make_controller(name, Parameters())  # which looks at its options
    except ValueError as error:
        return f"{said}: {error}"
    return ""


def _is_policy(name: str, folder: Path) -> bool:
    """Whether a policy is shipped, or is in a folder beside the entry that holds no links."""
    own = folder / name
    if name in names("policy"):
        return True
    return bool(_NAME.fullmatch(name)) and own.is_dir() and not any(one.is_symlink() for one in (own, *own.rglob("*")))


def entry(path: Path) -> dict[str, Any]:
    """An entry as it stands; ``ValueError`` names it and what is missing or damaged."""
    if not _NAME.fullmatch(path.stem):
        raise ValueError(f"entry = {shown(path.name)}; allowed: letters, digits, _ and -, and .json")
    said: dict[str, Any] = read_json("entry", path, _ENTRY)
    return said


def table() -> str:
    """The entries in Markdown, by environment and score, with the mean score of their episodes."""
    rows = [row(entry(path), path.stem) for path in entries()]
    who = ["environment", "entry", "controller", *information.COLUMNS]
    head = [*who, "score", "settled error, mm, median", "95th percentile", "lost of 64"]
    said = f"{worlds(RULES['seed'], RULES['episodes'])}, the same for every entry."
    return f"{said}\n\n{markdown([head, *(one for _, _, one in sorted(rows))])}\n"


def row(said: dict[str, Any], name: str) -> tuple[str, float, list[str]]:
    """Environment, minus the score, and cells of an entry that follows the rules."""
    environment, (result,) = said["arguments"]["env"], said["results"]
    returns = np.array(result["returns"]["1.0"], dtype=float)
    score = float(np.mean(normalized_score(environment, returns, RULES["sensors"])))
    error = summarize(penalize_lost(result["episodes"]["settled_rms"], result["lost"], applies=True))
    figures = [f"{score:.1f}", *(number(error[key]) for key in ("median", "q95")), str(sum(result["lost"]))]
    facts = information.informed_if_registered(result["controller"], RULES["sensors"])
    return environment, -score, [f"`{environment}`", name, f"`{result['controller']}`", *facts, *figures]
