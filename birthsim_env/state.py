"""The state of an environment as a flat dictionary of arrays: given back to an equal one, what follows is the same to the bit.

Everything that the parts of an environment keep in their attributes is taken: arrays, NumPy's generators, numbers, text, None,
and lists, tuples, dictionaries and objects of these. What pickling a part leaves out is left out here too; functions, classes
and frozen dataclasses are constants. Nothing in the dictionary can run.
"""

import json
from enum import Enum
from pathlib import PurePath
from types import FunctionType, ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.physics.rig.json_reading import parse_json

State = dict[str, NDArray[Any]]

PLAIN = "plain"
"""Entry of a state for all that is no array: JSON, in bytes."""

ALLOWED = "numbers, text, None, arrays, np.random.Generator, and lists, tuples, dicts and objects of these"


def take_state(parts: dict[str, Any]) -> State:
    """Copies of all that ``parts`` keep, by name; ``ValueError`` for a part that keeps something of another kind."""
    arrays: State = {}
    plain: dict[str, Any] = {}
    for name, (content, key) in _Walk(parts).found.items():
        value = content[key]
        if isinstance(value, (np.ndarray, np.generic)):
            arrays[name] = np.array(value)
        else:
            plain[name] = _to_json(value.bit_generator.state if isinstance(value, np.random.Generator) else value)
    return {**arrays, PLAIN: np.frombuffer(json.dumps(plain).encode(), dtype=np.uint8).copy()}


def give_state(parts: dict[str, Any], state: State) -> None:
    """Give ``parts`` back what ``take_state`` returned; arrays are filled in place where their shape stays.

    Raises ``ValueError`` for the state of other parts, before anything has changed.
    """
    walk, given = _Walk(parts), _decoded(state)
    for name, (content, key) in walk.found.items():
        if name not in given and content[key] is not None:
            raise _foreign(f"{name!r} is missing")
    places = dict(walk.found)
    given = {name: value for name, value in given.items() if name not in walk.left_out}
    for name, value in given.items():
        owner, _, key = name.rpartition(".")
        if name in places:
            content, own = places[name]
            if not _fits(content[own], value):
                raise _foreign(f"{name!r} is of another kind or shape")
        elif isinstance(walk.holders.get(owner), dict):
            # An attribute that its part makes when it is first used.
            places[name] = walk.holders[owner], key
        else:
            raise _foreign(f"{name!r} is unknown")
    for name, value in given.items():
        content, key = places[name]
        before = content.get(key) if isinstance(content, dict) else content[key]
        if isinstance(before, np.random.Generator):
            before.bit_generator.state = value
        elif isinstance(before, np.ndarray) and isinstance(value, np.ndarray) and before.shape == value.shape:
            before[...] = value
        else:
            content[key] = value[()] if isinstance(before, np.generic) else value


class _Walk:
    """All that nested parts keep: ``found`` are (what holds it, its key there) by name, ``holders`` what holds others, and
    ``left_out`` the names that pickling leaves out."""

    def __init__(self, parts: dict[str, Any]) -> None:
        self.found: dict[str, tuple[Any, Any]] = {}
        self.holders: dict[str, Any] = {}
        self.left_out: set[str] = set()
        self._met: set[int] = set()
        self._inside("", parts)

    def _inside(self, place: str, content: Any) -> None:
        self.holders[place] = content
        # In the order of names: that in which attributes were made may differ.
        pairs = sorted(content.items(), key=lambda pair: str(pair[0])) if isinstance(content, dict) else enumerate(content)
        for key, value in pairs:
            name = f"{place}.{key}" if place else str(key)
            if name not in self.left_out:
                self._visit(name, content, key, value)

    def _visit(self, name: str, content: Any, key: Any, value: Any) -> None:
        if _is_plain(value) or isinstance(value, np.generic):
            self.found[name] = (content, key)
        elif id(value) not in self._met and not _is_constant(value):
            self._met.add(id(value))
            if isinstance(value, (np.ndarray, np.random.Generator)):
                self.found[name] = (content, key)
            elif isinstance(value, (dict, list, tuple)):
                self._inside(name, value)
            elif _has_attributes(value) and isinstance(kept := value.__getstate__() or {}, dict):
                own = vars(value)
                self.left_out |= {f"{name}.{one}" for one in own if kept.get(one, self) is not own[one]}
                self._inside(name, own)
            else:
                raise ValueError(f"{name} is a {type(value).__name__}; allowed in a state: {ALLOWED}")


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
    return [_to_json(one) for one in value] if isinstance(value, list) else value


def _from_json(value: Any) -> Any:
    if isinstance(value, dict):
        ((kind, inside),) = value.items()
        return tuple(map(_from_json, inside)) if kind == "tuple" else {key: _from_json(one) for key, one in inside.items()}
    return [_from_json(one) for one in value] if isinstance(value, list) else value


def _decoded(state: State) -> dict[str, Any]:
    try:
        plain = parse_json("state", state[PLAIN].tobytes(), dict, finite=False)
        return {
            **{name: np.array(value) for name, value in state.items() if name != PLAIN},
            **{name: _from_json(value) for name, value in plain.items()},
        }
    except (KeyError, AttributeError, TypeError, ValueError) as error:
        raise _foreign(f"{PLAIN!r} is missing or damaged") from error


def _fits(before: Any, value: Any) -> bool:
    """Whether a value may stand where another one stood; tables may grow along their first axis, and empty ones anyhow."""
    if isinstance(before, np.random.Generator):
        return bool(isinstance(value, dict) and value.get("bit_generator") == before.bit_generator.state["bit_generator"])
    if not isinstance(value, np.ndarray) or not isinstance(before, (np.ndarray, np.generic)):
        return True
    if before.size == 0 or value.size == 0:
        return bool(before.dtype == value.dtype)
    same = before.shape == value.shape or (before.ndim > 1 and before.shape[1:] == value.shape[1:])
    return same and bool(before.dtype == value.dtype)


def _foreign(why: str) -> ValueError:
    return ValueError(
        f"state is of another environment: {why}; allowed: what get_state() of one made with the same arguments returned"
    )
