"""Mutation scores as the report has them: a summary of what ``birthsim study mutation`` writes, with hashes and judgements.

birthsim study mutation --out out/mutation.json && birthsim study verification mutation out/mutation.json
"""

import tomllib
from pathlib import Path
from typing import Any

from birthsim_env.physics.rig.json_reading import read_json
from birthsim_env.physics.rig.schema import Each
from lab.studies.mutation.modules import MODULES, files_of
from lab.studies.verification import sources

JUDGEMENTS = Path(__file__).parent / "survivors.toml"
VERDICTS = ("equivalent", "numerical", "out of reach", "missing test")
"""Equivalent: no input tells it from the original, or it changes unused scratch. Numerical: it changes results by less than
any tolerance that means something. Out of reach: only inputs that callers exclude tell them apart. Missing test: one would."""


def summary(results: dict[str, Any]) -> dict[str, Any]:
    """Of each module in a report of the mutation tester: score, survivors, tests, and the hashes of what was measured."""
    found = {}
    for module, result in results.items():
        mutants = result["mutants"]
        files = [sources.path_of(module), *(str(path.relative_to(sources.ROOT)) for path in files_of(module))]
        found[module] = {
            "every": result["every"],
            "tried": len(mutants),
            "killed": sum(mutant["killed_by"] is not None for mutant in mutants.values()),
            "seconds": round(result["seconds"]),
            "tests": sorted(result["tests"]),
            "left_out": result["left_out"],
            "survivors": {
                name: {"line": mutant["line"], "change": mutant["change"]}
                for name, mutant in mutants.items()
                if mutant["killed_by"] is None
            },
            "commit": sources.commit(),
            "sources": sources.digests(files),
        }
    return found


def take(path: Path) -> None:
    """Put the modules of a report of ``birthsim study mutation`` in the place of their older measurements."""
    stored = sources.load("mutation") if (sources.MEASURED / "mutation.json").is_file() else {}
    new = stored | summary(read_json("mutation", path, Each(dict)))
    sources.keep("mutation", {module: new[module] for module in MODULES if module in new})


def judgements() -> dict[str, dict[str, str]]:
    """Survivor -> ``verdict`` and ``reason``."""
    tables: dict[str, dict[str, str]] = tomllib.loads(JUDGEMENTS.read_text(encoding="utf-8"))
    return tables


def score(measured: dict[str, Any]) -> float:
    """Share of the mutants that were killed, 0 to 1."""
    return float(measured["killed"] / measured["tried"])
