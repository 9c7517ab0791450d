"""The one registry: whatever has a name that a user may type registers itself, in its own file.

    @register(controller="adrc", about="Active disturbance rejection.", needs={"force sensor"})
    class ADRC(StagedController): ...

A kind has rooms, packages whose modules are imported when somebody first asks for that kind; so a file that stands in a room is
found, and nothing else names it. Another distribution adds entries by an entry point of the group ``birthsim.plugins``, which
names a module that registers. Help, tests, tables of the documentation and lists of the page iterate ``entries``.
"""

import pkgutil
import sys
import threading
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from importlib.abc import InspectLoader
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

from birthsim_env.physics.rig.values import near, problem, shown

T = TypeVar("T")

ROOMS: dict[str, tuple[str, ...]] = {
    "controller": (
        "baselines.backstepping", "baselines.admittance", "baselines.rivals", "baselines.uncontrolled", "agents.policy.shipped",
    ),
    "sensors": ("birthsim_env.parts.sensors",),
    "scenario": ("birthsim_env.parts.scenarios",),
    "hand": ("birthsim_env.parts.hands",),
    "friction": ("birthsim_env.parts.drawn.frictions",),
    "policy": ("agents.policy.shipped",),
    "algorithm": ("agents.training.algorithms",),
    "reader": ("birthsim_env.tables.readers",),
    "export": ("birthsim.exports",),
    "device": ("birthsim_env.episodes", "birthsim_build.device.episodes"),
    "driver": ("birthsim_drive.drivers",),
    "study": ("lab.studies",),
}  # fmt: skip
"""Kind -> packages, or modules, in which entries of that kind stand. A room that is not installed is empty."""

ROOT = Path(__file__).resolve().parents[1]
"""Where BirthSIM's packages stand side by side."""

PLUGINS = "birthsim.plugins"
"""Entry point group of other distributions' modules."""

LAST = 1000
"""``order`` of an entry that says none."""


@dataclass(frozen=True)
class Entry:
    """One registered thing.

    Parameters
    ----------
    kind, name : str
        What it is, one of ``ROOMS``, and what a user types.
    made : object
        What was registered: a class, a function, or an object.
    about : str
        What it is, in a sentence.
    needs : frozenset of str
        What it cannot do without, such as ``"force sensor"``, ``"acceleration sensor"``, or an extra, ``"extra agents"``.
    listed : bool
        Whether lists show it that do not show everything: scores, the page, the comparison.
    options : mapping
        What ``made`` is called with, where the entry is another one with options.
    deprecated : str
        What takes its place; "" where it stays.
    order : int
        Where lists show it; equal ones stand in alphabetical order.
    module : str
        Where it is registered.
    """

    kind: str
    name: str
    made: Any
    about: str
    needs: frozenset[str] = frozenset()
    listed: bool = True
    options: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))
    deprecated: str = ""
    order: int = LAST
    module: str = ""


_ENTRIES: dict[str, dict[str, Entry]] = {kind: {} for kind in ROOMS}
_ENTERED: set[str] = set()
_BROKEN: dict[str, str] = {}
_ENTERING = threading.RLock()
_RECORDS: list[set[tuple[str, str]]] = []
_FOLLOWED: dict[str, list[Callable[[Entry], None]]] = {kind: [] for kind in ROOMS}


def register(
    *,
    about: str,
    needs: Iterable[str] = (),
    listed: bool = True,
    options: Mapping[str, Any] | None = None,
    deprecated: str = "",
    order: int = LAST,
    **named: str,
) -> Callable[[T], T]:
    """Decorate what a user may ask for by a name: a controller, a sensor model, a scenario, a hand and others.

    Parameters
    ----------
    about : str
        What it is, in a sentence.
    needs : iterable of str
        What it cannot do without: ``"force sensor"``, ``"acceleration sensor"``, or an extra, as ``"extra agents"``.
    listed : bool
        Whether lists show it that do not show everything: scores, the page, the comparison.
    options : mapping, optional
        What it is called with, where it is another entry with options.
    deprecated : str
        What takes its place; "" where it stays.
    order : int
        Where lists show it; equal ones stand in alphabetical order.
    **named : str
        One kind and the name, ``controller="adrc"``; a kind is one of ``ROOMS``.

    Returns
    -------
    callable
        A decorator, which returns what it stands above as it is.

    Raises
    ------
    ValueError
        For no kind of ``ROOMS``, more than one, or a name that is taken, or ``needs`` that are one text.

    Notes
    -----
    The module must be imported before the name is used. Another distribution names it in an entry point of the group
    ``birthsim.plugins``. A file that is given by its path registers nothing: a user types the path.

    Examples
    --------
    >>> import numpy as np, birthsim
    >>> @birthsim.register(controller="half-open", about="Valves that stay half open.", listed=False)
    ... class HalfOpen:
    ...     def __init__(self, parameters):
    ...         self.parameters = parameters
    ...     def command(self, measurement, reference):
    ...         return np.full((4, *measurement.time.shape), 0.5)
    ...     def reset(self, lanes=None):
    ...         pass
    >>> type(birthsim.make_controller("half-open")).__name__
    'HalfOpen'
    """
    if len(named) != 1 or not set(named) <= set(ROOMS):
        raise ValueError(f"register({', '.join(named)}); allowed: one of {', '.join(ROOMS)}")
    if isinstance(needs, str):
        raise ValueError(f"needs = {shown(needs)}; allowed: a set, as {{{shown(needs)}}}")
    ((kind, name),) = named.items()

    def keep(made: T) -> T:
        where, there = str(sys._getframe(1).f_globals["__name__"]), _ENTRIES[kind].get(name)
        if not all(part.isidentifier() for part in where.split(".")):
            return made  # in a file that is given by its path, which is what a user types
        # A module that is loaded again makes its classes anew, and registers these.
        if there is not None and (there.module != where or there.made is made or _called(there.made) != _called(made)):
            raise ValueError(f"{kind} = {shown(name)} is registered by {there.module}; allowed in {where}: another name")
        preset = MappingProxyType(dict(options or {}))
        one = Entry(kind, name, made, about, frozenset(needs), listed, preset, deprecated, order, where)
        _ENTRIES[kind][name] = one
        for do in _FOLLOWED.get(kind, ()):
            do(one)
        return made

    return keep


