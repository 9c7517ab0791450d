"""The files that a module depends on: imports followed without running anything, and their hashes."""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("birthsim", "birthsim_env", "baselines", "agents", "birthsim_build", "birthsim_live", "studies")


def hashes(*modules: str) -> dict[str, str]:
    """Path from the root to SHA-256, sorted by path, of each Python file that ``modules`` import, they themselves too.

    A module that a string names ("package.module:name") counts as imported; weights of policies and other data do not count.
    """
    waiting, found = [*modules], dict[str, str]()
    while waiting:
        file = _file(waiting.pop())
        if file is None or (path := file.relative_to(ROOT).as_posix()) in found:
            continue
        found[path], named = _read(file)
        waiting += named
    return dict(sorted(found.items()))


@cache
def _read(file: Path) -> tuple[str, list[str]]:
    """SHA-256 of a file as this process finds it at first, and the modules that it names."""
    text = file.read_bytes()
    return hashlib.sha256(text).hexdigest(), list(_named(ast.parse(text), file))


def _named(tree: ast.AST, file: Path) -> Iterator[str]:
    package = file.parent.relative_to(ROOT).parts
    for node in ast.walk(tree):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else ()
            base = ".".join((*above, *filter(None, [node.module])))
            names = [base, *(f"{base}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            names = [node.value.partition(":")[0]]
        for name in names:
            parts = name.split(".")
            if parts[0] in PACKAGES and all(part.isidentifier() for part in parts):
                yield from (".".join(parts[:length]) for length in range(1, len(parts) + 1))


def _file(module: str) -> Path | None:
    path = ROOT.joinpath(*module.split("."))
    return next((file for file in (path.with_suffix(".py"), path / "__init__.py") if file.is_file()), None)
