"""``birthsim study verification``: measurements and page of the verification report."""

from __future__ import annotations

import json
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from baselines.commands.settings import Configured
from studies.verification import balances, mutants, reached, report, sources

ACCURACY = (
    *("studies/accuracy/errors.py", "studies/accuracy/motions.py", "studies/accuracy/second_model.py"),
    *("birthsim_env/parts/drawn/randomization.py", *(path for path in balances.SOURCES if path.startswith("birthsim_env"))),
)
"""Files that decide the figures of ``birthsim study accuracy``."""


@dataclass(kw_only=False)
class Settings(Configured):
    """Measure the balances (a quarter of a minute) or the coverage (minutes), take what birthsim study mutation or accuracy
    wrote, or write docs/verification.md from what is stored.
    """

    what: Literal["balances", "coverage", "mutation", "accuracy", "report"]
    path: Path = Path()
    """For mutation its report, for accuracy its folder."""


def main(options: Settings) -> None:
    """Measure, take or write."""
    if options.what == "balances":
        keep("balances", balances.measure(), balances.SOURCES)
    elif options.what == "coverage":
        files = [path for module in sources.load("mutation").values() for path in module["sources"]]
        keep("coverage", reached.measure(), files)
    elif options.what == "mutation":
        mutants.take(options.path)
    elif options.what == "accuracy":
        keep("accuracy", json.loads((options.path / "accuracy.json").read_text(encoding="utf-8"))["figures"], ACCURACY)
        shutil.copy(options.path / "accuracy.png", sources.ROOT / "docs" / "accuracy.png")
    else:
        report.PAGE.write_text(report.page(), encoding="utf-8")


def keep(name: str, content: dict[str, Any], files: tuple[str, ...] | list[str]) -> None:
    """Store a measurement with what it was measured on."""
    sources.keep(name, {**content, "commit": sources.commit(), "sources": sources.digests(files)})
