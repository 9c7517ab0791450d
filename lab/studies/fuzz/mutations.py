"""Odd values, and damage to text, bytes and JSON."""

import copy
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

Rng = np.random.Generator

NUMBERS: tuple[Any, ...] = (
    *(0, 1, -1, 2, 3, 7, 255, 2**31, 2**32, 2**63, 2**64, 10**9, 10**12, 10**320, -(10**320), 10**4000),
    *(0.0, -0.0, 0.5, 1.0, 1.5, -3.7, 1e-12, 1e-300, 5e-324, 1e10, 1e150, 1e300, 1e308, -1e308),
    *(math.nan, math.inf, -math.inf),
)
WORDS = (
    "",
    " ",
    "x",
    "none",
    "nan",
    "1e999",
    "\x00",
    "\n",
    "ö\u202e\U0001f600",
    "..",
    "/dev/zero",
    "/",
    "x" * 5000,
    "1_0",
    "[]",
)


def number(rng: Rng, near: float | None = None) -> Any:
    """A number, odd or, in a third of all cases, in the neighbourhood of ``near``."""
    if near is not None and rng.random() < 0.34:
        return float(near * np.exp(rng.normal(0.0, 1.0)) * rng.choice([1, 1, 1, -1]))
    return NUMBERS[rng.integers(len(NUMBERS))]


def nested(depth: int) -> Any:
    """Lists in lists."""
    value: Any = []
    for _ in range(depth):
        value = [value]
    return value


def plain(rng: Rng, near: float | None = None) -> Any:
    """A value that JSON or TOML can hold."""
    choice = rng.integers(8)
    if choice < 4:
        return number(rng, near)
    if choice == 4:
        return WORDS[rng.integers(len(WORDS))]
    options: tuple[Any, ...] = (True, False, [], {}, [number(rng)], [[1.0, 2.0]], {"a": 1}, ["x"], [1, 2, 3], nested(60), [[]])
    return options[rng.integers(len(options))]


def strange(rng: Rng, near: float | None = None) -> Any:
    """A value that only a Python program can hand over, or a plain one."""
    if rng.random() < 0.6:
        return plain(rng, near)
    options: tuple[Any, ...] = (
        *(
            None,
            16**5000,
            1j,
            1 + 0j,
            b"",
            b"\xff",
            (),
            (1.0, 2.0),
            (2.0, 1.0),
            (math.nan, 1.0),
            (1e308, 1e308),
            {1, 2},
            range(3),
            range(10**12),
        ),
        *(np.float32(0.5), np.float64(1e308), np.int64(3), np.array([]), np.array(2.0), np.array([1.0, 2.0]), np.zeros((2, 2))),
        *(np.array([1, "x"], dtype=object), np.bool_(True), np.full(3, math.nan), np.array([1j]), nested(3000)),
        *(
            object(),
            object,
            len,
            lambda: 1,
            lambda t: t,
            lambda t: (t, math.nan),
            Path("/dev/null"),
            Path("x\x00y"),
            slice(None),
            NotImplemented,
            ...,
        ),
        *(
            (1,),
            (1, 2, 3),
            ((1.0, 2.0), (3.0, 4.0)),
            ((0.4, 0.6), 0.0),
            [(0.0, 1.0, 2.0)],
            {"mechanics.mass": (2, 5)},
            {1: 2},
            {"x": None},
        ),
    )
    return options[rng.integers(len(options))]


def damaged(rng: Rng, content: bytes) -> bytes:
    """Bytes with flips, cuts, repeats, insertions, or others altogether."""
    data = bytearray(content)
    for _ in range(int(rng.integers(1, 4))):
        at = int(rng.integers(len(data) + 1))
        span = int(rng.integers(1, 40))
        match int(rng.integers(7)):
            case 0 if data:
                for k in rng.integers(len(data), size=int(rng.integers(1, 9))):
                    data[k] ^= 1 << int(rng.integers(8))
            case 1:
                del data[at:]
            case 2:
                del data[at : at + span]
            case 3:
                data[at:at] = data[at : at + 50 * span]
            case 4:
                data[at:at] = rng.bytes(span)
            case 5:
                token = (
                    b"\x00",
                    b"\xff\xfe",
                    b"\xef\xbb\xbf",
                    b"[" * 3000,
                    b"9" * 5000,
                    "ö😀\u202e".encode(),
                    b"\r",
                    b"{" * 3000,
                )
                data[at:at] = token[rng.integers(len(token))]
            case _ if rng.random() < 0.2:
                data = bytearray(rng.bytes(span) if rng.random() < 0.5 else b"")
            case _ if len(data) > 8:
                width = int(rng.choice([4, 8]))
                at = int(rng.integers(len(data) - width + 1))
                data[at : at + width] = int(rng.choice([0, 1, 2**31 - 1, 2**32 - 1])).to_bytes(width, "little")
            case _:
                pass
    return bytes(data)


