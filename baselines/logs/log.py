"""A log: series of named numbers with units, whatever they were read from and whatever they will be written to."""

from dataclasses import dataclass
from typing import Any, NamedTuple

from numpy.typing import NDArray

from birthsim_env.physics.compiled.lanes import Array


class Column(NamedTuple):
    """What the numbers of a column are; the unit "1" is none."""

    unit: str
    meaning: str


class Event(NamedTuple):
    """Something that is no number and holds from ``time``, s, on; ``value`` is JSON."""

    time: float
    kind: str
    value: Any


@dataclass(frozen=True)
class Series:
    """Rows of a topic: times (T,), s, and column -> values (T,), each float64, int64 or bool."""

    topic: str
    times: Array
    values: dict[str, NDArray[Any]]


@dataclass(frozen=True)
class Log:
    """Series that have the same columns, events, and what there is to say of them all (JSON)."""

    columns: dict[str, Column]
    series: list[Series]
    events: list[Event]
    about: dict[str, Any]
