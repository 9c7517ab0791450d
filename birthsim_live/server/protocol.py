"""Messages of the page: what may come in, checked, and how what goes out is written."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from baselines.files import finite
from birthsim_live.rig.clock import SLOWEST
from birthsim_live.rig.settings import shown

VERSION = 1

LONGEST = 16 * 1024
"""Bytes of a message."""

FARTHEST = 10.0
"""m; assumed: no pointer is further from the rig's origin."""


@dataclass(frozen=True)
class Drag:
    """The person's hand is at ``position``, m; ``id`` counts the page's drags."""

    position: tuple[float, float]
    id: int


@dataclass(frozen=True)
class Release:
    """The hand lets go."""


@dataclass(frozen=True)
class Set:
    """Settings to change; names and values are not checked yet."""

    settings: Mapping[str, Any]


@dataclass(frozen=True)
class Pause:
    """Stand still or go on."""

    paused: bool


@dataclass(frozen=True)
class Speed:
    """Times real time."""

    speed: float


@dataclass(frozen=True)
class Reset:
    """Start the scenario anew."""


@dataclass(frozen=True)
class Record:
    """Begin or end a recording."""

    on: bool


@dataclass(frozen=True)
class Seek:
    """Go to ``time``, s, of a recording."""

    time: float


@dataclass(frozen=True)
class Ping:
    """Asks for a pong with the same ``id``."""

    id: Any


Message = Drag | Release | Set | Pause | Speed | Reset | Record | Seek | Ping


def parse(text: str | bytes) -> Message:
    """The message in ``text``; raises ``ValueError`` naming what is wrong and what is allowed."""
    if not isinstance(text, str):
        raise ValueError("message is binary; allowed: JSON text")
    size = len(text.encode("utf-8", "surrogatepass"))
    if size > LONGEST:
        raise ValueError(f"message has {size} bytes; allowed: up to {LONGEST}")
    try:
        content = json.loads(text, parse_constant=_no_constant)
    except RecursionError:
        raise ValueError("message is nested too deeply; allowed: a JSON object of plain fields") from None
    except ValueError as error:
        raise ValueError(f"message is no JSON ({error}); allowed: a JSON object with a type") from None
    if not isinstance(content, dict):
        raise ValueError(f"message = {shown(content)}; allowed: a JSON object with a type")
    kind = content.pop("type", None)
    if not (isinstance(kind, str) and kind in _FIELDS):
        raise ValueError(f"type = {shown(kind)}; allowed: {', '.join(_FIELDS)}")
    make, fields = _FIELDS[kind]
    if set(content) != set(fields):
        found = ", ".join(map(shown, content)) or "nothing"
        raise ValueError(f"{kind} has the fields {found}; allowed: exactly {', '.join(fields) or 'none'}")
    return make(**{name: check(f"{kind}.{name}", content[name]) for name, check in fields.items()})


def encode(message: Mapping[str, Any]) -> str:
    """A message as JSON; what is not finite becomes null."""
    return json.dumps(finite(dict(message)), allow_nan=False, separators=(",", ":"))


def error(text: str) -> dict[str, str]:
    """The answer to what was wrong."""
    return {"type": "error", "message": text}


def _no_constant(name: str) -> float:
    raise ValueError(f"{name} is no number of JSON")


def _number(name: str, value: Any, low: float, high: float, unit: str) -> float:
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    # Whole numbers may be too large for a float; comparing them needs none.
    if not (number and low <= value <= high and math.isfinite(value)):
        raise ValueError(f"{name} = {shown(value)}; allowed: {low:g} to {high:g}{unit}")
    return float(value)


def _point(name: str, value: Any) -> tuple[float, float]:
    if not (isinstance(value, list) and len(value) == 2):
        raise ValueError(f"{name} = {shown(value)}; allowed: [x, y] in m")
    x, y = (_number(f"{name}[{k}]", number, -FARTHEST, FARTHEST, " m") for k, number in enumerate(value))
    return x, y


def _count(name: str, value: Any) -> int:
    if not (isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 2**53):
        raise ValueError(f"{name} = {shown(value)}; allowed: a whole number from 0 to 2^53 - 1")
    return value


def _truth(name: str, value: Any) -> bool:
    if not isinstance(value, bool):
        raise ValueError(f"{name} = {shown(value)}; allowed: true or false")
    return value


def _object(name: str, value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ValueError(f"{name} = {shown(value)}; allowed: an object, setting -> value")
    return value


def _speed(name: str, value: Any) -> float:
    return _number(name, value, SLOWEST, 1.0, " times real time")


def _instant(name: str, value: Any) -> float:
    return _number(name, value, 0.0, 1e6, " s")


def _label(name: str, value: Any) -> Any:
    if isinstance(value, str) and len(value) <= 64:
        return value
    if isinstance(value, str):
        raise ValueError(f"{name} = {shown(value)}; allowed: up to 64 characters, or a number")
    return _number(name, value, -(2.0**53), 2.0**53, "")


_FIELDS: dict[str, tuple[Callable[..., Message], dict[str, Callable[[str, Any], Any]]]] = {
    "drag": (Drag, {"position": _point, "id": _count}),
    "release": (Release, {}),
    "set": (Set, {"settings": _object}),
    "pause": (Pause, {"paused": _truth}),
    "speed": (Speed, {"speed": _speed}),
    "reset": (Reset, {}),
    "record": (Record, {"on": _truth}),
    "seek": (Seek, {"time": _instant}),
    "ping": (Ping, {"id": _label}),
}
"""Type -> the message and its fields, each with its check."""
