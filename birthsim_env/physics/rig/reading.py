"""Files that a user wrote: read whole where they are small, refused by name where they are not what they should be."""

import json
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

LARGEST = 4 * 2**20
"""Bytes of a file of settings or numbers; a rig takes 2 kB, an hour of a trajectory at 10 ms 8 MB less its digits."""


def named(path: str | Path) -> str:
    """A path as errors name it; of one that is longer than any name, the end."""
    text = str(path)
    return repr(text if len(text) <= 200 else f"... {text[-80:]}")


def read(name: str, path: str | Path, most: int = LARGEST) -> bytes:
    """The content of a file of at most ``most`` bytes; ``ValueError`` begins with ``name``, the argument that says the path."""
    try:
        with open(path, "rb") as file:
            content = file.read(most + 1)
    except OSError as error:
        raise ValueError(f"{name} = {named(path)} cannot be read: {error.strerror or error}; allowed: a file") from error
    except ValueError as error:  # a zero byte
        raise ValueError(f"{name} = {named(path)} cannot be read: {error}; allowed: a file") from None
    if len(content) > most:
        raise ValueError(f"{name} = {named(path)} is larger than allowed: at most {most} bytes")
    return content


def read_toml(name: str, path: str | Path) -> dict[str, Any]:
    """The tables of a TOML file; ``ValueError`` names ``name`` and the file."""
    content = read(name, path)
    tables: dict[str, Any] = _parsed(f"{name} = {named(path)} is no TOML", lambda: tomllib.loads(content.decode()), "TOML")
    return tables


def read_json(name: str, path: str | Path, most: int = LARGEST) -> Any:
    """What a JSON file holds; ``ValueError`` names ``name`` and the file."""
    content = read(name, path, most)
    return _parsed(f"{name} = {named(path)} is damaged", lambda: json.loads(content), "JSON")


def _parsed(said: str, parse: Callable[[], Any], kind: str) -> Any:
    try:
        return parse()
    except RecursionError:
        words = "it nests too deeply"
    except ValueError as error:
        # Python's words on a number too long for it tell of functions to call.
        words = "a number has too many digits" if "integer string conversion" in str(error) else " ".join(str(error).split())
    raise ValueError(f"{said}: {words[:200]}; allowed: {kind}")
