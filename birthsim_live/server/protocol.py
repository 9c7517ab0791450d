"""Messages of the page: what may come in, checked, and how what goes out is written."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, get_args

from pydantic import Field, TypeAdapter, ValidationError
from pydantic_core import to_json

from birthsim_build.layout import DRAG_LIMIT
from birthsim_live.rig.clock import SLOWEST
from birthsim_live.rig.settings import Strict, refusal, within

VERSION = 1

LONGEST = 16 * 1024
"""Bytes of a message."""

FARTHEST = 10.0
"""m; assumed: no pointer is further from the rig's origin."""

Coordinate = Annotated[float, within(-FARTHEST, FARTHEST, "m")]
Newtons = Annotated[float, within(-DRAG_LIMIT, DRAG_LIMIT, "N")]
Count = Annotated[int, Field(ge=0, lt=2**53)]


class Drag(Strict):
    """The person's hand is at ``position``, m; ``id`` counts the page's drags."""

    type: Literal["drag"] = "drag"
    position: tuple[Coordinate, Coordinate]
    id: Count


class Push(Strict):
    """The person's hand pushes with ``force``, N; ``id`` as of drags."""

    type: Literal["push"] = "push"
    force: tuple[Newtons, Newtons]
    id: Count


class Release(Strict):
    """The hand lets go."""

    type: Literal["release"] = "release"


class Set(Strict):
    """Settings to change; names and values are not checked yet."""

    type: Literal["set"] = "set"
    settings: dict[str, Any]


class Pause(Strict):
    """Stand still or go on."""

    type: Literal["pause"] = "pause"
    paused: bool


class Speed(Strict):
    """Times real time."""

    type: Literal["speed"] = "speed"
    speed: Annotated[float, within(SLOWEST, 1.0, "times real time")]


class Reset(Strict):
    """Start the scenario anew."""

    type: Literal["reset"] = "reset"


class Record(Strict):
    """Begin or end a recording."""

    type: Literal["record"] = "record"
    on: bool


class Seek(Strict):
    """Go to ``time``, s, of a recording."""

    type: Literal["seek"] = "seek"
    time: Annotated[float, within(0.0, 1e6, "s")]


class Ping(Strict):
    """Asks for a pong with the same ``id``."""

    type: Literal["ping"] = "ping"
    id: Count


Message = Drag | Push | Release | Set | Pause | Speed | Reset | Record | Seek | Ping

KINDS = ", ".join(kind.__name__.lower() for kind in get_args(Message))

_MESSAGES: TypeAdapter[Message] = TypeAdapter(Annotated[Message, Field(discriminator="type")])


def parse(text: str | bytes) -> Message:
    """The message in ``text``; raises ``ValueError`` naming what is wrong and what is allowed."""
    if not isinstance(text, str):
        raise ValueError("message is binary; allowed: JSON text")
    size = len(text.encode("utf-8", "surrogatepass"))
    if size > LONGEST:
        raise ValueError(f"message has {size} bytes; allowed: up to {LONGEST}")
    try:
        return _MESSAGES.validate_json(text)
    except ValidationError as error:
        untyped = error.errors()[0]["type"].startswith("union_tag")
        raise ValueError(f"message has no known type; allowed: {KINDS}" if untyped else refusal(error)) from None


def encode(message: Mapping[str, Any]) -> str:
    """A message as JSON; what is not finite becomes null."""
    return to_json(message, inf_nan_mode="null").decode()


def error(text: str) -> dict[str, str]:
    """The answer to what was wrong."""
    return {"type": "error", "message": text}
