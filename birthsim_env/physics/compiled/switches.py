"""Environment variables that switch something on or off."""

import os


def switched(name: str, usual: bool, on: str, off: str) -> bool:
    """Whether ``name`` is 1, ``on``, or 0, ``off``; where it is not set, what is ``usual``. ``ValueError`` for another word."""
    asked = os.environ.get(name) or f"{usual:d}"
    if asked not in ("0", "1"):
        raise ValueError(f"{name} = {asked!r}; allowed: 1 for {on}, 0 for {off}")
    return asked == "1"
