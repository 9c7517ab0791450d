"""The project's own files that a source file depends on, and hashes of their code: what Python compiles of them, unless it is
prose. Nothing is run.

Comments, layout, strings that stand alone and ``from __future__ import annotations`` count for nothing. To read a syntax tree
takes longer than all the rest of an import, so what was found is kept beside the machine code, under a hash of the file.
"""

import ast
import hashlib
import json
import re
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from birthsim_env.physics.compiled.kept import cache_folder, keep, kept

ROOT = Path(__file__).resolve().parents[3]
PACKAGES = ("birthsim", "birthsim_env", "baselines", "agents", "birthsim_build", "birthsim_live", "lab")

_NAMED = re.compile(r"([A-Za-z_]\w*(?:\.\w+)+)(?::\w+)?")
"""A string that may name a module, as in "package.module:name"."""


class Source(NamedTuple):
    """What a file holds: the SHA-256 of its code, and names of this project's modules, of which those count that are files.

    ``imported`` has names in groups, of which the first that is one counts: what is no module of its own stands in the one that
    it is imported from. ``named`` are those in strings.
    """

    code: str
    imported: list[list[str]]
    named: list[str]


def file_of(module: str) -> Path | None:
    """The source file of one of this project's modules, or None."""
    place = ROOT.joinpath(*module.split("."))
    found = (path for path in (place.with_suffix(".py"), place / "__init__.py") if path.is_file())
    return next(found, None) if _ours(module) else None


@cache
def source(path: Path) -> Source:
    """What a source file holds, as this process finds it at first."""
    content, folder = path.read_bytes(), cache_folder()
    if folder is None:
        return _read(content)
    place = hashlib.sha256(str(path).encode()).hexdigest()[:8]
    found = hashlib.sha256(Path(__file__).read_bytes() + content).hexdigest()[:16]
    file = folder / f"{path.stem}_{place}-{found}.code"
    if (held := kept(file)) is not None:
        return Source(*json.loads(held))
    read = _read(content)
    keep(file, json.dumps(read).encode())
    return read


@cache
def imports(path: Path, named: bool = False) -> frozenset[Path]:
    """The files that a source file imports anywhere in it, and those of modules that its strings name.

    A string that names a module of a later package counts for nothing: what uses it there imports it.
    """
    found, own = source(path), path.relative_to(ROOT).parts[0] if path.is_relative_to(ROOT) else ""
    known = PACKAGES[: PACKAGES.index(own) + 1] if own in PACKAGES else PACKAGES
    by_name = ([one] for one in found.named if one.partition(".")[0] in known)
    groups = [*found.imported, *by_name] if named else found.imported
    return frozenset(file for group in groups if (file := next(filter(None, map(file_of, group)), None)))


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
    """SHA-256 of the code of a source file and of every file of this project that it imports, directly or not."""
    digest = hashlib.sha256()
    for file in dependencies([path]):
        # A user's own kernel may lie anywhere.
        place = str(file.relative_to(ROOT) if file.is_relative_to(ROOT) else file)
        digest.update(f"{place}{source(file).code}".encode())
    return digest.hexdigest()


def hashes(*modules: str) -> dict[str, str]:
    """Path from the root to SHA-256 of the code of each file that ``modules`` depend on, by imports or by names in strings.

    Weights of policies and other data do not count.
    """
    files = dependencies([file for module in modules if (file := file_of(module))], named=True)
    return {file.relative_to(ROOT).as_posix(): source(file).code for file in files}


def _ours(module: str) -> bool:
    return module.partition(".")[0] in PACKAGES


def _read(content: bytes) -> Source:
    """Walk the syntax tree: types of nodes with the names of their fields, lengths of lists and values, in order."""
    digest, imported, named, waiting = hashlib.sha256(), list[list[str]](), set[str](), list[Any]([ast.parse(content)])
    while waiting:
        one = waiting.pop()
        if isinstance(one, ast.AST):
            fields = [(name, value) for name, value in ast.iter_fields(one) if value not in (None, []) and name != "kind"]
            said = f"{type(one).__name__} {' '.join(name for name, _ in fields)}"
            waiting += [value for _, value in reversed(fields)]
            imported += _imported(one)
            if isinstance(one, ast.Constant) and (name := _NAMED.fullmatch(str(one.value))) and _ours(name[1]):
                named.add(name[1])
        elif isinstance(one, list):
            code = [part for part in one if not _is_prose(part)]
            said = f"{len(code)}"
            waiting += reversed(code)
        else:
            said = repr(one)
        digest.update(f"{said}\n".encode())
    return Source(digest.hexdigest(), imported, sorted(named))


def _is_prose(part: Any) -> bool:
    """Whether a statement, if it is one, is a string that stands alone, or only asks for annotations that are not evaluated."""
    if isinstance(part, ast.Expr):
        return isinstance(part.value, ast.Constant) and isinstance(part.value.value, str)
    return (
        isinstance(part, ast.ImportFrom)
        and part.module == "__future__"
        and [name.name for name in part.names] == ["annotations"]
    )


def _imported(node: ast.AST) -> Iterator[list[str]]:
    """The groups of names that a statement imports."""
    if isinstance(node, ast.Import):
        yield from ([name.name] for name in node.names if _ours(name.name))
    elif isinstance(node, ast.ImportFrom) and node.module and _ours(node.module):
        yield from ([f"{node.module}.{name.name}", node.module] for name in node.names)
