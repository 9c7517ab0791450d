"""Where a sentence of a docstring ends: not in brackets, not after an abbreviation, not after an initial."""

import re

ABBREVIATIONS = ("al", "approx", "cf", "e.g", "eq", "eqs", "fig", "figs", "i.e", "pp", "ref", "resp", "sec", "vol", "vs")
"""Without their last full stop, in small letters. `etc.` may end a sentence, so it is none."""

_STOP = re.compile(r"[.:;](?=\s|$)")
_INITIAL = re.compile(r"(?<!\d )\b[A-Z]$")
"""A single capital, which is a unit where a number stands before it: 10 N."""


def first_sentence(text: str) -> str:
    """The words of a one-line ``text`` before the full stop, colon or semicolon that ends its first sentence."""
    for stop in _STOP.finditer(text):
        before = text[: stop.start()]
        inside = before.count("(") > before.count(")") or before.count("[") > before.count("]")
        if not (inside or (stop[0] == "." and _is_short(before))):
            return before + "." * (stop[0] == ".")
    return text


def _is_short(before: str) -> bool:
    last = before.rpartition(" ")[2].lstrip("([").lower()
    return last in ABBREVIATIONS or bool(_INITIAL.search(before))
