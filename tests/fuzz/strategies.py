"""Odd values, and damage to bytes, JSON and TOML."""

import copy
import functools
import json
import math
from pathlib import Path

import numpy as np
import tomli_w
from hypothesis import strategies as st


class _Given(tuple):
    """Arguments of a strategy. Hypothesis writes them beside an error and warns of long ones, which would hide that error."""

    def __repr__(self):
        return "..."


def composite(function):
    """``st.composite`` for a function of anything, however long it is when it is written, that may compute anything."""

    def drawn(draw, given):
        with np.errstate(all="ignore"):
            return function(draw, *given)

    drawn.__name__ = function.__name__
    made = st.composite(drawn)
    return functools.wraps(function)(lambda *given: made(_Given(given)))


def sampled(values):
    """One of ``values``, copied: what a test does to it, no other example sees. Hypothesis needs that to draw it again."""
    values = _Given(values)
    return st.integers(0, len(values) - 1).map(lambda at: copy.deepcopy(values[at]))


NUMBERS = (
    *(0, 1, -1, 2, 3, 7, 255, 2**31, 2**32, 2**63, 2**64, 10**9, 10**12, 10**320, -(10**320), 10**4000),
    *(0.0, -0.0, 0.5, 1.0, 1.5, -3.7, 1e-12, 1e-300, 5e-324, 1e10, 1e150, 1e300, 1e308, -1e308),
    *(math.nan, math.inf, -math.inf),
)
WORDS = (
    *("", " ", "x", "none", "nan", "1e999", "\x00", "\n", "ö\u202e\U0001f600", "..", "/dev/zero", "/", "x" * 5000, "1_0", "[]"),
)
TOKENS = (*(b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"[" * 3000, b"9" * 5000, "ö😀\u202e".encode(), b"\r", b"{" * 3000),)


def nested(depth):
    """Lists in lists."""
    value = []
    for _ in range(depth):
        value = [value]
    return value


numbers = sampled(NUMBERS) | st.floats() | st.integers()
words = sampled(WORDS) | st.text(st.characters(exclude_categories=["Cs"]), max_size=20)
plain = st.one_of(
    numbers,
    words,
    st.booleans(),
    st.recursive(numbers | words, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(words, inner, max_size=3)),
    sampled((nested(60), [], {}, [[1.0, 2.0]], [1, 2, 3])),
)
"""What TOML can hold, and JSON beside ``null``."""

strange = st.one_of(
    plain,
    sampled(
        (
            *(None, 16**5000, 1j, 1 + 0j, b"", b"\xff", (), (1,), (1.0, 2.0), (2.0, 1.0), (math.nan, 1.0), (1e308, 1e308)),
            *((1, 2, 3), ((1.0, 2.0), (3.0, 4.0)), ((0.4, 0.6), 0.0), [(0.0, 1.0, 2.0)], {1, 2}, range(3), range(10**12)),
            *(np.float32(0.5), np.float64(1e308), np.int64(3), np.bool_(True), np.array(2.0), np.array([1.0, 2.0])),
            *(np.array([]), np.zeros((2, 2)), np.array([1, "x"], dtype=object), np.full(3, math.nan), np.array([1j])),
            *(object(), object, len, lambda: 1, lambda t: t, lambda t: (t, math.nan), Path("/dev/null"), Path("x\x00y")),
            *(slice(None), NotImplemented, ..., {"mechanics.mass": (2, 5)}, {1: 2}, {"x": None}, {(1, 2): {None: ()}}),
            *(range(10**30), ["x" * 5000], {"x" * 5000: 1}),
        )
    ),
    sampled([3000]).map(nested),
)
"""What only a program can hand over, too."""


def near(value):
    """Numbers of either sign in the neighbourhood of one."""
    return st.builds(lambda scale, sign: value * math.exp(scale) * sign, st.floats(-3, 3), sampled((1, 1, 1, -1)))


@composite
def damaged(draw, content):
    """Bytes with flips, cuts, repeats, insertions, other lengths and counts, or others altogether."""
    data = bytearray(content)
    for _ in range(draw(st.integers(1, 3))):
        at, span = draw(st.integers(0, len(data))), draw(st.integers(1, 40))
        match draw(sampled(("flip", "cut", "drop", "repeat", "bytes", "token", "count", "other"))):
            case "flip" if data:
                for _flip in range(draw(st.integers(1, 8))):
                    data[draw(st.integers(0, len(data) - 1))] ^= 1 << draw(st.integers(0, 7))
            case "cut":
                del data[at:]
            case "drop":
                del data[at : at + span]
            case "repeat":
                data[at:at] = data[at : at + 50 * span]
            case "bytes":
                data[at:at] = draw(st.binary(min_size=1, max_size=40))
            case "token":
                data[at:at] = draw(sampled(TOKENS))
            case "count" if len(data) > 8:
                at, width = min(at, len(data) - 8), draw(sampled((4, 8)))
                data[at : at + width] = draw(sampled((0, 1, 2**31 - 1, 2**32 - 1))).to_bytes(width, "little")
            case "other":
                data = bytearray(draw(st.binary(max_size=40)))
    return bytes(data)


