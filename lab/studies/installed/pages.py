"""The commands that pages show, in their order."""

import re
import shlex
from pathlib import Path

from birthsim_env.physics.compiled.sources import ROOT

_FENCED = re.compile(r"^(`{3,})([^\n]*)\n(.*?)^\1`*[ \t]*$", re.DOTALL | re.MULTILINE)
_BEGINS = ("birthsim ", "python examples/")
_ANOTHER = ("birthsim study ",)
"""What needs a clone."""


def pages() -> list[Path]:
    """README, and the pages of the site. Tutorials are left out: building the site, or a test, runs them."""
    found = sorted((ROOT / "docs").rglob("*.md"))
    return [ROOT / "README.md", *(page for page in found if page.parent.name not in ("tutorials", "data"))]


def commands(text: str) -> list[list[str]]:
    """The arguments of every command in indented and unnamed blocks, without comments; a line may hold two, joined by &&."""
    fenced = [block for _, language, block in _FENCED.findall(text) if not language.strip()]
    indented = re.findall(r"^(?: {4}[^\n]*\n)+", _FENCED.sub("", text), re.MULTILINE)
    lines = [line.strip() for block in [*indented, *fenced] for line in block.replace("\\\n", " ").splitlines()]
    said = [one.strip() for line in lines for one in line.split("&&")]
    return [shlex.split(one, comments=True) for one in said if one.startswith(_BEGINS) and not one.startswith(_ANOTHER)]


def python(text: str) -> list[str]:
    """Its blocks of Python."""
    return [block for _, language, block in _FENCED.findall(text) if language.strip() == "python"]
