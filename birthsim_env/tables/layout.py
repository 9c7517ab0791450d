"""Where the table stands in a file of text: what separates its cells, its heading, its units, and what stands before."""

import csv
import re
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import groupby, islice, zip_longest
from typing import NamedTuple

from birthsim_env.tables.cells import is_number
from birthsim_env.tables.headings import is_units, key, name_and_unit, units_of
from birthsim_env.tables.table import Reading

SAMPLE = 2000, 2**20
"""Lines, and characters, in which the heading and the first rows have to be."""

SEPARATORS = ("\t", ";", ",", "|")

SPACES = " "
"""Stands for any number of blanks between cells."""

_COMMENT = re.compile(r"\s*[#%]+\s?")


@dataclass(frozen=True)
class Layout:
    """``begin`` lines stand before the first row. Line ``heading`` has the ``names``; without a heading there are none, and
    ``heading`` is 0. ``before`` counts lines before the heading that are no remarks."""

    separator: str
    names: list[str]
    units: list[str]
    heading: int
    begin: int
    before: int = 0


class _Line(NamedTuple):
    number: int
    is_remark: bool
    cells: list[str]

    @property
    def widths(self) -> set[int]:
        """Numbers of cells that the line can be said to have: with and without empty ones at its end."""
        return {len(self.cells), len(trimmed(self.cells))}


def is_remark(line: str) -> bool:
    """Whether a line is a comment as NumPy and MATLAB mark them."""
    return _COMMENT.match(line) is not None


def trimmed(cells: list[str]) -> list[str]:
    """Cells without empty ones at the end."""
    last = len(cells)
    while last and not cells[last - 1]:
        last -= 1
    return cells[:last]


def split(line: str, separator: str) -> list[str]:
    """The cells of a line, without blanks around them."""
    cells = line.split() if separator == SPACES else next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    return [cell.strip() for cell in cells]


def layout_of(lines: Iterable[str], how: Reading) -> Layout:
    """The layout of a text; its first lines are enough.

    The heading is the last line before the numbers that has as many cells as they, and no number. A row of units may follow.
    Where no line is like this, the first one is the heading, unless it has a number.
    """
    sample: list[str] = []
    size = 0
    for line in islice(lines, SAMPLE[0]):
        sample.append(line)
        size += len(line)
        if size > SAMPLE[1]:
            break
    skipped = min(how.skip or 0, len(sample))
    said = re.fullmatch(r"\"?sep=(.)\"?\s*", sample[skipped], re.IGNORECASE) if skipped < len(sample) else None
    skipped += said is not None
    separator = _separator(sample[skipped:], how) if said is None else said[1]
    rows = []
    for number, line in enumerate(sample[skipped:], start=skipped + 1):
        remark = is_remark(line)
        cells = split(_COMMENT.sub("", line, count=1) if remark else line, separator)
        if any(cells):
            rows.append(_Line(number, remark, cells))
    plain = [row for row in rows if not row.is_remark]
    heading, units = _heading(rows, how)
    if heading is None and plain and not any(is_number(cell, how.decimal_comma) for cell in plain[0].cells):
        heading = plain[0]
    if heading is None:
        return Layout(separator, [], [], 0, plain[0].number - 1 if plain else len(sample))
    before = sum(row.number < heading.number for row in plain)
    last = heading.number if units is None else units.number
    return Layout(separator, heading.cells, [] if units is None else units_of(units.cells), heading.number, last, before)


def _is_data(row: _Line, how: Reading) -> bool:
    numbers = [is_number(cell, how.decimal_comma) for cell in row.cells]
    rest = [cell for cell, is_one in zip(row.cells, numbers, strict=True) if not is_one]
    return not row.is_remark and any(numbers) and not any(cell.strip("-") for cell in rest)


def _heading(rows: list[_Line], how: Reading) -> tuple[_Line | None, _Line | None]:
    """The heading before the first two rows of numbers, and the row of units between them, where there are such."""
    data = [row for row in rows if not row.is_remark]
    for row, following in zip_longest(data, data[1:]):
        if _is_data(row, how) and (following is None or (_is_data(following, how) and row.widths & following.widths)):
            return _above(row, [other for other in rows if other.number < row.number], how)
    return None, None


def _above(row: _Line, before: list[_Line], how: Reading) -> tuple[_Line | None, _Line | None]:
    units = None
    for line in reversed(before):
        cells = line.cells
        # LabVIEW has a column of comments, in a row that has none not even its separator.
        fits = bool(line.widths & row.widths) or (key(cells[-1]) == "comment" and len(cells) - 1 in row.widths)
        if not fits or any(is_number(cell, how.decimal_comma) for cell in cells):
            if line.is_remark:
                continue
            break
        if units is None and is_units(cells):
            units = line
        elif not line.is_remark or any(how.asks_for(name_and_unit(cell)[0]) for cell in cells):
            cut = cells if line.widths & row.widths else cells[:-1]
            return line._replace(cells=cut), units
    return None, None


def _separator(sample: list[str], how: Reading) -> str:
    """What splits the most lines in a row into equally many cells, at least two."""
    best, longest = ",", 0
    lines = [line for line in sample if line.strip()]
    for separator in SEPARATORS:
        if separator == "," and how.decimal_comma:
            continue
        widths = (len(split(line, separator)) for line in lines)
        run = max((sum(1 for _ in same) for width, same in groupby(widths) if width > 1), default=0)
        if run > longest:
            best, longest = separator, run
    blank = [line.split() for line in lines]
    spaced = any(len(cells) > 1 and all(is_number(cell, how.decimal_comma) for cell in cells) for cells in blank)
    return SPACES if spaced and not longest else best
