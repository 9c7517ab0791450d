"""The project's own files that a source file depends on: imports are read as text, and nothing is run."""

import hashlib
import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
PACKAGES = ("birthsim", "birthsim_env", "baselines", "agents", "birthsim_build", "birthsim_live", "studies")

_LINE = r"(?:[^\n;\\]|\\\n)*"
_IMPORT = re.compile(
    rf"(?:^|[;:])[ \t]*(?:from[ \t]+([\w.]+)[ \t]+import[ \t]*(\([^)]*\)|{_LINE})|import[ \t]+({_LINE}))", re.MULTILINE
)
"""An import statement, once comments and new names are gone: syntax trees would take longer than all the rest of an import."""

_NAMED = re.compile(r"""(["'])([A-Za-z_][\w.]*)(?::\w+)?\1""")
"""A string that may name a module, as in "package.module:name"."""


def file_of(module: str) -> Path | None:
    """The source file of one of this project's modules, or None."""
    place = ROOT.joinpath(*module.split("."))
    found = (path for path in (place.with_suffix(".py"), place / "__init__.py") if path.is_file())
    return next(found, None) if module.split(".")[0] in PACKAGES else None


@cache
def imports(path: Path, named: bool = False) -> frozenset[Path]:
    """The files that a source file imports anywhere in it, and those of modules that its strings name."""
    files: set[Path | None] = set()
    text = path.read_text(encoding="utf-8")
    for module, names, modules in _IMPORT.findall(re.sub(r"#[^\n]*|\bas[ \t]+\w+", "", text)):
        files.update(file_of(word) for word in re.findall(r"[\w.]+", modules))
        # What is no module of its own stands in the one that it is imported from.
        files.update(file_of(f"{module}.{name}") or file_of(module) for name in re.findall(r"\w+", names))
    if named:
        files.update(file_of(word) for _, word in _NAMED.findall(text))
    return frozenset(file for file in files if file)


def dependencies(paths: Iterable[Path], named: bool = False) -> list[Path]:
    """Source files and all that they import, directly or not, sorted; ``named`` counts modules that a string names too."""
    waiting = list(paths)
    seen = set(waiting)
    while waiting:
        found = imports(waiting.pop(), named) - seen
        seen |= found
        waiting += found
    return sorted(seen)


@cache
def source_stamp(path: Path) -> str:
    """SHA-256 of a source file and of every file of this project that it imports, directly or not."""
    digest = hashlib.sha256()
    for file in dependencies([path]):
        # A user's own kernel may lie anywhere.
        digest.update(str(file.relative_to(ROOT) if file.is_relative_to(ROOT) else file).encode() + file.read_bytes())
    return digest.hexdigest()


def hashes(*modules: str) -> dict[str, str]:
    """Path from the root to SHA-256 of each file that ``modules`` depend on, by imports or by names in strings.

    Weights of policies and other data do not count.
    """
    files = dependencies([file for module in modules if (file := file_of(module))], named=True)
    return {file.relative_to(ROOT).as_posix(): _hash(file) for file in files}


@cache
def _hash(file: Path) -> str:
    """Of a file as this process finds it at first."""
    return hashlib.sha256(file.read_bytes()).hexdigest()
