"""Tables in Markdown, and text that a click unfolds."""

import re
from collections.abc import Iterable, Sequence


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table with a heading and rows of cells."""
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *rows))


def folded(title: str, body: str) -> str:
    """Text that a click unfolds; HTML needs the marks of Markdown in its title written out."""
    shown = re.sub(r"`([^`]*)`", r"<code>\1</code>", title)
    return f"<details><summary>{shown}</summary>\n\n{body}\n\n</details>"
