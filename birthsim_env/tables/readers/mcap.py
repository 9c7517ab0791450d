"""Tables in MCAP files: the messages of one channel, whatever each of them holds."""

from array import array
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from birthsim_env.physics.rig.values import in_line, problem, shown
from birthsim_env.registry import register
from birthsim_env.tables.cells import Cells
from birthsim_env.tables.headings import concept, name_and_unit
from birthsim_env.tables.table import LONGEST, Raw, Reading, Table, table_of

DEPTH = 4
"""Levels of objects in a message that are taken as columns: ``force.x``."""


@register(reader=".mcap", about="MCAP: the channel of JSON messages that fits best.", needs={"extra log"}, order=3)
def read_mcap(source: str, content: bytes, how: Reading) -> Table:
    """The table of an MCAP file: of its channels of JSON messages the one with the most known columns, or else with the most
    messages. A message's ``log_time`` is its time unless one of them has a time in it."""
    from birthsim_env.tables.mcap_messages import json_messages  # needs the extra

    topics: dict[str, _Topic] = {}
    foreign = set[str]()
    size = _Size(source, how)
    try:
        for topic, time, message in json_messages(content, how.most, LONGEST):
            if message is None:
                foreign.add(topic)
                continue
            topics.setdefault(topic, _Topic()).take(time, message, size)
    except Exception as error:
        # Damage trips mcap, struct, its compressors and json in a dozen ways.
        raise ValueError(f"{source} cannot be read as MCAP ({problem(error)})") from error
    if not topics:
        words = f"has no JSON messages, but {in_line(', '.join(sorted(foreign)))}" if foreign else "has no messages"
        raise ValueError(f"{source} {words}; allowed: messages in JSON")
    name = max(topics, key=lambda one: (topics[one].known(how), len(topics[one].times)))
    others = in_line(", ".join(sorted({*topics, *foreign} - {name})))
    found = table_of(source, topics[name].raw(), [f"{source}: {name} is read; not read: {others}"] if others else [])
    parts = (f"{other}.{column}" for other, one in topics.items() if other != name for column in one.names())
    return replace(found, elsewhere=(*sorted(foreign), *parts))


class _Size:
    """How many numbers there are in all, before there are more."""

    def __init__(self, source: str, how: Reading) -> None:
        self._source, self._how, self._numbers = source, how, 0

    def grow(self, numbers: int) -> None:
        self._numbers += numbers
        self._how.check_size(self._source, self._numbers)


class _Topic:
    """Messages of a channel, as columns that grow."""

    def __init__(self) -> None:
        self.times = array("Q")
        self._columns: dict[str, array[float]] = {}
        self._cells: dict[str, Cells] = {}
        self._faults: dict[str, str] = {}

    def names(self) -> list[str]:
        """The columns, without their units."""
        return [name_and_unit(name)[0] for name in self._columns]

    def known(self, how: Reading) -> int:
        """How many columns somebody may want."""
        return sum(map(how.asks_for, self.names()))

    def take(self, time: int, message: Any, size: _Size) -> None:
        row = len(self.times)
        size.grow(1)
        self.times.append(time)
        if not isinstance(message, dict):
            raise ValueError(f"message {row} is {shown(message)}; allowed: objects")
        for name, value in _leaves(message, "", DEPTH):
            numbers = self._columns.setdefault(name, array("d"))
            missing = row - len(numbers)
            if missing < 0:  # it is there twice, as a.b and as b in a
                continue
            size.grow(missing + 1)
            numbers.extend([np.nan] * missing)
            numbers.append(self._number(name, value, row))

    def _number(self, name: str, value: Any, row: int) -> float:
        if isinstance(value, str):
            return self._cells.setdefault(name, Cells()).read(value, row, f"row {row}")
        if isinstance(value, (int, float)):
            try:
                return float(value)
            except OverflowError:
                pass
        elif value is None:
            return np.nan
        self._faults.setdefault(name, f"row {row}: {shown(value)} is no number")
        return np.nan

    def raw(self) -> Iterator[Raw]:
        """Columns in the order of the messages' times."""
        order = np.argsort(np.frombuffer(self.times, dtype=np.uint64), kind="stable")
        if not any(concept(name_and_unit(name)[0]) == "time" for name in self._columns):
            yield Raw("log_time", np.asarray(1e-9 * np.frombuffer(self.times, dtype=np.uint64)[order], dtype=np.float64), "s")
        for name, numbers in self._columns.items():
            numbers.extend([np.nan] * (len(self.times) - len(numbers)))
            cells = self._cells.get(name, Cells())
            fault = self._faults.get(name, "") or cells.fault
            yield Raw(name, np.frombuffer(numbers)[order], "", fault, cells.is_clock)


def _leaves(message: dict[str, Any], place: str, depth: int) -> Iterator[tuple[str, Any]]:
    for name, value in message.items():
        seconds = _seconds(value)
        if seconds is not None:
            yield f"{place}{name}", seconds
        elif isinstance(value, dict) and value and depth > 1:
            yield from _leaves(value, f"{place}{name}.", depth - 1)
        else:
            yield f"{place}{name}", value


def _seconds(value: Any) -> float | None:
    """The s of a time as ROS and Foxglove write it, {sec, nsec}; None of anything else."""
    if not isinstance(value, dict) or tuple(value) not in (("sec", "nsec"), ("secs", "nsecs"), ("sec", "nanosec")):
        return None
    whole, rest = value.values()
    return whole + 1e-9 * rest if all(isinstance(one, int) and abs(one) < 2**63 for one in (whole, rest)) else None
