"""``birthsim study fuzz``: kinds of input are fuzzed and figures printed.

It exits with 1 where a case failed. A case is its kind, seed and number.
"""

import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter
from tqdm import tqdm

from baselines.work.side_by_side import ONE_THREAD
from birthsim.command_line.settings import MANY, Configured, Seed, whole
from birthsim_env.files import write_json
from birthsim_env.registry import register
from lab.engine.alone import only_under
from lab.studies.fuzz.harness import Case, Figures, fuzz, generator
from lab.studies.fuzz.kinds import KINDS


@dataclass(kw_only=True)
class Settings(Configured):
    """Fuzz everything that is read or called: a valid object or a clear error, within limits."""

    kind: Annotated[list[str], MANY, Parameter(choices=tuple(KINDS), metavar="KIND...")] = field(default_factory=list)
    """Kinds of input, else all."""
    cases: Annotated[int, whole()] = 1000
    """Of each kind."""
    seed: Seed = 0
    case: Annotated[int | None, whole(0)] = None
    """This case of the first kind alone, in this process, with its traceback."""
    out: Path | None = None
    """File for the figures, JSON."""


@register(study="fuzz", about="odd input to everything that is read or called")
def main(settings: Settings) -> None:
    """Fuzz on one thread, since children are forked, and without a window."""
    only_under({"SDL_VIDEODRIVER": "dummy", **ONE_THREAD})
    kinds = settings.kind or list(KINDS)
    if settings.case is not None:
        _one(kinds[0], settings.seed, settings.case)
        return
    found: dict[str, Figures] = {}
    for name in kinds:
        with tqdm(total=settings.cases, desc=name, unit=" cases", file=sys.stderr, leave=False) as bar:
            for figures in fuzz(name, KINDS[name], settings.cases, settings.seed):
                found[name] = figures
                bar.update(figures.tried - bar.n)
    print(f"{'kind':18}{'cases':>8}{'valid':>8}{'refused':>9}{'failures':>10}")
    for name, figures in found.items():
        print(f"{name:18}{figures.tried:8}{figures.valid:8}{figures.refused:9}{len(figures.failures):10}")
    for name, figures in found.items():
        for signature, count, number, words in figures.signatures():
            print(f"\n{name}: {count} x {signature}; case {number}:\n  {words[:400]!r}")
    if settings.out is not None:
        table = {
            name: {"cases": one.tried, "valid": one.valid, "refused": one.refused, "failures": len(one.failures)}
            for name, one in found.items()
        }
        write_json(settings.out, {"seed": settings.seed, "kinds": table})
    if any(figures.failures for figures in found.values()):
        raise SystemExit(1)


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
