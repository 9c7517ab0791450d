"""``birthsim study mutation``: in a process that compiles nothing."""

from birthsim_env.registry import register
from lab.engine.alone import only_under
from lab.studies.mutation.uncompiled import SETTINGS


@register(study="mutation", about="how many small changes of the code tests notice")
def main() -> None:
    """Entry point."""
    only_under(SETTINGS, "lab.studies.mutation.__main__")
