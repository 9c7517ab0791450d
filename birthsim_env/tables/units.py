"""Units that a heading may state, and what they are in SI."""

UNITS: dict[str, tuple[str, float]] = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), ("s", 1.0)),
    **dict.fromkeys(("ms", "msec", "millisecond", "milliseconds"), ("s", 1e-3)),
    **dict.fromkeys(("us", "usec", "microsecond", "microseconds"), ("s", 1e-6)),
    **dict.fromkeys(("ns", "nsec", "nanosecond", "nanoseconds"), ("s", 1e-9)),
    **{"m": ("m", 1.0), "cm": ("m", 1e-2), "mm": ("m", 1e-3), "um": ("m", 1e-6)},
    **dict.fromkeys(("meter", "meters", "metre", "metres"), ("m", 1.0)),
    **{"N": ("N", 1.0), "mN": ("N", 1e-3), "kN": ("N", 1e3), "MN": ("N", 1e6)},
    **{"daN": ("N", 10.0), "kgf": ("N", 9.80665), "lbf": ("N", 4.4482216152605)},
    **dict.fromkeys(("newton", "newtons"), ("N", 1.0)),
    **{"mPa": ("Pa", 1e-3), "Pa": ("Pa", 1.0), "hPa": ("Pa", 1e2), "kPa": ("Pa", 1e3), "MPa": ("Pa", 1e6)},
    **{"mbar": ("Pa", 1e2), "bar": ("Pa", 1e5), "psi": ("Pa", 6894.757293168)},
    **dict.fromkeys(("pascal", "pascals"), ("Pa", 1.0)),
    **{
        "Pa abs": ("Pa", 1.0),
        "kPa abs": ("Pa", 1e3),
        "bar abs": ("Pa", 1e5),
        "bara": ("Pa", 1e5),
        "psia": ("Pa", 6894.757293168),
    },
    **{"N/m": ("N/m", 1.0), "N/mm": ("N/m", 1e3), "kN/m": ("N/m", 1e3)},
    **{"V": ("V", 1.0), "mV": ("V", 1e-3), "mA": ("A", 1e-3)},
    **dict.fromkeys(("1", "-"), ("1", 1.0)),
    **dict.fromkeys(("%", "percent"), ("1", 1e-2)),
}
"""Unit -> its SI unit and how many of it one is; "1" is none."""

_FOLDED: dict[str, set[tuple[str, float]]] = {}
for _unit, _meaning in UNITS.items():
    _FOLDED.setdefault(_unit.casefold(), set()).add(_meaning)


def unit_of(word: str) -> tuple[str, float] | None:
    """The SI unit and the factor of ``word``; None where it is no unit, or, as "mpa", could be two."""
    word = " ".join(word.replace("\u00b5", "u").replace("\u03bc", "u").split())
    found = _FOLDED.get(word.casefold(), set())
    return UNITS.get(word) or (next(iter(found)) if len(found) == 1 else None)


def units_for(unit: str) -> str:
    """The units in which a column may be whose SI unit is ``unit``, for errors."""
    short = [word for word, (si, _) in UNITS.items() if si == unit and len(word) <= 4]
    kind = "absolute pressures in " if unit == "Pa" else "no unit, " if unit == "1" else ""
    return kind + ", ".join(dict.fromkeys(short))