def _places(tree: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    inside = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    return [path] + [place for key, value in inside for place in _places(value, (*path, key))]


def altered(rng: Rng, tree: Any) -> Any:
    """A tree of dicts and lists with values changed, removed, renamed, doubled or moved."""
    tree = copy.deepcopy(tree)
    for _ in range(int(rng.integers(1, 4))):
        places = _places(tree)
        *way, last = places[rng.integers(len(places))] or (None,)
        if last is None:
            tree = plain(rng) if rng.random() < 0.1 else tree
            continue
        parent = tree
        for key in way:
            parent = parent[key]
        value = parent[last]
        match int(rng.integers(6)):
            case 0:
                del parent[last]
            case 1 if isinstance(parent, dict):
                parent[WORDS[rng.integers(len(WORDS))] if rng.random() < 0.5 else f"{last}s"] = parent.pop(last)
            case 2 if isinstance(value, list):
                parent[last] = value[: len(value) // 2] if rng.random() < 0.5 else value * 2
            case _:
                near = value if isinstance(value, float) else None
                parent[last] = plain(rng, near)
    return tree


def json_bytes(rng: Rng, tree: Any) -> bytes:
    """A JSON text of a tree, altered, damaged, or both; rarely one that nests deeply."""
    choice = rng.random()
    if choice < 0.03:
        return b"[" * 100_000 + b"]" * 100_000
    if choice < 0.06:
        return b'{"a":' * 100_000
    text = json.dumps(altered(rng, tree) if choice < 0.8 else tree, default=str) if choice < 0.78 else json.dumps(tree)
    return damaged(rng, text.encode()) if choice > 0.7 else text.encode()


def toml_value(value: Any) -> str:
    """A value in TOML's words, where it has some."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return hex(value) if value > 10**400 else str(value)
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, list):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    return "{" + ", ".join(f"{json.dumps(name)} = {toml_value(inner)}" for name, inner in value.items()) + "}"


def toml_bytes(rng: Rng, tables: dict[str, Any]) -> bytes:
    """A TOML text of tables, altered, damaged, or both; with doubled keys, deep tables and deep arrays now and then."""
    choice = rng.random()
    tree = altered(rng, tables) if choice < 0.8 else tables
    lines: list[str] = []
    for name, table in tree.items() if isinstance(tree, dict) else [("x", tree)]:
        if isinstance(table, dict):
            head = name if name.isidentifier() and name.isascii() else json.dumps(name)
            lines += [f"[{head}]", *(f"{json.dumps(key)} = {toml_value(value)}" for key, value in table.items())]
        else:
            lines.insert(0, f"{json.dumps(name)} = {toml_value(table)}")
    if rng.random() < 0.08:
        extra = (
            *(
                "deep = " + "[" * 3000 + "]" * 3000,
                "[" + ".".join("a" * 3000) + "]",
                ".".join("a" * 3000) + " = 1",
                "a = " + "{a=" * 3000,
            ),
            *("x = 1979-05-27", "= 1", "[[mechanics]]", "a.b = 1\na.b.c = 2", "n = " + "9" * 5000, 'm = """', "[]"),
        )
        lines.insert(int(rng.integers(len(lines) + 1)), extra[rng.integers(len(extra))])
    if lines and rng.random() < 0.05:
        lines.append(lines[rng.integers(len(lines))])
    text = "\n".join(lines).encode("utf-8", "surrogatepass")
    return damaged(rng, text) if choice > 0.75 else text
