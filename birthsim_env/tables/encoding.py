"""Text of tables: UTF-8, UTF-16 and UTF-32 by their marks, else what Windows wrote."""

import csv
import io
from collections.abc import Iterator

from birthsim_env.physics.rig.reading import encoding_of
from birthsim_env.tables.table import LONGEST


def encoding_and_note(source: str, content: bytes) -> tuple[str, str]:
    """Python's name of the encoding of a file of text, and what there is to say of it; ``ValueError`` where it is none."""
    said = encoding_of(content)
    if said in ("UTF-8", "UTF-16", "UTF-32"):
        return {"UTF-8": "utf-8-sig", "UTF-16": "utf-16", "UTF-32": "utf-32"}[said], ""
    if said == "Windows-1252":
        return "cp1252", f"{source} is in no UTF-8; it is read as Windows-1252"
    raise ValueError(f"{source} is in {said}; allowed: text in UTF-8, or in UTF-16 with a byte-order mark")


def lines_of(content: bytes, encoding: str) -> Iterator[str]:
    """Lines of a text, one at a time; ``csv.Error`` for one that is too long, ``UnicodeDecodeError`` in damaged text."""
    text = io.TextIOWrapper(io.BytesIO(content), encoding, newline=None)
    while line := text.readline(LONGEST + 1):
        if len(line) > LONGEST:
            raise csv.Error(f"a line is longer than allowed: at most {LONGEST} characters")
        yield line