def _called(made: Any) -> str:
    """The name of what is registered, or of its type."""
    return str(getattr(made, "__qualname__", type(made).__qualname__))


def _enter(kind: str) -> None:
    """Import the rooms of a kind, and other distributions' modules; once, whichever thread asks first."""
    with _ENTERING:
        if kind in _ENTERED:
            return
        _ENTERED.add(kind)
        try:
            for room in ROOMS[kind]:
                _enter_room(room, kind)
        except BaseException:
            _ENTERED.discard(kind)
            raise
        for point in entry_points(group=PLUGINS):
            if (plugin := f"{PLUGINS}: {point.value}") not in _ENTERED:
                _ENTERED.add(plugin)
                try:
                    point.load()
                except Exception as error:
                    _BROKEN[point.name] = problem(error)
                    warnings.warn(f"plugin {point.name!r} is left out: {problem(error)}", stacklevel=4)


def _enter_room(room: str, kind: str) -> None:
    """Import what registers in a room, where that is installed and no package of another owner is in its place."""
    top = room.partition(".")[0]
    found = find_spec(top)
    places = [] if found is None else [Path(one) for one in found.submodule_search_locations or ()]
    if places and ROOT / top not in places:
        _BROKEN[top] = f"the package at {places[0]} is not BirthSIM's"
    if ROOT / top not in places or find_spec(room) is None:
        return
    package = import_module(room)
    for module in pkgutil.walk_packages(getattr(package, "__path__", []), f"{room}."):
        spec = find_spec(module.name)
        text = spec.loader.get_source(module.name) if spec is not None and isinstance(spec.loader, InspectLoader) else None
        if text is not None and "register(" in text and f"{kind}=" in text:
            import_module(module.name)


@contextmanager
def used() -> Iterator[set[tuple[str, str]]]:
    """A context in which every entry is noted that ``entry`` gives, in any thread: a set of (kind, name).

    Lists of entries do not count: what goes over all of a kind uses those that it takes up by name.
    """
    asked: set[tuple[str, str]] = set()
    _RECORDS.append(asked)
    try:
        yield asked
    finally:
        _RECORDS[:] = [one for one in _RECORDS if one is not asked]


def entries(kind: str, listed: bool | None = None) -> list[Entry]:
    """Everything of a kind, in the order in which lists show it; with ``listed`` those that are, or are not."""
    _enter(kind)
    found = (one for one in _ENTRIES[kind].values() if listed is None or one.listed is listed)
    return sorted(found, key=lambda one: (one.order, one.name))


def follow(kind: str, do: Callable[[Entry], None]) -> None:
    """Call ``do`` for every entry of a kind, also for one that is registered later."""
    for one in entries(kind):
        do(one)
    _FOLLOWED[kind].append(do)


def names(kind: str, listed: bool | None = None) -> list[str]:
    """The names of ``entries``."""
    return [one.name for one in entries(kind, listed)]


def entry(kind: str, name: Any, more: str = "") -> Entry:
    """The entry of a name; ``used`` takes note of it. One that is deprecated warns of what takes its place.

    Raises
    ------
    ValueError
        Names what is unknown, what it is near to, and what there is; ``more`` adds what else is allowed.
    """
    if not isinstance(name, str) or name not in _ENTRIES[kind]:
        _enter(kind)  # only now: what is known already needs none of the rooms that are slow to import
    found = _ENTRIES[kind].get(name) if isinstance(name, str) else None
    if found is not None:
        for record in _RECORDS:
            record.add((kind, name))
        if found.deprecated:
            warnings.warn(
                f"{kind} = {name!r} is deprecated; {found.deprecated} takes its place", DeprecationWarning, stacklevel=2
            )
        return found
    known = names(kind)
    asked = near(name, known) if isinstance(name, str) else ""
    allowed = "a registered name" if asked else ", ".join(known)
    broken = "".join(f"; {one!r} is left out: {why}" for one, why in _BROKEN.items())
    raise ValueError(f"{kind} = {shown(name)}{asked}; allowed: {allowed}{more}{broken}")
