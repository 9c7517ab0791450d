"""What an object file or a library in ELF holds: sizes of its sections, names that it has, and those that it expects."""

import struct
from collections.abc import Iterator

SYMBOL_TABLES, EMPTY = (2, 11), 8
"""Kinds of sections: names, also those for a loader, and what takes memory where the code runs only."""

LOCAL = 0
"""Of names: a file's own."""


def sections_of(content: bytes) -> dict[str, int]:
    """Bytes of every section, by name."""
    return {name: size for name, _, _, size, _ in _sections(content)}


def contents_of(content: bytes) -> dict[str, bytes]:
    """What is in every section, by name."""
    return {name: content[start : start + size] for name, kind, start, size, _ in _sections(content) if kind != EMPTY}


def undefined_in(content: bytes) -> list[str]:
    """Names that whoever links or loads the file must give."""
    return sorted({name for name, is_here in _names(content) if not is_here})


def defined_in(content: bytes) -> list[str]:
    """Names that others find in the file."""
    return sorted({name for name, is_here in _names(content) if is_here})


def _names(content: bytes) -> Iterator[tuple[str, bool]]:
    """Names that are not the file's own, and whether they stand for something in it."""
    sections = _sections(content)
    wide = content[4] == 2
    form, size = ("<IBBHQQ", 24) if wide else ("<IIIBBH", 16)
    for _, kind, start, length, linked in sections:
        if kind in SYMBOL_TABLES:
            strings = sections[linked][2]
            for at in range(start, start + length, size):
                symbol = struct.unpack_from(form, content, at)
                about, place = (symbol[1], symbol[3]) if wide else (symbol[3], symbol[5])
                if symbol[0] and about >> 4 != LOCAL:
                    yield _text(content, strings + symbol[0]), place != 0


def _sections(content: bytes) -> list[tuple[str, int, int, int, int]]:
    """Name, kind, place, size and linked section of each."""
    wide = content[4] == 2
    table = struct.unpack_from("<Q", content, 40)[0] if wide else struct.unpack_from("<I", content, 32)[0]
    entry, count, strings = struct.unpack_from("<HHH", content, 58 if wide else 46)
    form = "<IIQQQQI" if wide else "<IIIIIII"
    found = [struct.unpack_from(form, content, table + entry * k) for k in range(count)]
    base = found[strings][4]
    return [(_text(content, base + one[0]), one[1], one[4], one[5], one[6]) for one in found]


def _text(content: bytes, at: int) -> str:
    return content[at : content.index(b"\0", at)].decode()
