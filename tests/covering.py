"""Products of which every commit tries a covering subset, and the weekly run the rest."""

import pytest


def thinned(rows, columns, always=1):
    """All pairs of a row and a column; those that a commit leaves out are marked weekly.

    It tries each row with the first ``always`` columns, and with one of the others, in turn: what a column brings into a loop
    meets several rows, and what a row brings meets ``always + 1`` columns.

    Returns
    -------
    list of (row, column, marks)
    """
    kept, others = columns[:always], columns[always:]
    turns = {row: others[k % len(others)] for k, row in enumerate(rows)}
    return [
        (row, column, () if column in kept or column == turns[row] else (pytest.mark.weekly,))
        for row in rows
        for column in columns
    ]
