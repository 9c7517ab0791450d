"""Tables of docs: one statistic a column, three digits, and in bold the best of a column among rows that are told the same."""

import math
import re
from collections.abc import Container, Hashable, Sequence
from typing import NamedTuple

import numpy as np

WIDEST = 13
"""Columns of a table; what has more becomes several tables, each with the columns before the first ``Head``."""

SMALL = 1e-3
"""What is smaller in size says in a table only that it is."""


class Head(NamedTuple):
    """The head of columns side by side: a ``quantity`` with its unit, of which each column has one of ``statistics``."""

    quantity: str
    statistics: tuple[str, ...]


SPREAD, SPREAD_AND_WORST = ("median", "95 %"), ("median", "95 %", "worst")
"""Statistics of many tables; 95 % is the 95th percentile."""

Cell = str | float | Sequence[str | float]
"""What stands below a head: words or a number, or, below a ``Head``, one for each statistic, or words that hold for all."""


def markdown(
    rows: Sequence[Sequence[Cell | Head]],
    least: Container[object] = (),
    most: Container[object] = (),
    alike: Sequence[Hashable] = (),
) -> str:
    """A table whose first row is its head, or several below one another where it has more than ``WIDEST`` columns.

    Of the columns ``least`` and ``most``, named by their heads, the smallest and the largest value is bold, of a ``Head`` its
    first statistic. Rows compete with those of the same key in ``alike``, which has one a row and is empty where all are alike.
    """
    heads = [head if isinstance(head, Head) else str(head) for head in rows[0]]
    columns = [_columns(head, [row[k] for row in rows[1:]]) for k, head in enumerate(heads)]
    keys = list(alike) or [()] * (len(rows) - 1)
    for head, (first, *_) in zip(heads, columns, strict=True):
        if head in least or head in most:
            for key in dict.fromkeys(keys):
                _mark(first, [k for k, own in enumerate(keys, 1) if own == key], head in most)
    tables = _side_by_side(columns, next((k for k, head in enumerate(heads) if isinstance(head, Head)), len(heads)))
    return "\n\n".join(_lines(table) for table in tables)


def digits(value: float | str) -> str:
    """A number in three significant digits and without an exponent; words as they are, "lost" for infinity, "-" for nothing."""
    if isinstance(value, str):
        return value
    if math.isnan(value):
        return "-"
    if math.isinf(value):
        return "lost"
    if value == 0.0:
        return "0"
    if abs(value) < SMALL:
        return f"<{SMALL:g}" if value > 0.0 else f">-{SMALL:g}"
    rounded, exponent = float(f"{value:.2e}"), int(f"{value:.2e}".partition("e")[2])
    return f"{rounded:,.{max(2 - exponent, 0)}f}"


def _columns(head: str | Head, cells: list[Cell | Head]) -> list[list[str]]:
    """The columns below a head, each with its own head first."""
    if isinstance(head, str):
        return [[head, *(digits(cell) if isinstance(cell, str | float | int) else _several(cell, 1)[0] for cell in cells)]]
    each = [_several(cell, len(head.statistics)) for cell in cells]
    return [[f"{head.quantity}: {name}", *(cell[k] for cell in each)] for k, name in enumerate(head.statistics)]


def _several(cell: Cell | Head, count: int) -> list[str]:
    values = [cell] * count if isinstance(cell, str | float | int) else list(cell)
    if len(values) != count:
        raise ValueError(f"{len(values)} entries {values}; allowed: {count}, one below each statistic")
    return [digits(value) for value in values]  # type: ignore[arg-type]


def _side_by_side(columns: list[list[list[str]]], own: int) -> list[list[list[str]]]:
    """The columns as tables of at most ``WIDEST``, which all begin with the first ``own``; those of a head stay together."""
    known, others = [one for group in columns[:own] for one in group], columns[own:]
    tables, room = [list(known)], WIDEST - len(known)
    for group in others:
        if len(tables[-1]) > len(known) and len(tables[-1]) - len(known) + len(group) > room:
            tables.append(list(known))
        tables[-1] += group
    return tables


def _lines(columns: list[list[str]]) -> str:
    lines = ["| " + " | ".join(row) + " |" for row in zip(*columns, strict=True)]
    return "\n".join([lines[0], "|" + "---|" * len(columns), *lines[1:]])


def _mark(column: list[str], rows: list[int], most: bool) -> None:
    """Bold in the best of ``rows`` the first number of a column, unless all are as good."""
    found = [re.match(r"<?(-?\d[\d,]*(?:\.\d+)?(?:e[+-]?\d+)?)", column[row]) for row in rows]
    values = np.array([float(one[1].replace(",", "")) if one else -np.inf if most else np.inf for one in found])
    best = values.max() if most else values.min()
    if np.isfinite(best) and not (values == best).all():
        for row in np.array(rows)[values == best]:
            column[row] = re.sub(r"^\S*[^\s,;]", r"**\g<0>**", column[row])
