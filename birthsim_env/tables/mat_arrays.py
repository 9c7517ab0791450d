"""Variables of a MATLAB file of version 5 to 7, by MathWorks' "MAT-File Format".

SciPy reads these files too, but some damaged ones end its compiled code with a segmentation fault, and a packed one may take
all memory. Here nothing that a file says of its own sizes is believed.
"""

import math
import struct
import zlib
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

_HEADER, _TAG = 128, 8
_MATRIX, _COMPRESSED = 14, 15
_CELL, _STRUCT, _CHAR, _NUMBERS = 1, 2, 4, range(6, 16)
_OTHERS = {3: "an object", 5: "a sparse matrix", 16: "a function", 17: "an object, such as a table or a timeseries"}
_STORED = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_TEXTS = {2: "latin-1", 4: "utf-16", 16: "utf-8", 17: "utf-16", 18: "utf-32"}
_DEPTH = 20
"""Levels of cells and structures."""


class Foreign(NamedTuple):
    """A variable that has no array of numbers; ``kind`` in words."""

    kind: str


def variables_of(content: bytes, most: int, check: Callable[[int], None]) -> dict[str, Any]:
    """Name -> array, as SciPy's ``loadmat`` has them; cells are arrays of objects, structures have named fields.

    ``check`` is asked for every number of numbers. ``ValueError`` where the file is damaged or takes more than ``most`` bytes.
    """
    order = {b"IM": "<", b"MI": ">"}[content[126:128]]
    reader, found, left = _Reader(order, check), dict[str, Any](), most
    place = _HEADER
    while place + _TAG <= len(content):
        kind, length = struct.unpack_from(f"{order}II", content, place)
        inside = content[place : place + _TAG + length]
        if len(inside) < _TAG + length:
            raise ValueError("it is cut")
        if kind == _COMPRESSED:
            inside = zlib.decompressobj().decompress(inside[_TAG:], left + 1)
        left -= len(inside)
        if left < 0:
            raise ValueError(f"it holds more than {most} bytes")
        for kind, data in reader.elements(memoryview(inside)):
            name, value = reader.array(data, _DEPTH) if kind == _MATRIX else ("", None)
            if name:
                found[name] = value
        place += _TAG + length
    return found


class _Reader:
    """Elements of one order of bytes."""

    def __init__(self, order: str, check: Callable[[int], None]) -> None:
        self._order, self._check, self._numbers = order, check, 0

    def elements(self, data: memoryview) -> Iterator[tuple[int, memoryview]]:
        """The type and the bytes of each element."""
        place = 0
        while place + _TAG <= len(data):
            word, length = struct.unpack_from(f"{self._order}II", data, place)
            start = place + (4 if word >> 16 else _TAG)
            kind, length = (word & 0xFFFF, word >> 16) if word >> 16 else (word, length)
            if start + length > len(data) or (word >> 16 and length > 4):
                raise ValueError("an element is cut")
            yield kind, data[start : start + length]
            place = place + _TAG if word >> 16 else start + -(-length // 8) * 8

    def array(self, data: memoryview, depth: int) -> tuple[str, Any]:
        """The name and the value of a variable."""
        if not data:
            return "", np.empty((0, 0))
        if not depth:
            raise ValueError("it nests too deeply")
        elements = self.elements(data)
        flags = int(self._values(*next(elements))[0])
        if flags & 0xFF in _OTHERS:
            names = [bytes(inside).decode("latin-1") for kind, inside in elements if kind == 1]
            return (names or [""])[0], Foreign(_OTHERS[flags & 0xFF])
        shape = tuple(int(size) for size in self._values(*next(elements)))
        name = bytes(next(elements)[1]).decode("latin-1")
        if len(shape) < 2 or len(shape) > 32 or min(shape) < 0:
            raise ValueError(f"an array has the sizes {shape[:3]}")
        return name, self._value(flags, shape, elements, depth)

    def _value(self, flags: int, shape: tuple[int, ...], elements: Iterator[tuple[int, memoryview]], depth: int) -> Any:
        kind, count = flags & 0xFF, math.prod(shape)
        if kind in _NUMBERS:
            parts = [self._values(*next(elements)) for _ in range(2 if flags & 0x800 else 1)]
            values = parts[0] if len(parts) == 1 else parts[0] + 1j * parts[1]
            return self._shaped(values, shape)
        if kind == _CHAR:
            return self._rows(*next(elements), shape)
        if kind == _CELL:
            return self._shaped(self._objects(elements, count, depth), shape)
        if kind != _STRUCT:
            raise ValueError(f"a variable is of kind {kind}")
        width = int(self._values(*next(elements))[0])
        text = bytes(next(elements)[1])
        names = [text[at : at + width].partition(b"\0")[0].decode("latin-1") for at in range(0, len(text), max(1, width))]
        if len(set(names)) < len(names) or not all(names):
            raise ValueError("a structure has a field twice")
        values = self._objects(elements, count * len(names), depth)
        found = np.empty(count, dtype=[(name, object) for name in names])
        for field, name in enumerate(names):
            found[name] = values[field :: len(names)]
        return self._shaped(found, shape)

    def _objects(self, elements: Iterator[tuple[int, memoryview]], count: int, depth: int) -> Any:
        values: list[Any] = []
        while len(values) < count:
            kind, data = next(elements)
            if kind != _MATRIX:
                raise ValueError("a cell is no array")
            values.append(self.array(data, depth - 1)[1])
        found = np.empty(len(values), dtype=object)
        for place, value in enumerate(values):
            found[place] = value
        return found

    def _values(self, kind: int, data: memoryview) -> Any:
        if kind not in _STORED:
            raise ValueError(f"numbers are of type {kind}")
        values = np.frombuffer(data, dtype=f"{self._order}{_STORED[kind]}")
        self._numbers += len(values)
        self._check(self._numbers)
        return values

    def _rows(self, kind: int, data: memoryview, shape: tuple[int, ...]) -> Any:
        """The texts in the rows of an array of letters."""
        wide = {"<": "-le", ">": "-be"}[self._order]
        coding = _TEXTS.get(kind, "latin-1")
        letters = list(bytes(data).decode(coding + wide if coding in ("utf-16", "utf-32") else coding, "replace"))
        if len(shape) != 2 or len(letters) != math.prod(shape):
            return np.array(["".join(letters)])
        return np.array(["".join(letters[row :: shape[0]]) for row in range(shape[0])])

    def _shaped(self, values: Any, shape: tuple[int, ...]) -> Any:
        if len(values) != math.prod(shape):
            raise ValueError(f"an array has {len(values)} values for the sizes {shape[:3]}")
        return values.reshape(shape, order="F")
