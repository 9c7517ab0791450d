"""Which entries of the registry this process, and the pieces of work that it took up, have asked for."""

from collections.abc import Mapping
from contextlib import ExitStack

from birthsim_env.registry import entries, used

_NOTES = ExitStack()
_ASKED = _NOTES.enter_context(used())
"""From now to the end of the process: whoever looked something up once may keep it, and use it again and again."""

_ELSEWHERE: dict[str, str] = {}


def asked() -> dict[str, str]:
    """The entries, as "kind=name", sorted, and the modules that register them; a study is no part of what it measures."""
    here = registered(*{kind for kind, _ in _ASKED if kind != "study"})
    found = {entry: here[entry] for kind, name in _ASKED if (entry := f"{kind}={name}") in here}
    return dict(sorted((found | _ELSEWHERE).items()))


def registered(*kinds: str) -> dict[str, str]:
    """All entries of some kinds, which whoever goes over all of them asks for."""
    return {f"{kind}={one.name}": one.module for kind in kinds for one in entries(kind)}


def note(asked: Mapping[str, str]) -> None:
    """Add what another process asked for."""
    _ELSEWHERE.update(asked)
