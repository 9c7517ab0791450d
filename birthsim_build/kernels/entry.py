"""How a prebuilt kernel is entered: LLVM code around what Numba makes of it, as ``compiled.prebuilt`` calls it."""

from collections.abc import Sequence
from typing import Any

from birthsim_env.physics.compiled.record_types import Record

NUMBERS = {"i": "i64", "d": "double", "b": "i8", "u": "i64"}
"""Kind of a number -> how LLVM's code takes it."""

_FIELDS = {"data": 0, "dimensions": 16, "strides": 24}
"""Bytes at which an array has them: ``PyArrayObject_fields`` of NumPy, without the head of a Python object."""


def entry_code(symbol: str, native: str, kinds: Sequence[str], arguments: Sequence[Any], result: str) -> str:
    """The code of ``symbol``, which calls ``native`` with ``arguments`` of these Numba types; ``kinds`` and ``result`` are
    those of keys."""
    before, passed = list[str](), list[str]()
    for k, (kind, argument) in enumerate(zip(kinds, arguments, strict=True)):
        if kind in NUMBERS:
            passed.append(f"{NUMBERS[kind]} %a{k}")
        else:
            lines, words = _taken_apart(f"%a{k}", argument.array if isinstance(argument, Record) else argument)
            before += lines
            passed += words
    given = [f"{NUMBERS.get(kind, 'i64')} %a{k}" for k, kind in enumerate(kinds)]
    words = ["ptr %value", "ptr %error", *passed]
    declared = ", ".join(word.partition(" ")[0] for word in words)
    call = f'  %status = call i32 @"{native}"({", ".join(words)})'
    # What the error would say goes no further, so that LLVM leaves it out, with the path of the source that stands in it.
    if {*kinds, result} == {"i"}:
        head = f"define i64 @{symbol}({', '.join(given)}) nounwind {{\n  %value = alloca i64\n  store i64 0, ptr %value"
        end = "  %returned = load i64, ptr %value\n  ret i64 %returned"
    else:
        own = "\n  %value = alloca ptr" if result == "n" else ""
        to = "%none" if result == "n" else "%value"
        head = f"define i32 @{symbol}({', '.join([f'ptr {to}', *given])}) nounwind {{{own}"
        end = "  ret i32 %status"
    return "\n".join([f'declare i32 @"{native}"({declared})', head, "  %error = alloca ptr", *before, call, end, "}", ""])


def _taken_apart(name: str, array: Any) -> tuple[list[str], list[str]]:
    """LLVM code that reads an array's fields, and the arguments that Numba's code takes it by."""
    lines = [f"  {name}.at = inttoptr i64 {name} to ptr"]
    for field, place in _FIELDS.items():
        lines.append(f"  {name}.{field}.at = getelementptr i8, ptr {name}.at, i64 {place}")
        lines.append(f"  {name}.{field} = load ptr, ptr {name}.{field}.at")
    size, words = "1", dict[str, list[str]](dimensions=[], strides=[])
    for axis in range(array.ndim):
        for field, found in words.items():
            own = f"{name}.{field}{axis}"
            lines.append(f"  {own}.at = getelementptr i64, ptr {name}.{field}, i64 {axis}")
            lines.append(f"  {own} = load i64, ptr {own}.at")
            found.append(f"i64 {own}")
        lines.append(f"  {name}.size{axis} = mul i64 {size}, {name}.dimensions{axis}")
        size = f"{name}.size{axis}"
    item = array.dtype.bitwidth // 8
    head = ["ptr null", "ptr null", f"i64 {size}", f"i64 {item}", f"ptr {name}.data"]
    return lines, [*head, *words["dimensions"], *words["strides"]]
