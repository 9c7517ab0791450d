"""A table: named columns of numbers, whatever file they were read from, and what keeps some of them from being used."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.values import in_line, near
from birthsim_env.tables.headings import is_known, name_and_unit

LARGEST = 512 * 2**20
"""Bytes of a file, of its numbers in memory, and of what a packed one holds; an hour at 1 kHz takes some 400 MB as CSV."""

LONGEST = 2**20
"""Bytes of a line, a message or a text in a cell."""


@dataclass(frozen=True)
class Reading:
    """How a table is read: ``skip`` lines before the heading (None: as many as there clearly are), decimal commas, and names
    of columns that are asked for beside the known ones. A file, and what it takes unpacked, has at most ``most`` bytes.
    Where a user ``has_options`` for this, errors name them."""

    skip: int | None = None
    decimal_comma: bool = False
    names: frozenset[str] = frozenset()
    most: int = LARGEST
    has_options: bool = False

    def check_size(self, source: str, numbers: int) -> None:
        """Refuse more numbers than a table may have; ``source`` names the file."""
        if 8 * numbers > self.most:
            raise ValueError(
                f"{source} has at least {numbers} numbers; allowed: {self.most // 8}, which take {self.most} bytes"
            )

    def asks_for(self, name: str) -> bool:
        """Whether a name is one that somebody wants."""
        return is_known(name) or name in self.names


class Raw(NamedTuple):
    """A column as a file has it: its heading, numbers (T,), the unit that the file states elsewhere, and what is wrong."""

    heading: str
    values: Array
    unit: str = ""
    fault: str = ""
    is_clock: bool = False


@dataclass(frozen=True)
class Table:
    """``columns``: name -> numbers (T,), as the file has them, NaN where a row has none.

    ``source`` names the file in errors; ``units`` are those that it states; ``headings`` are the names with all around them.
    ``faults``: name -> why a column cannot be used. ``clocks`` are columns of instants, in s from the first one on.
    ``lines`` are the lines of the rows in a file of text. Without a heading (``headed``) names are ``column 1`` and so on.
    ``notes`` say what was left out of the file; ``elsewhere`` are names of what it holds that is no part of the table.
    """

    source: str
    columns: dict[str, Array]
    units: dict[str, str] = field(default_factory=dict)
    headings: dict[str, str] = field(default_factory=dict)
    faults: dict[str, str] = field(default_factory=dict)
    clocks: frozenset[str] = frozenset()
    lines: Array | None = None
    headed: bool = True
    notes: tuple[str, ...] = ()
    elsewhere: tuple[str, ...] = ()

    @property
    def rows(self) -> int:
        """How many rows there are."""
        return len(next(iter(self.columns.values()), ()))

    def where(self, row: int) -> str:
        """A row from 0 on as errors name it."""
        return f"row {row}" if self.lines is None else f"line {int(self.lines[row])}"

    def column(self, name: str) -> Array:
        """A column as it is in the file; ``ValueError`` names what there is, or what keeps it from being used."""
        if name not in self.columns:
            asked = near(name, self.columns)
            raise ValueError(f"{self.source} has no column {name!r}{asked}; there are: {in_line(', '.join(self.columns))}")
        if name in self.faults:
            fault = self.faults[name]
            allowed = "" if "allowed: " in fault else "; allowed: numbers"
            raise ValueError(f"{self.source}, column {in_line(name)!r}: {fault}{allowed}")
        return self.columns[name]


def table_of(
    source: str, raw: Iterable[Raw], notes: Iterable[str] = (), lines: Array | None = None, headed: bool = True
) -> Table:
    """The table that columns of a file make; of two of one name none can be used."""
    kept = ((place, one) for place, one in enumerate(raw, start=1) if one.heading.strip() or not np.isnan(one.values).all())
    values: dict[str, Array] = {}
    units: dict[str, str] = {}
    headings: dict[str, str] = {}
    faults: dict[str, str] = {}
    clocks = set[str]()
    for place, column in kept:
        name, unit = name_and_unit(column.heading)
        name = "".join(letter if letter.isprintable() else "?" for letter in name) or f"column {place}"
        if name in values:
            faults[name] = "is there more than once; allowed: one column of each name"
            continue
        values[name], units[name], headings[name] = column.values, unit or column.unit, column.heading
        if column.fault:
            faults[name] = column.fault
        if column.is_clock:
            clocks.add(name)
            units[name] = "s"
    return Table(source, values, units, headings, faults, frozenset(clocks), lines, headed, tuple(notes))
