"""``birthsim study mutation``: in a process that compiles nothing."""

from studies.alone import only_under
from studies.mutation.uncompiled import SETTINGS


def main() -> None:
    """Entry point."""
    only_under(SETTINGS, "studies.mutation.__main__")
