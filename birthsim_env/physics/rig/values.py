"""Values that a user gives: their words in errors, and the checks that many arguments share.

One rule for numbers: Python's and NumPy's whole numbers and floats are numbers, and become Python's. A count may be a float
without a fraction, such as 5.0. True and False, text, arrays (also of no dimension), fractions and decimals are no numbers.
"""

import dataclasses
import difflib
import math
import os
import sys
from collections.abc import Iterable
from numbers import Integral, Rational, Real
from typing import Any

import numpy as np

LONGEST = 160
"""Characters of a value in an error; a longer one is cut."""

HUGE = 10**80
"""A whole number from here on is told by its digits: Python refuses to write the longest."""


def shown(value: Any) -> str:
    """``value`` as Python writes it, in one line of at most ``LONGEST`` characters, whatever it is."""
    if isinstance(value, int) and not -HUGE < value < HUGE:
        return f"a whole number of {round(value.bit_length() * math.log10(2))} digits"
    try:
        text = repr(value)
    except Exception as error:
        return f"{type(value).__name__} ({type(error).__name__})"
    return in_line(text)


def near(word: str, known: Iterable[str]) -> str:
    """The question that an error asks where ``word`` is like one that is known, else nothing."""
    found = difflib.get_close_matches(word, list(known), 1, 0.8)
    return f" (did you mean {found[0]!r}?)" if found else ""


def in_line(text: str) -> str:
    """``text`` in one line of at most ``LONGEST`` characters."""
    text = " ".join(text.split())
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 4]} ..."


def problem(error: BaseException) -> str:
    """What an error of a user's own code says: its type and its words, in one line of at most 200 characters."""
    try:
        words = " ".join(str(error).split())
    except Exception:
        words = "without words"
    text = f"{type(error).__name__}: {words}"
    return text if len(text) <= 200 else f"{text[:196]} ..."


def number_of(value: Any) -> int | float | None:
    """``value`` as a number of Python's, or None where it is no number."""
    # A duration of NumPy's calls itself a whole number.
    if isinstance(value, (bool, np.timedelta64)):
        return None
    if isinstance(value, Integral):
        return int(value)
    return float(value) if isinstance(value, Real) and not isinstance(value, Rational) else None


def whole_of(value: Any) -> int | None:
    """``value`` as a whole number of Python's, or None where it is none."""
    number = number_of(value)
    return int(number) if number is not None and (isinstance(number, int) or number.is_integer()) else None


def plain(value: Any) -> Any:
    """``value`` with numbers of Python's for those of NumPy, also in tuples: these compute in their own precision."""
    if isinstance(value, tuple):
        return tuple(map(plain, value)) if type(value) is tuple else value
    number = number_of(value)
    return value if number is None else number


def make_plain(record: Any) -> None:
    """``plain`` for every field of a frozen dataclass."""
    for field in dataclasses.fields(record):
        object.__setattr__(record, field.name, plain(getattr(record, field.name)))


def length_of(value: Any) -> float:
    """How many entries a sequence says to have, more than which nobody lists: a range may have more than ``len`` can count."""
    try:
        return len(value)
    except OverflowError:
        return math.inf


def path_of(value: Any) -> str | None:
    """``value`` as the text of a path where it is text or an ``os.PathLike``, else None."""
    try:
        path = os.fspath(value)
    except TypeError:
        return None
    return path if isinstance(path, str) else None


def is_finite(value: Any) -> bool:
    """Whether ``value`` is a number that a float can hold."""
    number = number_of(value)
    # Comparisons of whole numbers and floats are exact; a conversion of a long one would be an OverflowError.
    return number is not None and -sys.float_info.max <= number <= sys.float_info.max


def limits(above: float = -math.inf, least: float = -math.inf, most: float = math.inf) -> str:
    """Limits in words, with a space before them: `` > 0 and <= 5``."""
    words = [f"> {above:g}"] if above > -math.inf else []
    words += [f">= {least:g}"] if least > -math.inf else []
    words += [f"<= {most:g}"] if most < math.inf else []
    return " " + " and ".join(words) if words else ""


def is_within(value: Any, above: float = -math.inf, least: float = -math.inf, most: float = math.inf) -> bool:
    """Whether ``value`` is a finite number within limits."""
    number = number_of(value)
    return number is not None and is_finite(number) and number > above and least <= number <= most


def checked_number(name: str, value: Any, unit: str, **bounds: float) -> Any:
    """``plain(value)`` if it is a finite number within ``bounds`` (``above``, ``least``, ``most``), else ``ValueError``."""
    if not is_within(value, **bounds):
        raise ValueError(f"{name} = {shown(value)}; allowed: a finite number{limits(**bounds)} ({unit})")
    return plain(value)


def checked_range(name: str, value: Any, unit: str, **bounds: float) -> Any:
    """``plain(value)`` if it is a finite number or (low, high), ordered, within ``bounds``, else ``ValueError``."""
    pair = value if isinstance(value, tuple) else (value, value)
    if not (len(pair) == 2 and all(is_within(bound, **bounds) for bound in pair) and pair[0] <= pair[1]):
        words = f"a finite number{limits(**bounds)} or (low, high) of such, ordered"
        raise ValueError(f"{name} = {shown(value)}; allowed: {words} ({unit})")
    return plain(value)


def checked_count(name: str, value: Any, least: int, most: int) -> int:
    """``value`` as Python's if it is a whole number within limits, else ``ValueError``."""
    number = whole_of(value)
    if number is None or not least <= number <= most:
        raise ValueError(f"{name} = {shown(value)}; allowed: a whole number >= {least} and <= {most}")
    return number
