"""The state of an environment as a flat dictionary of arrays: given back to an equal one, what follows is the same to the bit.

Everything that the parts of an environment keep in their attributes is taken: arrays, NumPy's generators, numbers, text, None,
and lists, tuples, dictionaries and objects of these. What pickling a part leaves out is left out here too, and so is what its
class leaves out of ``in_state``; functions, classes and frozen dataclasses are constants. Nothing in the dictionary can run.

Restored numbers reach compiled code, which does not look whether an index is within its array. All of them are checked
(``birthsim_env.restored``) before anything changes.
"""

import json
from dataclasses import dataclass
from enum import Enum
from pathlib import PurePath
from types import FunctionType, ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.stage import Stage, Staged
from birthsim_env.parts.actuation import Actuation
from birthsim_env.physics.rig.json_reading import parse_json
from birthsim_env.physics.rig.values import in_line
from birthsim_env.restored import (
    FLOATS,
    Kept,
    constant_complaint,
    declared,
    generator_complaint,
    is_own,
    own_complaint,
)

State = dict[str, NDArray[Any]]

BROKEN = (KeyError, AttributeError, TypeError, ValueError, IndexError, OverflowError, RecursionError, MemoryError)
"""What reading a state raises that is none."""

PLAIN = "plain"
"""Entry of a state for all that is no array: JSON, in bytes."""

ALLOWED = "numbers, text, None, arrays, np.random.Generator, and lists, tuples, dicts and objects of these"


def take_state(parts: dict[str, Any]) -> State:
    """Copies of all that ``parts`` keep, by name; ``ValueError`` for a part that keeps something of another kind."""
    arrays: State = {}
    plain: dict[str, Any] = {}
    for name, entry in _Walk(parts).found.items():
        value = entry.value
        if isinstance(value, (np.ndarray, np.generic)):
            arrays[name] = np.array(value)
        else:
            plain[name] = _to_json(value.bit_generator.state if isinstance(value, np.random.Generator) else value)
    return {**arrays, PLAIN: np.frombuffer(json.dumps(plain).encode(), dtype=np.uint8).copy()}


def give_state(parts: dict[str, Any], state: State) -> None:
    """Give ``parts`` back what ``take_state`` returned; arrays are filled in place where their shape stays.

    Raises ``ValueError`` for what is no state of them, before anything has changed.
    """
    walk, given = _Walk(parts), _decoded(state)
    given = {name: value for name, value in given.items() if name not in walk.left_out}
    for name, entry in walk.found.items():
        if name not in given and entry.value is not None:
            raise _foreign(f"{name!r} is missing")
    entries = {name: walk.entry(name) for name in given}
    for name, entry in entries.items():
        if complaint := entry.complaint(given[name], given):
            raise _foreign(f"{name!r} {complaint}")
    for name, entry in entries.items():
        entry.put(given[name])


def plain_value(state: State, name: str) -> Any:
    """What a state says of ``name``, which is no array; None where it says nothing, or is none."""
    try:
        return _from_json(parse_json("state", state[PLAIN].tobytes(), dict, finite=False)[name])
    except BROKEN:
        return None


@dataclass(frozen=True)
class _Owner:
    """The object whose attribute something is, at the name ``place``; None for what the environment itself keeps."""

    place: str
    of: Any

    @property
    def is_own(self) -> bool:
        """Whether it is the package's."""
        return self.of is None or is_own(type(self.of))


@dataclass(frozen=True)
class _Entry:
    """Where something is kept: in ``content`` under ``key``, for an ``attribute`` of its ``owner``."""

    content: Any
    key: Any
    owner: _Owner
    kept: Kept | None
    constant: bool = False

    @property
    def value(self) -> Any:
        return self.content.get(self.key) if isinstance(self.content, dict) else self.content[self.key]

    def complaint(self, value: Any, given: dict[str, Any]) -> str:
        """Why it may not become ``value`` where ``given`` are all values by name, or nothing."""
        before = self.value
        if isinstance(before, np.random.Generator):
            return generator_complaint(before, value)
        if self.kept is not None and not self.constant:
            most = self.kept.most
            if isinstance(most, str):
                counted = given.get(f"{self.owner.place}.{most}", getattr(self.owner.of, most))
                most = len(counted) - self.kept.index if np.ndim(counted) else 0
            return self.kept.complaint(before, value, most)
        if not self.owner.is_own and not self.constant:
            return own_complaint(before, value, _has_stage(self.owner.of))
        if isinstance(before, np.ndarray) and before.dtype.kind in "fb" and not self.constant:
            return FLOATS.complaint(before, value, np.inf)
        return constant_complaint(before, value)

    def put(self, value: Any) -> None:
        before = self.value
        if isinstance(before, np.random.Generator):
            before.bit_generator.state = value
        elif isinstance(before, np.ndarray) and isinstance(value, np.ndarray) and before.shape == value.shape:
            before[...] = value
        else:
            self.content[self.key] = value[()] if isinstance(before, np.generic) else value


def _has_stage(part: Any) -> bool:
    """Whether machine code works on the arrays of a part."""
    if isinstance(part, Staged):
        return type(part).stage is not Staged.stage
    return hasattr(part, "stages") and getattr(type(part), "stages", None) is not Actuation.stages


