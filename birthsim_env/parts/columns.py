"""Numbers of a CSV file, by the names of its columns."""

import csv
import io
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.reading import read
from birthsim_env.physics.rig.values import problem, shown

LARGEST_CSV = 64 * 2**20
"""Bytes of a file of numbers; an hour at 1 kHz takes them."""


def csv_file(value: Any) -> tuple[Path, list[str]] | None:
    """``file.csv`` or ``file.csv:t,a,b`` as a path and the names of columns; None for what is neither."""
    found = re.fullmatch(r"(.+\.csv)(?::(.*))?", str(value), re.IGNORECASE) if isinstance(value, (str, Path)) else None
    return None if found is None else (Path(found[1]), [name.strip() for name in (found[2] or "").split(",") if name.strip()])


def columns(kind: str, file: tuple[Path, list[str]], units: Mapping[str, str], needed: Sequence[str]) -> Array:
    """The ``needed`` columns (M, C) of a CSV file; the first one, time, increases.

    ``units`` has the unit of each column that such a file may have. A heading names the columns, in any order; it may add
    the unit, as in ``Fx (N)``, and name columns that nobody asks for. It may be a comment, as NumPy writes it. Where ``file``
    has names, these are the needed columns in the heading. Without a heading the columns stand in the order of ``units``;
    the last ones may be missing where they are not needed. Raises ``ValueError`` that names the argument ``kind``, the line
    and what is allowed.
    """
    path, given = file
    order, wanted = list(units), [units[name] for name in needed]
    listed = ", ".join(f"{name} ({unit})" for name, unit in zip(needed, wanted, strict=True))
    expected = f"allowed: lines of {listed}, separated by commas, with increasing times"
    if given and len(given) != len(needed):
        raise ValueError(f"{kind} = {str(path)!r}:{','.join(given)}; allowed: {path.name}:NAMES, one for each of {listed}")
    places, width, rows = [order.index(name) for name in needed], 0, list[list[float]]()
    try:
        text = read(kind, path, LARGEST_CSV).decode("utf-8-sig")
        for number, line in enumerate(csv.reader(io.StringIO(text, newline="")), start=1):
            comment = bool(line) and line[0].lstrip().startswith("#")
            cells = [line[0].lstrip(" \t#"), *line[1:]] if comment else line
            if not "".join(cells).strip():
                continue
            said, values = f"{kind} = {str(path)!r}, line {number}: {shown(','.join(line))}", _row(cells)
            if not rows and values is None:
                found = _places(cells, given or needed, wanted)
                if isinstance(found, list):
                    places, width = found, len(cells)
                elif not comment:
                    raise ValueError(f"{said} {found}; {expected}, or {path.name}:NAMES for other names")
            elif not comment:
                if given and not width:
                    raise ValueError(f"{said} comes before any heading; allowed: one that names {', '.join(given)}")
                width = width or (len(cells) if max(places) < len(cells) <= len(order) else -1)
                if values is None or len(values) != width or (rows and values[places[0]] <= rows[-1][0]):
                    raise ValueError(f"{said}; {expected}")
                rows.append([values[place] for place in places])
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{kind} = {str(path)!r} is no CSV ({problem(error)}); {expected}") from error
    if len(rows) < 2:
        raise ValueError(f"{kind} = {str(path)!r} has {len(rows)} lines of numbers; {expected}, at least 2")
    return np.array(rows)


def _row(cells: list[str]) -> list[float] | None:
    """The finite numbers of a line; None where it has anything else."""
    try:
        values = [float(cell) for cell in cells]
    except ValueError:
        return None
    return values if all(map(math.isfinite, values)) else None


def _places(heading: list[str], names: Sequence[str], units: Sequence[str]) -> list[int] | str:
    """Where ``names`` stand in a heading, in ``units``; in words what is wrong with it."""
    split = [re.fullmatch(r"(.*?)\s*(?:[(\[](.*)[)\]])?", cell.strip(), re.DOTALL) for cell in heading]
    own = [((one[1] or "").lower(), one[2] or "") for one in split if one is not None]
    places = []
    for name, unit in zip(names, units, strict=True):
        same = [place for place, (called, _) in enumerate(own) if called == name.lower()]
        if len(same) != 1:
            return f"names {name!r} {len(same)} times"
        if own[same[0]][1] not in ("", unit):
            return f"has {name!r} in {own[same[0]][1]}, not in {unit}"
        places.append(same[0])
    return places
