"""JSON that others may have written: read within limits, and checked for the kinds of values that its reader goes on to use."""

import json
import math
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NoReturn

from birthsim_env.physics.rig.reading import LARGEST, named, read
from birthsim_env.physics.rig.schema import fault
from birthsim_env.physics.rig.values import shown

DEEPEST = 100
"""Lists and objects within each other; a checkpoint has 30."""

DIGITS = 300
"""Of a whole number: any such number is a finite float too."""


def read_json(name: str, path: str | Path, schema: Any = object, most: int = LARGEST) -> Any:
    """What a JSON file of at most ``most`` bytes holds, which fits ``schema``.

    Raises ``ValueError`` in one line, which begins with ``name``, the argument that says the path, and names the file, what is
    wrong and what is allowed.
    """
    return parse_json(f"{name} = {named(path)}", read(name, path, most), schema)


def parse_json(said: str, content: bytes | str, schema: Any = object, finite: bool = True) -> Any:
    """What JSON holds, which fits ``schema``: at most ``DEEPEST`` deep, each name once in an object, UTF-8, 16 or 32.

    Where it need not be ``finite``, it may hold NaN and infinities as Python writes them. Raises ``ValueError`` in one line,
    which begins with ``said`` and names what is wrong and what is allowed.
    """
    try:
        found = _parsed(content, finite)
    except UnicodeError as error:  # a decoder's words hold all that it was given
        raise ValueError(f"{said} is damaged: it is no text ({error.__class__.__name__}); allowed: JSON") from None
    except (ValueError, RecursionError) as error:
        problem = _DEEP if isinstance(error, RecursionError) else " ".join(str(error).split())
        raise ValueError(f"{said} is damaged: {problem[:200]}; allowed: JSON") from None
    if problem := fault(found, schema):
        raise ValueError(f"{said} is damaged or foreign: {problem}")
    return found


_DEEP = f"it nests more than {DEEPEST} deep"


def _parsed(content: bytes | str, finite: bool) -> Any:
    text = content if isinstance(content, str) else content.decode(json.detect_encoding(content))
    hooks: dict[str, Any] = {"parse_float": _finite, "parse_constant": _refuse_constant} if finite else {}
    found = json.loads(text, object_pairs_hook=_once, parse_int=_whole, **hooks)
    if "\\ud" in text.casefold():
        json.dumps(found, ensure_ascii=False).encode()  # half of a surrogate pair is no character
    if _is_deep(found):
        raise ValueError(_DEEP)
    return found


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        (twice, _), *_ = Counter(name for name, _ in pairs).most_common(1)
        raise ValueError(f"the name {shown(twice)} stands twice")
    return found


def _whole(digits: str) -> int:
    if len(digits) > DIGITS:
        raise ValueError(f"a whole number has {len(digits)} digits, more than {DIGITS}")
    return int(digits)


def _finite(digits: str) -> float:
    value = float(digits)
    if not math.isfinite(value):
        raise ValueError(f"the number {shown(digits)} is too large")
    return value


def _refuse_constant(word: str) -> NoReturn:
    raise ValueError(f"{word} is no number of JSON")


def _is_deep(found: Any) -> bool:
    """Whether lists and objects nest more than ``DEEPEST`` deep."""
    level = _nested([found])
    for _ in range(DEEPEST):
        level = [inner for one in level for inner in _nested(one.values() if isinstance(one, dict) else one)]
    return bool(level)


def _nested(values: Iterable[Any]) -> list[Any]:
    return [one for one in values if isinstance(one, (dict, list))]
