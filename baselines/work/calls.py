"""What functions call: this project's definitions that they reach, directly or not, and those of entries they asked for.

Names are followed through imports, attributes of modules, late imports, decorators, bases and default values; a class counts
whole, and what finds environments by id reaches what registers ids. Nothing is run. What no name leads to is not seen: an
attribute made from a string, or what another process runs. An entry of the registry is asked for while a function runs, which
``baselines.work.asked`` notes.
"""

from collections.abc import Callable, Iterable, Mapping
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from baselines.work.definitions import MAKES, ON_IMPORT, REGISTERS, definitions
from birthsim_env.physics.compiled import sources

UNDECIDING = (
    "birthsim_env/registry.py", "birthsim_env/files.py", "birthsim_env/partials.py", "birthsim_env/physics/rig/json_reading.py",
    "birthsim_env/physics/rig/schema.py", "birthsim_env/physics/compiled/sources.py", "birthsim_env/physics/compiled/kept.py",
    "birthsim_env/drawing/", "baselines/work/", "baselines/figures/", "baselines/about.py", "lab/engine/",
)  # fmt: skip
"""What finds entries, reads and writes files, shares out work, describes and draws. It decides nothing, and is not followed."""


class Place(NamedTuple):
    """Where a definition stands: its file, from the root, and its name."""

    file: str
    name: str

    def __str__(self) -> str:
        return f"{self.file}:{self.name}"


def names_of(function: Any) -> set[str]:
    """A function as "module:name", or of a partial one itself and the functions that it is given."""
    if isinstance(function, partial):
        given = [one for one in (*function.args, *function.keywords.values()) if callable(one)]
        return set().union(*map(names_of, (function.func, *given)))
    named = function if hasattr(function, "__qualname__") else type(function)
    return {f"{named.__module__}:{named.__qualname__.partition('.')[0]}"}


def called_by(functions: Iterable[Callable[..., Any]], used: Mapping[str, str] = MappingProxyType({})) -> dict[str, str]:
    """Every definition that functions and entries of the registry reach, with a hash of its code and of where its names lead.

    Parameters
    ----------
    functions
        What is called; of a partial one the functions that it is given, too.
    used
        Entries, as "kind=name", and the modules that register them.

    Returns
    -------
    dict
        "path/to/file.py:name" -> hash.
    """
    return _reached(frozenset().union(*map(names_of, functions)), tuple(sorted(used.items())))


@cache
def _reached(roots: frozenset[str], used: tuple[tuple[str, str], ...]) -> dict[str, str]:
    waiting = {place for root in roots for place in _named(root)} | {place for entry in used for place in _entered(*entry)}
    seen = set(waiting)
    found: dict[str, str] = {}
    while waiting:
        place = waiting.pop()
        one = definitions(sources.ROOT / place.file).defined[place.name]
        next_ones = _next(place)
        found[str(place)] = sha256("\n".join([one.code, *sorted(map(str, next_ones))]).encode()).hexdigest()
        waiting |= next_ones - seen
        seen |= next_ones
    return dict(sorted(found.items()))


@cache
def _next(place: Place) -> frozenset[Place]:
    """What a definition refers to, and what its file runs on import."""
    known = definitions(sources.ROOT / place.file).defined
    found = set(_referred(place)) | {Place(place.file, name) for name in known if name == ON_IMPORT}
    # What a later package has under a name, or registers, those who use it import.
    packages = sources.PACKAGES[: sources.PACKAGES.index(place.file.partition("/")[0]) + 1]
    for name in known[place.name].named:
        found |= _named(name) if name.partition(".")[0] in packages else frozenset()
    if MAKES in _others(place):
        found |= {one for one in _registering() if one.file.partition("/")[0] in packages}
    return frozenset(found - {place})


@cache
def _referred(place: Place) -> frozenset[Place]:
    """Where the names lead that stand in a definition."""
    one = definitions(sources.ROOT / place.file).defined[place.name]
    found = {Place(place.file, name) for name in one.own}
    return frozenset(found.union(*(_resolved(name) for name in one.others if name not in (MAKES, REGISTERS))))


def _named(name: str) -> frozenset[Place]:
    """The place of "module:name", or of all that a module defines."""
    module, _, definition = name.partition(":")
    return _resolved(f"{module}.{definition}" if definition else module)


@cache
def _resolved(name: str) -> frozenset[Place]:
    """Where a dotted name leads. A module itself, its file, and a name that nothing there gives a value, lead to all of it."""
    words = name.split(".")
    for count in range(len(words), 0, -1):
        if path := sources.file_of(".".join(words[:count])):
            break
    else:
        return frozenset()
    file, rest = _file(path), words[count:]
    if file.startswith(UNDECIDING):
        return frozenset()
    known = definitions(path)
    if rest and rest[0] in known.defined:
        return frozenset({Place(file, rest[0])})
    if rest and rest[0] in known.imported:
        return _resolved(".".join([known.imported[rest[0]], *rest[1:]]))
    if rest and rest[0] in ("__name__", "__doc__", ON_IMPORT):
        return frozenset()
    return frozenset(Place(file, one) for one in known.defined)


def _entered(entry: str, module: str) -> frozenset[Place]:
    """The definition that registers an entry, or, where no literal says which, all of its module."""
    if path := sources.file_of(module):
        known = definitions(path)
        for name in (entry, f"{entry.partition('=')[0]}=*"):
            if name in known.entries:
                return frozenset({Place(_file(path), known.entries[name])})
    return _resolved(module)


@cache
def _registering() -> frozenset[Place]:
    """The definitions that register ids of environments, and those that call them."""
    files = sources.files_of(*sources.PACKAGES[:-1])
    found, words = set[Place](), {b"gymnasium"}
    while words:
        naming = [path for path in files if any(word in path.read_bytes() for word in words)]
        every = {
            Place(path.relative_to(sources.ROOT).as_posix(), name) for path in naming for name in definitions(path).defined
        }
        new = {one for one in every - found if REGISTERS in _others(one) or not found.isdisjoint(_referred(one))}
        found |= new
        words = {one.name.encode() for one in new}
    return frozenset(found)


def _others(place: Place) -> list[str]:
    return definitions(sources.ROOT / place.file).defined[place.name].others


def _file(path: Path) -> str:
    return path.relative_to(sources.ROOT).as_posix()
