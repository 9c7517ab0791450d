"""Tables of docs; the best value of a column is bold among rows whose controllers are told the same."""

import re
from collections.abc import Container, Hashable, Sequence

import numpy as np

from baselines.bench.statistics import number


def markdown(
    rows: Sequence[Sequence[str]], least: Container[str] = (), most: Container[str] = (), alike: Sequence[Hashable] = ()
) -> str:
    """A table whose first row is its head.

    Of the columns ``least`` and ``most``, named by their heads, the smallest and the largest value is bold. A cell's first
    figure counts, among rows of the same key in ``alike``, which has one a row and is empty where all are alike.
    """
    head, cells = rows[0], [list(row) for row in rows[1:]]
    keys = list(alike) or [()] * len(cells)
    for column, name in enumerate(head):
        if name in least or name in most:
            for key in dict.fromkeys(keys):
                _mark(cells, column, [k for k, own in enumerate(keys) if own == key], name in most)
    lines = ["| " + " | ".join(row) + " |" for row in (head, *cells)]
    return "\n".join([lines[0], "|" + "---|" * len(head), *lines[1:]])


def _mark(cells: list[list[str]], column: int, rows: list[int], most: bool) -> None:
    """Bold in the best of ``rows`` the first figure of a column, unless all are as good."""
    found = [re.match(r"-?\d[\d.]*(e[+-]?\d+)?", cells[row][column]) for row in rows]
    values = np.array([float(one[0]) if one else -np.inf if most else np.inf for one in found])
    best = values.max() if most else values.min()
    if np.isfinite(best) and not (values == best).all():
        for row in np.array(rows)[values == best]:
            cells[row][column] = re.sub(r"^\S*[^\s,;]", r"**\g<0>**", cells[row][column])


def cells(values: Sequence[float | str], between: str = ", ") -> str:
    """Figures of a result, in which a lost one is a word, side by side."""
    return between.join(value if isinstance(value, str) else number(value) for value in values)
