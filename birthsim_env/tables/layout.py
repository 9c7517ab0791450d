"""Where the table stands in a file of text: what separates its cells, its heading, its units, and what stands before."""

import csv
import re
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import groupby, islice, zip_longest
from typing import NamedTuple

from birthsim_env.tables.cells import is_missing, is_number
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
    ``heading`` is 0. ``before`` counts lines before the rows that are neither of these nor remarks."""

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

    The heading is the last line before the numbers that has as many cells as they, no number, and a known name if one has.
    Where no line is like this, it is the first one with two known names, or the first one if it has no number. A row of units
    may follow.
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
    heading, units, begin = _heading(rows, how)
    plain = [row for row in rows if not row.is_remark and row not in (heading, units)]
    if heading is None:
        return Layout(separator, [], [], 0, plain[0].number - 1 if plain else len(sample))
    before = sum(row.number <= begin for row in plain)
    return Layout(separator, heading.cells, [] if units is None else units_of(units.cells), heading.number, begin, before)


def _has_number(row: _Line, how: Reading) -> bool:
    return any(is_number(cell, how.decimal_comma) for cell in row.cells)


def _is_data(row: _Line, how: Reading) -> bool:
    return _has_number(row, how) and all(is_missing(cell) or is_number(cell, how.decimal_comma) for cell in row.cells)


def _known(row: _Line, how: Reading) -> int:
    """How many cells are names that somebody asks for."""
    return sum(how.asks_for(name_and_unit(cell)[0]) for cell in row.cells)


def _heading(rows: list[_Line], how: Reading) -> tuple[_Line | None, _Line | None, int]:
    """The heading and the row of units, where there are such, and the last line before the rows."""
    plain = [row for row in rows if not row.is_remark]
    for row, following in zip_longest(plain, plain[1:]):
        if _is_data(row, how) and (following is None or (_is_data(following, how) and row.widths & following.widths)):
            above = _above(row, [other for other in rows if other.number < row.number], how)
            units = next((line for line in above if is_units(line.cells)), None)
            headings = [line for line in above if line is not units and (not line.is_remark or _known(line, how))]
            if headings:
                names = next((line for line in headings if _known(line, how)), headings[0])
                if units is None and _known(names, how):
                    below = (line for line in above if line.number > names.number)
                    units = next((line for line in below if is_units(line.cells, below=True)), None)
                return names, units, row.number - 1
            break
    worded = [row for row in rows if not _has_number(row, how)]
    heading = next((row for row in worded if _known(row, how) > 1), None)
    if heading is None and plain and plain[0] in worded:
        heading = plain[0]
    if heading is None:
        return None, None, 0
    following = next((row for row in plain if row.number > heading.number), None)
    units = following if following is not None and is_units(following.cells) else None
    return heading, units, (units or heading).number


def _above(row: _Line, before: list[_Line], how: Reading) -> list[_Line]:
    """The lines before the first row that can be its heading or its units, the nearest first."""
    above = []
    for line in reversed(before):
        cells = line.cells
        # LabVIEW has a column of comments, in a row that has none not even its separator.
        commented = key(cells[-1]) == "comment" and len(cells) - 1 in row.widths
        worded = not _has_number(line, how) and not all(is_missing(cell) for cell in cells)
        if worded and line.widths & row.widths:
            above.append(line)
        elif worded and commented:
            above.append(line._replace(cells=cells[:-1]))
        elif not line.is_remark:
            break
    return above


def _separator(sample: list[str], how: Reading) -> str:
    """What splits the most lines in a row into equally many cells, at least two; blanks and decimal commas come last."""
    lines = [line for line in sample if line.strip()]
    sure = [separator for separator in SEPARATORS if separator != "," or not how.decimal_comma]
    runs = {separator: _run(lines, separator) for separator in sure}
    if any(runs.values()):
        return max(sure, key=lambda separator: runs[separator])
    blank = [line.split() for line in lines]
    spaced = any(len(cells) > 1 and all(is_number(cell, how.decimal_comma) for cell in cells) for cells in blank)
    return SPACES if spaced else ","


def _run(lines: list[str], separator: str) -> int:
    widths = (len(trimmed(split(line, separator))) for line in lines)
    return max((sum(1 for _ in same) for width, same in groupby(widths) if width > 1), default=0)