class _Walk:
    """All that nested parts keep: ``found`` are entries by name, and ``left_out`` the names that are no part of a state."""

    def __init__(self, parts: dict[str, Any]) -> None:
        self.found: dict[str, _Entry] = {}
        self.left_out: set[str] = set()
        self._holders: dict[str, tuple[Any, _Owner]] = {}
        self._met: set[int] = set()
        self._constants: set[int] = set()
        self._inside("", parts, _Owner("", None))
        for name, entry in self.found.items():
            if id(entry.value) in self._constants:
                self.found[name] = _Entry(entry.content, entry.key, entry.owner, None, constant=True)

    def entry(self, name: str) -> _Entry:
        """The entry of this name, also one that a user's part makes when it is first used; ``ValueError`` for a foreign one."""
        if name in self.found:
            return self.found[name]
        place, _, key = name.rpartition(".")
        content, owner = self._holders.get(place, (None, _Owner("", None)))
        if owner.is_own or not isinstance(content, dict) or (place == owner.place and not _may_be_made(type(owner.of), key)):
            raise _foreign(f"{in_line(repr(name))} is unknown")
        return _Entry(content, key, owner, None)

    def _inside(self, place: str, content: Any, owner: _Owner, kept: Kept | None = None) -> None:
        self._holders[place] = content, owner
        rules = declared(type(owner.of)) if place == owner.place else {}
        # In the order of names: that in which attributes were made may differ.
        pairs = sorted(content.items(), key=lambda pair: str(pair[0])) if isinstance(content, dict) else enumerate(content)
        for key, value in pairs:
            name = f"{place}.{key}" if place else str(key)
            # A number in a tuple cannot become another.
            fixed = isinstance(content, tuple) and (_is_plain(value) or isinstance(value, np.generic))
            if name not in self.left_out and not fixed:
                self._visit(name, _Entry(content, key, owner, rules.get(str(key)) or kept), value)

    def _visit(self, name: str, entry: _Entry, value: Any) -> None:
        if _is_plain(value) or isinstance(value, np.generic):
            self.found[name] = entry
        elif id(value) not in self._met and not _is_constant(value):
            self._met.add(id(value))
            if isinstance(value, (np.ndarray, np.random.Generator)):
                self.found[name] = entry
            elif isinstance(value, (dict, list, tuple)):
                self._inside(name, value, entry.owner, entry.kept)
            elif _has_attributes(value) and isinstance(kept := value.__getstate__() or {}, dict):
                own = vars(value)
                self.left_out |= {f"{name}.{one}" for one in own if kept.get(one, self) is not own[one]}
                self.left_out |= {f"{name}.{one}" for one, rule in declared(type(value)).items() if rule is None}
                if isinstance(value, Stage):
                    self._constants.add(id(value.constants))
                self._inside(name, own, _Owner(name, value))
            else:
                raise ValueError(f"{name} is a {type(value).__name__}; allowed in a state: {ALLOWED}")


def _may_be_made(kind: type, key: str) -> bool:
    """Whether an attribute of a user's object may be new: not one that would hide a method or something of Python's."""
    hidden = getattr(kind, key, None)
    return key.isidentifier() and not key.startswith("__") and not callable(hidden) and not hasattr(type(hidden), "__set__")


def _is_plain(value: Any) -> bool:
    """Whether JSON can have it, or a tuple instead of a list."""
    if isinstance(value, (list, tuple)):
        return type(value) in (list, tuple) and all(map(_is_plain, value))
    if isinstance(value, dict):
        return type(value) is dict and all(type(key) is str and _is_plain(one) for key, one in value.items())
    return value is None or type(value) in (bool, int, float, str)


def _is_constant(value: Any) -> bool:
    if isinstance(value, (type, ModuleType, FunctionType, PurePath, Enum, bytes, range, frozenset)):
        return True
    parameters: Any = getattr(value, "__dataclass_params__", None)
    if parameters is not None and parameters.frozen:
        return True
    return callable(value) and not _has_attributes(value)


def _has_attributes(value: Any) -> bool:
    """Whether what an object keeps is in its attributes."""
    kind: Any = type(value)
    return kind.__reduce__ is object.__reduce__ and hasattr(value, "__dict__")


def _to_json(value: Any) -> Any:
    if isinstance(value, tuple):
        return {"tuple": [_to_json(one) for one in value]}
    if isinstance(value, dict):
        return {"dict": {key: _to_json(one) for key, one in value.items()}}
    if isinstance(value, np.ndarray):  # the table of a generator
        return {"words": value.tolist()}
    return [_to_json(one) for one in value] if isinstance(value, list) else value


def _from_json(value: Any) -> Any:
    if isinstance(value, dict):
        ((kind, inside),) = value.items()
        if kind == "words":
            return np.array(inside, dtype=np.uint64)
        return tuple(map(_from_json, inside)) if kind == "tuple" else {key: _from_json(one) for key, one in inside.items()}
    return [_from_json(one) for one in value] if isinstance(value, list) else value


def _decoded(state: State) -> dict[str, Any]:
    try:
        plain = parse_json("state", state[PLAIN].tobytes(), dict, finite=False)
        arrays = {str(name): np.array(value) for name, value in state.items() if name != PLAIN}
        values = {name: _from_json(value) for name, value in plain.items()}
    except BROKEN as error:
        raise _foreign(f"{PLAIN!r} is missing or damaged") from error
    twice = sorted(arrays.keys() & values.keys())
    if twice:
        raise _foreign(f"{in_line(repr(twice[0]))} is there twice")
    return {**arrays, **values}


def _foreign(why: str) -> ValueError:
    return ValueError(
        f"state is of another environment: {why}; allowed: what get_state() of one made with the same arguments returned"
    )
