"""Folders and files that appear whole or not at all."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO


def make_folder(path: Path) -> Path:
    """The folder ``path``, made if it is missing; ``ValueError`` where that cannot be."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise ValueError(f"--out {str(path)!r} is a file; allowed: a folder, or a name for a new one") from None
    except OSError as error:
        raise ValueError(f"--out {str(path)!r} cannot be made ({error.strerror}); allowed: a folder to write to") from error
    return path


@contextmanager
def whole_file(path: Path) -> Iterator[BinaryIO]:
    """A binary file to write to, which becomes ``path`` at the end; nothing of it stays where something is raised."""
    partial = path.with_name(f"{path.name}.partial")
    try:
        with partial.open("wb") as file:
            yield file
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write text as a whole or not at all."""
    with whole_file(path) as file:
        file.write(text.encode())


def write_json(path: Path, content: Any) -> None:
    """Write JSON as a whole or not at all; a number that is not finite becomes null, for which JSON has no other word."""
    write_text(path, json.dumps(finite(content), indent=1, allow_nan=False))


def finite(content: Any) -> Any:
    """``content`` with None for every number that is not finite, at any depth."""
    if isinstance(content, dict):
        return {name: finite(value) for name, value in content.items()}
    if isinstance(content, (list, tuple)):
        return [finite(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content
