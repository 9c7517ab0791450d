"""Tables as commands print them."""

import re
from collections.abc import Sequence


def aligned(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table: words to the left, numbers with their decimal points one below the other, two spaces between columns."""
    columns = []
    for title, *column in zip(head, *rows, strict=True):
        whole = [re.match(r"-?[\d,]+", text) for text in column]
        if all(whole):
            widest = max(len(found[0]) for found in whole if found)
            column = [" " * (widest - len(found[0])) + text for found, text in zip(whole, column, strict=True) if found]
            longest = max(map(len, column))
            column = [text.ljust(longest) for text in column]
        width = max(map(len, (title, *column)))
        columns.append([text.rjust(width) if all(whole) else text.ljust(width) for text in (title, *column)])
    return "\n".join("  ".join(line).rstrip() for line in zip(*columns, strict=True))


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """The same table in Markdown."""
    return "\n".join(f"| {' | '.join(line)} |" for line in (head, ["---"] * len(head), *rows))
