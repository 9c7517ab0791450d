"""Tables in files of text: CSV, whatever separates the cells, and what loggers write before it."""

import csv
from array import array

import numpy as np

from birthsim_env.physics.rig.values import in_line, problem, shown
from birthsim_env.registry import register
from birthsim_env.tables.cells import Cells, is_missing, is_number, why
from birthsim_env.tables.encoding import encoding_and_note, lines_of
from birthsim_env.tables.layout import Layout, is_remark, layout_of, split, trimmed
from birthsim_env.tables.table import Raw, Reading, Table, table_of


@register(reader=".csv", about="Text: cells between commas, semicolons, tabs, bars or blanks.", order=1)
@register(reader=".tsv", about="Text, as .csv.", order=5)
@register(reader=".txt", about="Text, as .csv.", order=6)
@register(reader=".lvm", about="Text with LabVIEW's block before it, as .csv.", order=7)
def read_text_file(source: str, content: bytes, how: Reading) -> Table:
    """The table of a file of text; ``ValueError`` names the file, the line and what is allowed."""
    if not content.strip(b"\0 \r\n\t\xef\xbb\xbf\xff\xfe"):
        raise ValueError(f"{source} is empty; allowed: a line of names, then lines of numbers")
    encoding, note = encoding_and_note(source, content)
    try:
        layout = layout_of(lines_of(content, encoding), how)
        rows = _Rows(source, layout, how)
        for number, line in enumerate(lines_of(content, encoding), start=1):
            # Line by line: no number has an end of a line in it, and an open quote would gather all lines that follow.
            if number > layout.begin and not is_remark(line):
                rows.take(number, line)
    except UnicodeDecodeError as error:
        raise ValueError(f"{source} is no CSV: damaged {encoding} text ({error.reason}); allowed: text in UTF-8") from error
    except csv.Error as error:
        raise ValueError(f"{source} is no CSV ({problem(error)}); allowed: lines of numbers") from error
    notes = [note] if note else []
    if layout.before and how.skip is None:
        notes.append(
            f"{source}: the heading is line {layout.heading}; other lines before the numbers are left out: {layout.before}"
        )
    return rows.table(notes)


class _Rows:
    """Numbers, row by row, and what is wrong with a column."""

    def __init__(self, source: str, layout: Layout, how: Reading) -> None:
        self._source, self._layout, self._how = source, layout, how
        self._names = trimmed(layout.names)
        self._width = len(self._names)
        self._cells: list[Cells] = []
        self._clocks = False
        self._numbers, self._lines = array("d"), array("q")

    def take(self, number: int, line: str) -> None:
        """Add the row of a line; ``ValueError`` where it has not as many cells as the heading."""
        cells = split(line, self._layout.separator)
        if not any(cells):
            return
        if not self._cells:
            self._width = self._width or len(trimmed(cells))
            self._cells = [Cells(self._how) for _ in range(self._width)]
        if len(cells) > self._width:
            cells = [*cells[: self._width], *trimmed(cells[self._width :])]
        if len(cells) != self._width:
            self._refuse(number, line)
        self._numbers.extend(self._row(number, line, cells))
        self._lines.append(number)
        self._how.check_size(self._source, len(self._numbers))

    def _row(self, number: int, line: str, cells: list[str]) -> list[float]:
        if not self._clocks and "_" not in line and not self._how.decimal_comma:
            try:
                return [float(cell) for cell in cells]
            except ValueError:
                pass
        row, where = len(self._lines), f"line {number}"
        found = [column.read(cell, row, where) for column, cell in zip(self._cells, cells, strict=True)]
        self._clocks = self._clocks or (row == 0 and any(column.is_clock for column in self._cells))
        return found

    def _refuse(self, number: int, line: str) -> None:
        words = f"{self._width} numbers"
        if self._names:
            words += f", for {in_line(', '.join(self._names))} (line {self._layout.heading})"
        if self._how.has_options:
            words += ", or --skip LINES where the heading is another line"
        cells = split(line, self._layout.separator)
        odd = next((cell for cell in cells if not (is_missing(cell) or is_number(cell, self._how.decimal_comma))), "")
        cause = f"; of {shown(odd[:60])}{said.replace('; ', ': ', 1)}" if (said := why(odd, self._how)) else ""
        raise ValueError(f"{self._source}, line {number}: {shown(line.rstrip())}; allowed: {words}{cause}")

    def table(self, notes: list[str]) -> Table:
        """All rows that were taken."""
        if not self._width:
            raise ValueError(f"{self._source} has no lines of numbers; allowed: a line of names, then lines of numbers")
        values = np.frombuffer(self._numbers).reshape(-1, self._width).T if self._numbers else np.empty((self._width, 0))
        names = self._names or [f"column {place + 1}" for place in range(self._width)]
        units = [*self._layout.units, *[""] * self._width][: self._width]
        cells = self._cells or [Cells() for _ in names]
        raw = [
            Raw(name, column, unit, read.fault, read.is_clock)
            for name, column, unit, read in zip(names, values, units, cells, strict=True)
        ]
        return table_of(self._source, raw, notes, np.frombuffer(self._lines, dtype=np.int64), bool(self._names))
