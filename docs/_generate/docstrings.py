"""Docstrings in numpydoc's format: their sections, and the same as Markdown."""

import inspect
import re
from typing import NamedTuple

_HEAD = re.compile(r"^(\S.*)\n-{3,}$", re.MULTILINE)

LISTED = ("Parameters", "Attributes", "Returns", "Yields", "Raises", "Warns", "See Also")
"""Sections whose bodies are entries: a line of a name or a type, and what is said of it, indented."""


class Docstring(NamedTuple):
    """What stands before the first section, and the sections by title, as text."""

    summary: str
    sections: dict[str, str]


def read(thing: object) -> Docstring:
    """The docstring of an object, in parts."""
    text = inspect.getdoc(thing) or ""
    summary, *rest = _HEAD.split(text)
    return Docstring(summary.strip(), {rest[k]: rest[k + 1].strip("\n") for k in range(0, len(rest), 2)})


def documented(section: str) -> list[str]:
    """The names that a section of parameters documents, without stars; several may share an entry."""
    heads = [line for line in section.splitlines() if line and not line.startswith(" ")]
    return [name.strip(" *") for head in heads for name in head.partition(" : ")[0].split(",")]


def markdown(thing: object) -> str:
    """The docstring as Markdown: a page has one order of headings, so that titles of sections are bold."""
    summary, sections = read(thing)
    parts = [summary]
    for title, body in sections.items():
        shown = _entries(title, body) if title in LISTED else _code(body) if title == "Examples" else body
        parts.append(f"**{title}**\n\n{shown}")
    return "\n\n".join(parts)


def _entries(title: str, body: str) -> str:
    """Entries as a list: names in the face of code, then the type, then what is said."""
    lines: list[str] = []
    for line in body.splitlines():
        if line and not line.startswith(" "):
            name, _, kind = line.partition(" : ")
            names = ", ".join(f"``{one.strip()}``" for one in name.split(",")) if title != "Returns" else name
            lines.append(f"- {names}" + (f", {kind}" if kind else ""))
        else:
            lines.append(f"  {line.strip()}".rstrip())
    return "\n".join(lines)


def _code(body: str) -> str:
    """Examples with their sessions fenced, prose as it is."""
    blocks = re.split(r"\n\s*\n", body)
    return "\n\n".join(f"```pycon\n{block}\n```" if block.lstrip().startswith(">>>") else block for block in blocks)
