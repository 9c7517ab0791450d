"""Packages of other distributions in the way of BirthSIM's: ``baselines`` and ``agents`` are names that others have too."""

from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
"""Where all packages of BirthSIM stand beside each other."""

NAMES = ("baselines", "agents")
"""Packages of ours whose names others have: OpenAI's baselines, openai-agents, folders of users."""

MARK = "BELONGS_TO_BIRTHSIM"
"""Stands in the ``__init__.py`` of each of them; another distribution may have been installed over it."""

MEND = "rename or uninstall it, then pip install --force-reinstall --no-deps -e . in a clone"
"""What gives BirthSIM its package back."""


def shadows() -> dict[str, str]:
    """Name of a package -> where one lies that is imported in place of BirthSIM's; nothing of it is run."""
    found = {name: _place(name) for name in NAMES}
    return {name: place for name, place in found.items() if place is not None}


def check_shadows() -> None:
    """Raises ``ImportError`` where another package is imported in place of one of BirthSIM's."""
    for name, place in shadows().items():
        raise ImportError(f"the package {name!r} at {place} is not BirthSIM's but hides or overwrites it; {MEND}")


def _place(name: str) -> str | None:
    """Where a package lies that is not BirthSIM's; None where it is."""
    spec, own = find_spec(name), ROOT / name / "__init__.py"
    if spec is None:
        return None  # which the import will say
    if spec.origin is None:
        return ", ".join(spec.submodule_search_locations or ())
    found = Path(spec.origin)
    ours = found.resolve() == own.resolve() and MARK in found.read_text(encoding="utf-8")
    return None if ours else str(found.parent)
