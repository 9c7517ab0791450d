"""Kills commands at random moments and says what that leaves: ``python -m lab.studies.kills --target evaluate --kills 10``."""

import argparse
import shutil
import tempfile
from pathlib import Path

import numpy as np

from lab.studies.kills.processes import end_all, hear_signals
from lab.studies.kills.report import read_outcomes, summary, write_outcomes, write_page
from lab.studies.kills.targets import ROOT, TARGETS
from lab.studies.kills.tries import SCENARIOS, Course

PAGE = ROOT / "docs" / "kills.md"


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="python -m lab.studies.kills", description=__doc__)
    names = tuple(TARGETS)
    parser.add_argument("--target", action="append", choices=names, help="may be repeated (default: all)")
    parser.add_argument("--scenario", action="append", choices=tuple(SCENARIOS), help="may be repeated (default: all)")
    parser.add_argument("--kills", type=int, default=50, help="per target, over all scenarios (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of the moments (default: %(default)s)")
    parser.add_argument("--out", type=Path, help="JSON file to write; what it holds of other targets and seeds stays")
    parser.add_argument("--page", nargs="?", type=Path, const=PAGE, help="write the table from --out (default: docs/kills.md)")
    arguments = parser.parse_args()
    hear_signals()
    scenarios, outcomes = arguments.scenario or tuple(SCENARIOS), []
    for name in arguments.target or names:
        if missing := TARGETS[name].missing():
            print(f"{name}: left out, since {' and '.join(missing)} is not installed", flush=True)
            continue
        rng = np.random.default_rng([arguments.seed, names.index(name)])
        work = Path(tempfile.mkdtemp(prefix=f"kills-{name}-"))
        try:
            course = Course(TARGETS[name], work, rng)
            done = dict.fromkeys(scenarios, 0)
            while sum(done.values()) < arguments.kills:
                scenario = min(done, key=lambda name: done[name] / SCENARIOS[name])
                outcomes.append(course.attempt(scenario))
                done[scenario] += outcomes[-1].count
                print(summary(outcomes[-1]), flush=True)
                if arguments.out is not None:
                    write_outcomes(arguments.out, outcomes, arguments.seed)
        finally:
            end_all()
            shutil.rmtree(work, ignore_errors=True)
    if arguments.page is not None and arguments.out is not None:
        write_page(arguments.page, read_outcomes(arguments.out))


if __name__ == "__main__":
    main()
