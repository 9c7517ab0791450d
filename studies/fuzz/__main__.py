"""Fuzz kinds of input and print figures.

    birthsim study fuzz --kind rig --cases 5000 --seed 0

Exits with 1 where a case failed. A case is its kind, seed and number: ``--case N`` tries one alone, in this process.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path

from tqdm import tqdm

from studies.fuzz.harness import Case, Figures, fuzz, generator
from studies.fuzz.kinds import KINDS


def _one(name: str, seed: int, number: int) -> None:
    """A case alone, with its traceback."""
    with tempfile.TemporaryDirectory() as place:
        valid, folder = Path(place) / "valid", Path(place) / "case"
        valid.mkdir()
        folder.mkdir()
        case = Case()
        try:
            KINDS[name].attempt(KINDS[name].prepare(valid), generator(name, seed, number), folder, case)
        finally:
            print(case.shown, file=sys.stderr)


def main() -> None:
    """Entry point."""
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="birthsim study fuzz", description=__doc__, formatter_class=raw)
    parser.add_argument("--kind", nargs="+", choices=tuple(KINDS), default=list(KINDS), help="default: all")
    parser.add_argument("--cases", type=int, default=1000, help="of each kind (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="default: %(default)s")
    parser.add_argument("--case", type=int, help="this case alone")
    parser.add_argument("--out", type=Path, help="file for the figures, JSON")
    arguments = parser.parse_args()
    if arguments.case is not None:
        _one(arguments.kind[0], arguments.seed, arguments.case)
        return
    found: dict[str, Figures] = {}
    for name in arguments.kind:
        with tqdm(total=arguments.cases, desc=name, unit=" cases", file=sys.stderr, leave=False) as bar:
            for figures in fuzz(name, KINDS[name], arguments.cases, arguments.seed):
                found[name] = figures
                bar.update(figures.tried - bar.n)
    print(f"{'kind':18}{'cases':>8}{'valid':>8}{'refused':>9}{'failures':>10}")
    for name, figures in found.items():
        print(f"{name:18}{figures.tried:8}{figures.valid:8}{figures.refused:9}{len(figures.failures):10}")
    for name, figures in found.items():
        for signature, count, number, words in figures.signatures():
            print(f"\n{name}: {count} x {signature}; case {number}:\n  {words[:400]!r}")
    if arguments.out is not None:
        table = {
            name: {"cases": one.tried, "valid": one.valid, "refused": one.refused, "failures": len(one.failures)}
            for name, one in found.items()
        }
        arguments.out.write_text(json.dumps({"seed": arguments.seed, "kinds": table}, indent=1), encoding="utf-8")
    if any(figures.failures for figures in found.values()):
        raise SystemExit(1)


if __name__ == "__main__":
    main()
