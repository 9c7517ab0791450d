"""``birthsim study mutation``: in a process that compiles nothing."""

from __future__ import annotations

from studies.alone import begin
from studies.mutation.uncompiled import SETTINGS


def main() -> None:
    """Entry point."""
    begin("studies.mutation.__main__", SETTINGS)
