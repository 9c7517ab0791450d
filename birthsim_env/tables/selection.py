"""Which columns of a table are used for what: by name, by another name of the same, or as a user maps them."""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.values import in_line, near, shown
from birthsim_env.tables.headings import CONCEPTS, concept, key
from birthsim_env.tables.table import Table
from birthsim_env.tables.units import unit_of, units_for

BOOKKEEPING = ("topic", "log_time")
"""Columns that BirthSIM's own logs have beside what was logged."""

NOTHING = "none"
"""What a user maps to say that there is no such column."""


_NUMBER = r"(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_SCALED = re.compile(rf"(.+?)\s*\*\s*([-+]?{_NUMBER})(?:\s*([-+])\s*({_NUMBER}))?")

SCALED = "COLUMN*FACTOR+OFFSET"
"""How a user turns the numbers of a column into SI: ``u*0.2-1`` is an opening where 5 V is shut and 10 V is open."""


class Mapped(NamedTuple):
    """The column that a user means, and how its numbers become SI: times ``factor`` plus ``offset``, or, where ``factor`` is 0,
    as the unit of the heading says."""

    column: str
    factor: float = 0.0
    offset: float = 0.0


def _scaled(text: str) -> Mapped:
    """What a user's ``COLUMN`` or ``COLUMN*FACTOR+OFFSET`` says."""
    found = _SCALED.fullmatch(text)
    if found is None:
        return Mapped(text)
    factor, offset = float(found[2]), float(f"{found[3] or ''}{found[4] or 0}")
    if factor == 0 or not (math.isfinite(factor) and math.isfinite(offset)):
        raise ValueError(
            f"{in_line(text)} has the factor {factor:g} and the offset {offset:g}; allowed: finite ones, not times 0"
        )
    return Mapped(found[1], factor, offset)


def mapping_of(argument: str, text: str, names: Sequence[str]) -> dict[str, Mapped]:
    """Name -> column, of a user's words: ``name=column,...``, or all columns in the order of ``names``.

    A column may be ``SCALED``. ``ValueError`` names ``argument``, which may end in words of its own, as ``file.csv:`` does.
    """
    parts = [part.strip() for part in text.split(",") if part.strip()]
    allowed = f"allowed: NAME=COLUMN,..., or a COLUMN for each of {', '.join(names)}; {SCALED} where it is not in SI"
    pairs = [part.partition("=") for part in parts]
    if parts and all(equals for _, equals, _ in pairs):
        found = {name.strip(): column.strip() for name, _, column in pairs}
        for name, column in found.items():
            if name not in names or not column:
                said = f"{shown(name)}{near(name, names)}" if column else f"{name}= without a column"
                raise ValueError(f"{argument}{in_line(text)}: {said}; {allowed}")
    elif parts and not any(equals for _, equals, _ in pairs) and len(parts) == len(names):
        found = dict(zip(names, parts, strict=True))
    else:
        raise ValueError(f"{argument}{in_line(text)}; {allowed}")
    try:
        mapping = {name: _scaled(column) for name, column in found.items()}
    except ValueError as error:
        raise ValueError(f"{argument}{error}") from None
    columns = [one for one in mapping.values() if one.column != NOTHING]
    if len(set(columns)) < len(columns) or len(found) < len(parts):
        raise ValueError(f"{argument}{in_line(text)} names one of them twice; {allowed}")
    return mapping


