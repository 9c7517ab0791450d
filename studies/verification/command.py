"""Measurements and page of the verification report.

birthsim study verification balances                # a quarter of a minute
birthsim study verification mutation REPORT.json    # what birthsim study mutation --out wrote
birthsim study verification coverage                # minutes
birthsim study verification accuracy FOLDER         # what birthsim study accuracy --out wrote
birthsim study verification report                  # docs/verification.md from what is stored
"""

from __future__ import annotations

import argparse
import json
import shutil
from pathlib import Path
from typing import Any

from studies.verification import balances, mutants, reached, report, sources

ACCURACY = (
    *("studies/accuracy/errors.py", "studies/accuracy/motions.py", "studies/accuracy/second_model.py"),
    *("birthsim_env/parts/drawn/randomization.py", *(path for path in balances.SOURCES if path.startswith("birthsim_env"))),
)
"""Files that decide the figures of ``birthsim study accuracy``."""


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="birthsim study verification", description="The verification report.")
    chosen = parser.add_subparsers(dest="what", required=True)
    chosen.add_parser("balances", help="measure the balances")
    chosen.add_parser("coverage", help="measure the coverage, uncompiled")
    chosen.add_parser("report", help="write docs/verification.md")
    chosen.add_parser("mutation", help="take a report of birthsim study mutation").add_argument("file", type=Path)
    chosen.add_parser("accuracy", help="take what birthsim study accuracy wrote").add_argument("folder", type=Path)
    options = parser.parse_args()
    if options.what == "balances":
        keep("balances", balances.measure(), balances.SOURCES)
    elif options.what == "coverage":
        files = [path for module in sources.load("mutation").values() for path in module["sources"]]
        keep("coverage", reached.measure(), files)
    elif options.what == "mutation":
        mutants.take(options.file)
    elif options.what == "accuracy":
        keep("accuracy", json.loads((options.folder / "accuracy.json").read_text(encoding="utf-8"))["figures"], ACCURACY)
        shutil.copy(options.folder / "accuracy.png", sources.ROOT / "docs" / "accuracy.png")
    else:
        report.PAGE.write_text(report.page(), encoding="utf-8")


def keep(name: str, content: dict[str, Any], files: tuple[str, ...] | list[str]) -> None:
    """Store a measurement with what it was measured on."""
    sources.keep(name, {**content, "commit": sources.commit(), "sources": sources.digests(files)})
