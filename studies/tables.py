"""Tables of docs."""

from collections.abc import Sequence

from baselines.bench.statistics import number


def markdown(rows: Sequence[Sequence[str]]) -> str:
    """A table whose first row is its head."""
    lines = ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join([lines[0], "|" + "---|" * len(rows[0]), *lines[1:]])


def cells(values: Sequence[float | str]) -> str:
    """Figures of a result, in which a lost one is a word, side by side."""
    return ", ".join(value if isinstance(value, str) else number(value) for value in values)
