"""``birthsim study mutation``: in a process that compiles nothing."""

from lab.studies.alone import only_under
from lab.studies.mutation.uncompiled import SETTINGS


def main() -> None:
    """Entry point."""
    only_under(SETTINGS, "lab.studies.mutation.__main__")
