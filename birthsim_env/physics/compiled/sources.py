"""The project's own files that a source file depends on, and hashes of their code: what Python compiles of them, unless it is
prose. Nothing is run.

Comments, layout, strings that stand alone and ``from __future__ import annotations`` count for nothing. To read a syntax tree
takes longer than all the rest of an import, so what was found is kept beside the machine code, under a hash of the file.
"""

import ast
import contextlib
import hashlib
import json
import os
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

from birthsim_env.physics.compiled.kept import PACKAGE, cache_folder, keep, kept

ROOT = Path(__file__).resolve().parents[3]
PACKAGES = ("birthsim", "birthsim_env", "baselines", "agents", "birthsim_build", "birthsim_drive", "birthsim_live", "lab")


ASIDE = frozenset(Path(__file__).resolve().with_name(f"{name}.py") for name in ("kept", "prebuilt", "sources"))
"""What finds machine code, and has no part in making it."""


class Source(NamedTuple):
    """What a file holds: the SHA-256 of its code, and names of this project's modules, of which those count that are files.

    ``imported`` has names in groups, of which the first that is one counts: what is no module of its own stands in the one that
    it is imported from.
    """

    code: str
    imported: list[list[str]]


def file_of(module: str) -> Path | None:
    """The source file of one of this project's modules, or None."""
    place = ROOT.joinpath(*module.split("."))
    found = (path for path in (place.with_suffix(".py"), place / "__init__.py") if os.path.isfile(path))
    return next(found, None) if is_ours(module) else None


@cache
def source(path: Path) -> Source:
    """What a source file holds, as this process finds it at first."""
    content = path.read_bytes()
    known = _prebuilt().get(place_of(content))
    return Source(*(known or remembered(path, content, "code", _read, Path(__file__))))


@cache
def _prebuilt() -> dict[str, Any]:
    """What the files hold that prebuilt code was made from."""
    with contextlib.suppress(OSError, ValueError):
        found: dict[str, Any] = json.loads((PACKAGE / "prebuilt" / "sources.json").read_bytes())
        return found
    return {}


def place_of(content: bytes, readers: Iterable[Path] = (Path(__file__),)) -> str:
    """What names the content of a file and the code of those who read it."""
    return hashlib.sha256(b"".join(own.read_bytes() for own in readers) + content).hexdigest()[:16]


def remembered(path: Path, content: bytes, kind: str, read: Callable[[bytes], Any], *readers: Path) -> Any:
    """What ``read`` makes of a file's content, as JSON; kept on disk under that and the content of ``readers``, its code."""
    folder = cache_folder()
    if folder is None:
        return read(content)
    place = hashlib.sha256(str(path).encode()).hexdigest()[:8]
    file = folder / f"{path.stem}_{place}-{place_of(content, readers)}.{kind}"
    if (held := kept(file)) is not None:
        return json.loads(held)
    made = read(content)
    keep(file, json.dumps(made).encode())
    return made


@cache
def imports(path: Path) -> frozenset[Path]:
    """The files that a source file imports anywhere in it."""
    groups = source(path).imported
    return frozenset(file for group in groups if (file := next(filter(None, map(file_of, group)), None)))


def dependencies(paths: Iterable[Path], aside: frozenset[Path] = frozenset()) -> list[Path]:
    """Source files and all that they import, directly or not, sorted; without files that stand ``aside``."""
    waiting = list(paths)
    seen = set(waiting)
    while waiting:
        found = imports(waiting.pop()) - seen - aside
        seen |= found
        waiting += found
    return sorted(seen)


def files_of(*packages: str) -> list[Path]:
    """The Python files of packages of this project, sorted.

    What is kept beside them in ``__pycache__`` comes and goes meanwhile, so that nobody looks in there."""
    found = list[Path]()
    for package in packages:
        for folder, below, files in os.walk(ROOT / package):
            below[:] = [name for name in below if name != "__pycache__"]
            found += [Path(folder, name) for name in files if name.endswith(".py")]
    return sorted(found)


@cache
def source_stamp(path: Path) -> str:
    """SHA-256 of the code of a source file and of every file of this project that it imports, directly or not."""
    digest = hashlib.sha256()
    for place, file in sorted((_place(file), file) for file in dependencies([path], ASIDE)):
        digest.update(f"{place}{source(file).code}".encode())
    return digest.hexdigest()


def _place(file: Path) -> PurePosixPath:
    """Where a file stands on any machine: a user's own may lie anywhere, generated source where machine code is kept."""
    ours = file.suffix == ".py" and file.is_relative_to(ROOT)
    return PurePosixPath(file.relative_to(ROOT) if ours else file.name)


def stamp_of(function: Any) -> str:
    """What the machine code of a kernel depends on: its sources, and the text of a module that ran generated source."""
    text = source_stamp(Path(function.__code__.co_filename).resolve()) + function.__globals__.get("GENERATED", "")
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def is_ours(module: str) -> bool:
    """Whether a name is that of one of this project's packages, or of what stands below it."""
    return module.partition(".")[0] in PACKAGES


def _read(content: bytes) -> Source:
    digest, imported = hashlib.sha256(), list[list[str]]()
    for one, said in walk(ast.parse(content)):
        digest.update(f"{said}\n".encode())
        if isinstance(one, ast.AST):
            imported += _imported(one)
    return Source(digest.hexdigest(), imported)


def walk(tree: ast.AST | list[Any]) -> Iterator[tuple[Any, str]]:
    """What a syntax tree consists of but for prose, in order: nodes, lists and values, and for each what of it is code.

    That is the type of a node with the names of its fields, the length of a list, and a value itself.
    """
    waiting: list[Any] = [tree]
    while waiting:
        one = waiting.pop()
        if isinstance(one, ast.AST):
            fields = [(name, value) for name, value in ast.iter_fields(one) if value not in (None, []) and name != "kind"]
            yield one, f"{type(one).__name__} {' '.join(name for name, _ in fields)}"
            waiting += [value for _, value in reversed(fields)]
        elif isinstance(one, list):
            code = [part for part in one if not is_prose(part)]
            yield one, f"{len(code)}"
            waiting += reversed(code)
        else:
            yield one, repr(one)


def is_prose(part: Any) -> bool:
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
        yield from ([name.name] for name in node.names if is_ours(name.name))
    elif isinstance(node, ast.ImportFrom) and node.module and is_ours(node.module):
        yield from ([f"{node.module}.{name.name}", node.module] for name in node.names)