def _places(tree, path=()):
    inside = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    return [path, *(place for key, value in inside for place in _places(value, (*path, key)))]


@composite
def altered(draw, tree, values=plain):
    """A tree of dictionaries and lists with one to three values changed, removed, renamed, halved or doubled."""
    tree = copy.deepcopy(tree)
    for _ in range(draw(st.integers(1, 3))):
        *way, last = draw(sampled(_places(tree))) or (None,)
        if last is None:
            continue
        parent = tree
        for key in way:
            parent = parent[key]
        value = parent[last]
        match draw(sampled(("remove", "rename", "resize", "change", "change", "change"))):
            case "remove":
                del parent[last]
            case "rename" if isinstance(parent, dict):
                parent[draw(words | sampled([f"{last}s"]))] = parent.pop(last)
            case "resize" if isinstance(value, list):
                parent[last] = value[: len(value) // 2] if draw(st.booleans()) else value * 2
            case _:
                parent[last] = draw(values | near(value) if isinstance(value, float) else values)
    return tree


def json_texts(tree):
    """JSON of a tree that is altered, damaged, or both, now and then of another one or of one that nests deeply."""
    text, trees = json.dumps(tree), altered(tree, plain | st.none()).map(json.dumps)
    return st.one_of(
        trees.map(str.encode),
        damaged(text.encode()),
        trees.flatmap(lambda text: damaged(text.encode())),
        plain.map(lambda value: json.dumps(value).encode()),
        sampled((b"[" * 100_000 + b"]" * 100_000, b'{"a":' * 100_000)),
    )


LINES = (
    *(
        "deep = " + "[" * 3000 + "]" * 3000,
        "[" + ".".join("a" * 3000) + "]",
        ".".join("a" * 3000) + " = 1",
        "a = " + "{a=" * 3000,
    ),
    *(
        "x = 1979-05-27",
        "= 1",
        "[[mechanics]]",
        "a.b = 1\na.b.c = 2",
        "n = " + "9" * 5000,
        "n = 0x" + "f" * 5000,
        'm = """',
        "[]",
    ),
)
"""Lines that TOML files of rigs and trainings do not have."""


@composite
def toml_texts(draw, tables):
    """TOML of one of some trees, altered, damaged, or both, also with doubled keys and deep tables."""
    tree = draw(sampled(tables))
    tree = draw(altered(tree)) if draw(st.booleans()) else tree
    lines = tomli_w.dumps(tree).splitlines()
    if draw(st.integers(0, 9)) == 0:
        lines.insert(draw(st.integers(0, len(lines))), draw(sampled(LINES)))
    if lines and draw(st.integers(0, 19)) == 0:
        lines.append(draw(sampled(lines)))
    text = "\n".join(lines).encode()
    return draw(damaged(text)) if draw(st.integers(0, 3)) == 0 else text


@composite
def odd_arrays(draw, arrays):
    """Named arrays of which one is gone, has another name, shape or type, or odd numbers."""
    arrays = dict(arrays)
    name = draw(sampled(sorted(arrays)))
    array = np.array(arrays.pop(name))
    match draw(sampled(("gone", "name", "size", "type", "numbers", "some", "twice", "scalar"))):
        case "name":
            arrays[f"{name}s"] = array
        case "size":
            arrays[name] = array.reshape(-1)[: draw(st.integers(0, 2))]
        case "type":
            arrays[name] = array.astype(draw(sampled(("f2", "f8", "i4", "u1", "bool"))))
        case "numbers":
            arrays[name] = np.full(array.shape, draw(sampled((np.nan, np.inf, 1e30, -1.0))), dtype=np.float32)
        case "some":
            arrays[name] = draw(odd_entries(array))
        case "twice":
            arrays[name] = np.stack([array, array])
        case "scalar":
            arrays[name] = np.array(0.0)
    return arrays


@composite
def odd_entries(draw, array):
    """An array of which an entry, or all of them, is an odd number, as far as its type holds that."""
    array = np.array(array)
    value, at = draw(numbers), draw(st.integers(0, max(0, array.size - 1)) | st.none())
    try:
        array[(...,) if at is None else np.unravel_index(at, array.shape)] = value
    except (OverflowError, ValueError):
        return array
    return array
