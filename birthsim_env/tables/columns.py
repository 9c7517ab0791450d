"""Rows of a user's file of a reference, a hand, a schedule or an experiment: columns by their names, with increasing times."""

import os
import re
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.reading import named
from birthsim_env.physics.rig.values import in_line
from birthsim_env.registry import names
from birthsim_env.tables.reading import read_table
from birthsim_env.tables.selection import Mapped, Selection, clock_note, mapping_of
from birthsim_env.tables.table import Reading, Table

LARGEST = 64 * 2**20
"""Bytes of a file; an hour at 1 kHz takes them."""


def table_file(value: Any) -> tuple[Path, str] | None:
    """``file.csv`` or ``file.csv:t,a,b`` as a path and the names of columns; None for what is no file of a table."""
    if not isinstance(value, (str, os.PathLike)):
        return None
    endings = "|".join(map(re.escape, names("reader")))
    found = re.fullmatch(rf"(.+?(?:{endings}))(?::(.*))?", os.fsdecode(value), re.IGNORECASE | re.DOTALL)
    return None if found is None else (Path(found[1]), found[2] or "")


def columns(kind: str, file: tuple[Path, str], units: Mapping[str, str], needed: Sequence[str]) -> Array:
    """The ``needed`` columns (M, C) of a file, in SI; the first one, time, increases.

    ``units`` has the unit of each column that such a file may have. A heading names the columns in any order. Without a heading
    the columns stand in the order of ``units``; the last ones may be missing where they are not needed. Where ``file`` has
    names, these are columns of the heading, for all that is needed, or for some (``x=a,y=b``). Warns of columns that are not
    used. Raises ``ValueError`` that names the argument ``kind``, the line and what is allowed.
    """
    path, names = file
    listed = ", ".join(f"{name} ({units[name]})" for name in needed)
    expected = f"rows of {listed}, with increasing times"
    mapping = mapping_of(f"{kind} = {named(path)}:", names, needed) if names else {}
    table = read_table(kind, path, Reading(names=frozenset(one.column for one in mapping.values()), most=LARGEST))
    if not table.headed:
        table = _in_order(table, list(units), needed, mapping)
    wanted = {name: units[name] for name in needed}
    selection = Selection(table, wanted, mapping, f"{expected}, or {path.name}:NAMES for other names")
    selection.check(needed)
    rows = np.array([selection.values(name) for name in needed]).T
    finite = np.isfinite(rows).all(axis=1)
    if not finite.all():
        row = int(np.argmin(finite))
        bad = ((name, value) for name, value in zip(needed, rows[row], strict=True) if not np.isfinite(value))
        words = ", ".join(f"{name} = {value:g}" for name, value in bad)
        raise ValueError(f"{table.source}, {table.where(row)}: {words}; allowed: finite numbers, {expected}")
    late = np.diff(rows[:, 0]) > 0
    if not late.all():
        row = int(np.argmin(late)) + 1
        words = f"time {rows[row, 0]:.9g} after {rows[row - 1, 0]:.9g}"
        raise ValueError(f"{table.source}, {table.where(row)}: {words}; allowed: {expected}")
    if len(rows) < 2:
        raise ValueError(f"{table.source} has {len(rows)} rows of numbers; allowed: {expected}, at least 2")
    for note in (*table.notes, selection.note([name for name in units if name not in needed]), clock_note(selection)):
        if note:
            warnings.warn(note, stacklevel=3)
    return rows


def _in_order(table: Table, order: list[str], needed: Sequence[str], mapping: Mapping[str, Mapped]) -> Table:
    """A table without a heading whose columns are called as they stand in ``order``."""
    if mapping:
        names = ", ".join(one.column for one in mapping.values())
        raise ValueError(f"{table.source} has no heading; allowed: one that names {in_line(names)}")
    least, width = max(map(order.index, needed)) + 1, len(table.columns)
    if not least <= width <= len(order):
        raise ValueError(
            f"{table.source} has {width} columns and no heading; allowed: {', '.join(order)}, the first {least} at least"
        )
    called = dict(zip(table.columns, order, strict=False))
    return replace(
        table,
        columns={called[name]: values for name, values in table.columns.items()},
        faults={called[name]: fault for name, fault in table.faults.items()},
        clocks=frozenset(called[name] for name in table.clocks),
        units={called[name]: unit for name, unit in table.units.items()},
        headings={},
    )
