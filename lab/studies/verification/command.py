"""``birthsim study verification``: measurements and page of the verification report."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from birthsim.command_line.settings import Configured
from birthsim_env.registry import register
from lab.studies.verification import balances, mutants, reached, report, sources


@dataclass(kw_only=False)
class Settings(Configured):
    """Measure the balances (a quarter of a minute) or the coverage (minutes), take what birthsim study mutation wrote, or write
    docs/verification.md from what is stored.
    """

    what: Literal["balances", "coverage", "mutation", "report"]
    path: Path = Path()
    """For mutation its report."""


@register(study="verification", about="balances, coverage, mutation, for docs/verification.md")
def main(options: Settings) -> None:
    """Measure, take or write."""
    if options.what == "balances":
        keep("balances", balances.measure(), balances.SOURCES)
    elif options.what == "coverage":
        files = [path for module in sources.load("mutation").values() for path in module["sources"]]
        keep("coverage", reached.measure(), files)
    elif options.what == "mutation":
        mutants.take(options.path)
    else:
        report.PAGE.write_text(report.page(), encoding="utf-8")


def keep(name: str, content: dict[str, Any], files: tuple[str, ...] | list[str]) -> None:
    """Store a measurement with what it was measured on."""
    sources.keep(name, {**content, "commit": sources.commit(), "sources": sources.digests(files)})