class Selection:
    """Columns of a ``table`` that are used, in SI, by the names of ``fields`` (name -> SI unit).

    ``mapping`` says which column is meant, where a user says it; a field of ``NOTHING`` is not looked for. ``others`` says
    in errors how a user can name columns.
    """

    def __init__(self, table: Table, fields: Mapping[str, str], mapping: Mapping[str, Mapped], others: str) -> None:
        self.table, self._fields, self._mapping, self._others = table, fields, mapping, others
        self.used = {name: self._mapped(name, one.column) for name, one in mapping.items() if one.column != NOTHING}
        for name in fields:
            if name not in mapping:
                found = self._named(name)
                if found is not None:
                    self.used[name] = found

    def _mapped(self, name: str, column: str) -> str:
        known = self.table.columns
        folded = key(column)
        same = [
            *(one for one in known if column in (one, self.table.headings.get(one, one).strip())),
            *(one for one in known if key(one) == folded or key(self.table.headings.get(one, one)) == folded),
        ]
        if not same:
            said = f"has no column {shown(column)} for {name}{near(column, known)}"
            raise ValueError(f"{self.table.source} {said}; allowed: {self._listed(known)}")
        return same[0]

    def _named(self, name: str) -> str | None:
        """The column of a field: its very name, its name in another case, or the one that has another name of the same."""
        free = [one for one in self.table.columns if one not in self.used.values()]
        for same in (
            [one for one in free if one == name],
            [one for one in free if key(one) == key(name)],
            [one for one in free if concept(one) == concept(name)],
        ):
            if len(same) > 1 and set(same) & set(BOOKKEEPING):
                same = [one for one in same if one not in BOOKKEEPING]
            if len(same) > 1:
                words = f"{in_line(' and '.join(same))}, which may each be {name}"
                raise ValueError(f"{self.table.source} has {words}; allowed: one of them, {self._others}")
            if same:
                return same[0]
        return None

    @property
    def unused(self) -> list[str]:
        """Columns that no field uses, without BirthSIM's own bookkeeping."""
        return [one for one in self.table.columns if one not in self.used.values() and one not in BOOKKEEPING]

    def check(self, needed: Iterable[str]) -> None:
        """``ValueError`` that lists what of ``needed`` is not there, and what may be meant."""
        missing = [name for name in needed if name not in self.used]
        if missing:
            asked = next((words for name in missing if (words := self._like(name))), "")
            there = self._listed(self.table.columns)
            raise ValueError(
                f"{self.table.source} lacks {in_line(', '.join(missing))}{asked}; there are: {there}; allowed: {self._others}"
            )

    def _listed(self, names: Iterable[str]) -> str:
        return in_line(", ".join(names)) or "none"

    def _like(self, name: str) -> str:
        known = CONCEPTS.get(concept(name), ("", ()))[1]
        words = (near(word, self.unused) for word in (name, *known) if len(word) > 2)
        return next((f" ({name}: {found[2:]}" for found in words if found), "")

    def values(self, name: str) -> Array:
        """The numbers of a field (T,) in SI; ``ValueError`` where the column has another unit, or cannot be used."""
        column, unit = self.used[name], self._fields[name]
        values = self.table.column(column)
        _, factor, offset = self._mapping.get(name, Mapped(column))
        if factor:
            return np.asarray(values * factor + offset)
        said = self.table.units.get(column, "")
        if not said:
            return values
        found = unit_of(said)
        if found is None or found[0] != unit:
            allowed = f"{units_for(unit)}, or {name}={SCALED.replace('COLUMN', in_line(column))}"
            raise ValueError(f"{self.table.source} has {name!r} in {in_line(said)}; allowed: {allowed}")
        return values if found[1] == 1 else np.asarray(values * found[1])

    def note(self, known: Iterable[str] = ()) -> str:
        """What there is to say of columns that are not used, without the ``known`` others; nothing where there are none."""
        others = {concept(name) for name in known}
        unused = [one for one in self.unused if concept(one) not in others]
        if not unused:
            return ""
        asked = next((words for name in self._fields if name not in self.used and (words := self._like(name))), "")
        return f"{self.table.source}: columns that are not used: {in_line(', '.join(unused))}{asked}"


def clock_note(selection: Selection) -> str:
    """What there is to say of times that are dates or times of a day; nothing of others."""
    time = selection.used.get("time", "")
    if time not in selection.table.clocks:
        return ""
    return f"{selection.table.source}: column {time!r} has dates or times of a day; time is counted from the first one"
