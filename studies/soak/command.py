"""``birthsim study soak``: on one thread."""

from __future__ import annotations

from studies.alone import ONE_THREAD, begin


def main() -> None:
    """Entry point."""
    begin("studies.soak.__main__", ONE_THREAD)
