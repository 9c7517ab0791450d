"""``birthsim study fuzz``: one thread, since children are forked, and no window."""

from __future__ import annotations

from studies.alone import ONE_THREAD, begin


def main() -> None:
    """Entry point."""
    begin("studies.fuzz.__main__", {"SDL_VIDEODRIVER": "dummy", **ONE_THREAD})
