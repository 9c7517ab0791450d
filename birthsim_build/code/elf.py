"""What an object file in ELF holds: sizes of its sections, and the names that it expects from elsewhere."""

import struct

SYMBOL_TABLE, EMPTY = 2, 8
"""Kinds of sections: names, and those that take memory where the code runs only."""


def sections_of(content: bytes) -> dict[str, int]:
    """Bytes of every section, by name."""
    return {name: size for name, _, _, size, _ in _sections(content)}


def contents_of(content: bytes) -> dict[str, bytes]:
    """What is in every section, by name."""
    return {name: content[start : start + size] for name, kind, start, size, _ in _sections(content) if kind != EMPTY}


def undefined_in(content: bytes) -> list[str]:
    """Names that whoever links the object must give."""
    sections = _sections(content)
    wide = content[4] == 2
    form, size = ("<IBBHQQ", 24) if wide else ("<IIIBBH", 16)
    names = []
    for _, kind, start, length, linked in sections:
        if kind == SYMBOL_TABLE:
            strings = sections[linked][2]
            for at in range(start, start + length, size):
                symbol = struct.unpack_from(form, content, at)
                if symbol[0] and symbol[3 if wide else 5] == 0:
                    names.append(_text(content, strings + symbol[0]))
    return sorted(names)


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
