"""What a stored measurement was measured on: hashes of sources by what they do, and whether they are still the same."""

import ast
import hashlib
import json
import subprocess
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from birthsim_env.files import write_text
from birthsim_env.physics.rig.json_reading import read_json

ROOT = Path(__file__).resolve().parents[3]
MEASURED = Path(__file__).parent / "measured"
"""Folder of the stored measurements, one JSON file each."""


def digest(path: Path) -> str:
    """Hash of a Python file by what it does: comments, docstrings and layout do not count."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    node: Any
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):  # a string that stands alone says something to the reader only
            node.body = [part for part in body if not (isinstance(part, ast.Expr) and isinstance(part.value, ast.Constant))]
    return hashlib.sha256(ast.dump(tree).encode()).hexdigest()[:16]


def digests(paths: Iterable[str]) -> dict[str, str]:
    """Path from the root -> ``digest``, in order; of a file that there is not, an empty one."""
    return {path: digest(ROOT / path) if (ROOT / path).is_file() else "" for path in sorted(set(paths))}


def changed(stored: dict[str, str]) -> list[str]:
    """Files that do something else now than when they were measured."""
    return [path for path, now in digests(stored).items() if now != stored[path]]


def path_of(module: str) -> str:
    """Path of a module of this project from the root."""
    return module.replace(".", "/") + ".py"


def commit() -> str:
    """Short name of the commit that is checked out, marked where sources differ from it; measurements are none."""

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False).stdout.strip()

    differing = git("status", "--porcelain", "--", ".", ":!lab/studies/verification/measured", ":!docs")
    return (git("rev-parse", "--short", "HEAD") or "unknown") + (", changed" if differing else "")


def load(name: str) -> dict[str, Any]:
    """A stored measurement by its name."""
    content: dict[str, Any] = read_json("measured", MEASURED / f"{name}.json", dict)
    return content


def keep(name: str, content: dict[str, Any]) -> None:
    """Store a measurement under its name."""
    write_text(MEASURED / f"{name}.json", json.dumps(content, indent=1) + "\n")


def defined(path: Path) -> set[str]:
    """Names of functions, classes and constants that a file defines at its top or in a class."""
    names: set[str] = set()
    waiting: list[ast.stmt] = list(ast.parse(path.read_text(encoding="utf-8")).body) if path.is_file() else []
    for node in waiting:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            names.add(node.name)
            waiting += node.body if isinstance(node, ast.ClassDef) else []
        elif isinstance(node, (ast.Assign, ast.AnnAssign)):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names.update(target.id for target in targets if isinstance(target, ast.Name))
    return names
