"""Files that a user wrote: read whole where they are small, refused by name where they are not what they should be."""

import codecs
import os
import tomllib
from collections.abc import Callable
from typing import Any

from birthsim_env.physics.rig.values import path_of, shown

LARGEST = 4 * 2**20
"""Bytes of a file of settings or numbers; a rig takes 2 kB, an hour of a trajectory at 10 ms 8 MB less its digits."""

NO_TEXT = "bytes that are no text"


def named(path: str | os.PathLike[str]) -> str:
    """A path as errors name it; of one that is longer than any name, the end."""
    text = os.fspath(path)
    return repr(text if len(text) <= 200 else f"... {text[-80:]}")


def read(name: str, path: str | os.PathLike[str], most: int = LARGEST) -> bytes:
    """The content of a file of at most ``most`` bytes; ``ValueError`` begins with ``name``, the argument that says the path."""
    if path_of(path) is None:
        raise ValueError(f"{name} = {shown(path)}; allowed: the path of a file")
    try:
        with open(path, "rb") as file:
            # As much as is asked for is set aside at first. What says no size, such as a pipe, may send more.
            size = min(os.fstat(file.fileno()).st_size, most)
            content = file.read(size + 1)
            if len(content) > size:
                content += file.read(most + 1 - len(content))
    except OSError as error:
        raise ValueError(f"{name} = {named(path)} cannot be read: {error.strerror or error}; allowed: a file") from error
    except ValueError as error:  # a zero byte
        raise ValueError(f"{name} = {named(path)} cannot be read: {error}; allowed: a file") from None
    if len(content) > most:
        raise ValueError(f"{name} = {named(path)} is larger than allowed: at most {most} bytes")
    return content


def encoding_of(content: bytes) -> str:
    """How a text is encoded, by its byte-order mark and its bytes: ``UTF-8``, with or without a mark, ``UTF-16``, ``UTF-32``,
    ``Windows-1252``, or words for what cannot be read, such as zeros at the end, which a loss of power leaves."""
    marks = {"UTF-32": (codecs.BOM_UTF32_LE, codecs.BOM_UTF32_BE), "UTF-16": (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)}
    for name, begins in marks.items():
        if content.startswith(begins):
            return name
    if content.endswith(b"\0") and b"\0" not in content.rstrip(b"\0")[:LARGEST]:
        return "text that ends in zero bytes"
    if b"\0" in content[:LARGEST]:
        halves = content[:2000:2], content[1:2000:2]
        every_other = any(half.count(0) > 0.9 * len(half) for half in halves) and not all(0 in half for half in halves)
        return "UTF-16 without a byte-order mark" if every_other else NO_TEXT
    decoder = codecs.getincrementaldecoder("utf-8")()
    try:
        for start in range(0, len(content) + 1, 2**20):
            decoder.decode(content[start : start + 2**20], final=start + 2**20 > len(content))
    except UnicodeDecodeError:
        try:
            content.decode("cp1252")
        except UnicodeDecodeError:
            return NO_TEXT
        return "Windows-1252"
    return "UTF-8"


def read_text(name: str, path: str | os.PathLike[str], most: int = LARGEST) -> str:
    """The text of a file in UTF-8, without the mark that editors on Windows put before it; ``ValueError`` names ``name``, the
    file and another encoding."""
    content = read(name, path, most)
    said = encoding_of(content)
    if said != "UTF-8":
        raise ValueError(f"{name} = {named(path)} is in {said}; allowed: text in UTF-8")
    return content.decode("utf-8-sig")


def read_toml(name: str, path: str | os.PathLike[str]) -> dict[str, Any]:
    """The tables of a TOML file; ``ValueError`` names ``name`` and the file."""
    text = read_text(name, path)
    tables: dict[str, Any] = _parsed(f"{name} = {named(path)} is no TOML", lambda: tomllib.loads(text), "TOML")
    return tables


def _parsed(said: str, parse: Callable[[], Any], kind: str) -> Any:
    try:
        return parse()
    except RecursionError:
        words = "it nests too deeply"
    except ValueError as error:
        # Python's words on a number too long for it tell of functions to call.
        words = "a number has too many digits" if "integer string conversion" in str(error) else " ".join(str(error).split())
    raise ValueError(f"{said}: {words[:200]}; allowed: {kind}")
