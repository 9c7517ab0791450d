"""Cells of text as numbers: what is missing, instants, and why a cell is none of these."""

import math
import re
from datetime import UTC, datetime

from birthsim_env.physics.rig.values import shown
from birthsim_env.tables.table import Reading

MISSING = frozenset(
    (
        *("", "-", "--", "nan", "na", "n/a", "#n/a", "#na", "#nv", "null", "none", "nil"),
        "1.#ind",
        "-1.#ind",
        "1.#qnan",
        "-1.#qnan",
    )
)
"""Cells, in lower case, that say that there is no value."""

_FORTRAN = re.compile(r"[-+]?[\d.]+[dD][-+]?\d+")
_DATE = re.compile(r"(\d{4}[-/]\d{2}[-/]\d{2})(?:[T ](\d{2}:\d{2}:\d{2})(?:[.,](\d{1,9}))?)?(Z|[-+]\d{2}:?\d{2})?")
_TIME = re.compile(r"(\d{1,3}):([0-5]\d):([0-5]\d)(?:[.,](\d{1,9}))?")

_WHY = (
    (r"[-+]?\d{1,3}(?:([, '\u00a0\u202f])\d{3})(?:\1\d{3})*\.\d*", "it has separators of thousands", "1234.5"),
    (r"[-+]?\d{1,3}(?:\.\d{3})+(?:,\d*)?", "it has separators of thousands", "1234.5"),
    (r"[-+]?\d{1,3}(?:,\d{3})+", "its comma may be a decimal one or separate thousands", "1234.5"),
    (r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?", "it has a decimal comma", "a decimal point"),
    (r"[-+]?\d{1,3}(?:[ '_\u00a0\u202f]\d{3})+", "it has separators of thousands", "1234"),
    (
        r"\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4}.*|\d{1,2}:\d{2}.*",
        "it looks like a date or a time of day",
        "s, or 2024-05-01T10:00:00.001",
    ),
    (r"[-+]?[\d.]+(?:[eE][-+]?\d+)?\s*(?:%|[^\W\d_/]+(?:/\w+)?)", "it has a unit", "the unit in the heading"),
    (r".*\d[ij]\)?|\(.*[ij]\)", "it is complex", "a real number"),
)
"""What a cell that is no number looks like; the cause in words, and what is allowed instead."""


def number(text: str, decimal_comma: bool = False) -> float | None:
    """The number that a cell says, NaN where it says that there is none; None for a cell that is no number."""
    text = text.strip()
    if is_missing(text):
        return math.nan
    if "_" in text or (decimal_comma and "." in text):  # a point would separate thousands
        return None
    text = (text.replace(",", ".") if decimal_comma else text).replace("\u2212", "-")
    try:
        return float(re.sub("[dD]", "e", text) if _FORTRAN.fullmatch(text) else text)
    except ValueError:
        return None


def instant(text: str) -> tuple[str, int] | None:
    """The kind of an instant (``date``, ``zoned`` date, ``time`` of a day) and its ns; None for a cell that is no instant."""
    text = text.strip()
    day = _DATE.fullmatch(text)
    if day is not None:
        try:
            whole = f"{day[1].replace('/', '-')}T{day[2] or '00:00:00'}"
            at = datetime.fromisoformat(whole + (day[4] or "")).replace(tzinfo=None if day[4] else UTC)
        except ValueError:
            return None
        since = at.astimezone(UTC) - datetime(1970, 1, 1, tzinfo=UTC)
        seconds = since.days * 86400 + since.seconds
        return ("zoned" if day[4] else "date"), seconds * 10**9 + int((day[3] or "0").ljust(9, "0"))
    clock = _TIME.fullmatch(text)
    if clock is None:
        return None
    seconds = 3600 * int(clock[1]) + 60 * int(clock[2]) + int(clock[3])
    return "time", seconds * 10**9 + int((clock[4] or "0").ljust(9, "0"))


def is_missing(text: str) -> bool:
    """Whether a cell says that there is no value."""
    return text.strip().casefold() in MISSING


def is_number(text: str, decimal_comma: bool = False) -> bool:
    """Whether a cell says a number or an instant."""
    return not is_missing(text) and (number(text, decimal_comma) is not None or instant(text) is not None)


def why(text: str, how: Reading) -> str:
    """What a cell that is no number looks like, and what is allowed."""
    if how.decimal_comma and number(text) is not None:
        return "; it has a decimal point, allowed: decimal commas, which are asked for"
    for pattern, cause, allowed in _WHY:
        if re.fullmatch(pattern, text.strip()):
            option = ", or --decimal-comma" if "comma" in cause and how.has_options else ""
            return f"; {cause}, allowed: {allowed}{option}"
    return ""


class Cells:
    """Cells of a column, one after the other; ``fault`` is in words what the first one is that is neither number nor missing.

    A column may hold instants from its first row on; they become s since the first one. ``is_clock`` says so then.
    """

    def __init__(self, how: Reading | None = None) -> None:
        self.fault = ""
        self._how = how or Reading()
        self._kind, self._first = "", 0

    @property
    def is_clock(self) -> bool:
        return bool(self._kind)

    def read(self, text: str, row: int, where: str) -> float:
        """The number of the cell of a ``row`` from 0 on; ``where`` is for the fault, such as ``line``, with its number."""
        value = None if self._kind else number(text, self._how.decimal_comma)
        if value is not None:
            return value
        if is_missing(text):
            return math.nan
        found = instant(text)
        if found is not None and row == 0:
            self._kind, self._first = found
        if found is not None and found[0] == self._kind:
            return (found[1] - self._first) / 1e9
        if not self.fault:
            self.fault = f"{where}: {shown(text.strip()[:60])} is no number{why(text, self._how)}"
        return math.nan
