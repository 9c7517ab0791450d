"""Units of the project's figures as exponents of base units, as the FMI standards write them."""

import re
from collections import Counter

_BASE = {"kg": {"kg": 1}, "m": {"m": 1}, "s": {"s": 1}, "K": {"K": 1}, "rad": {"rad": 1}}
_DERIVED = {
    "N": {"kg": 1, "m": 1, "s": -2}, "Pa": {"kg": 1, "m": -1, "s": -2}, "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3}, "Hz": {"s": -1},
}  # fmt: skip
_SYMBOL = re.compile(r"([A-Za-z]+)(\d*)")


def exponents(unit: str) -> dict[str, int]:
    """``"W/(m2 K)"`` -> ``{"kg": 1, "s": -3, "K": -1}``; ``"-"`` and ``"1"`` have none. ``ValueError`` for unknown symbols."""
    total: Counter[str] = Counter()
    above, _, below = unit.partition("/")
    for part, sign in ((above, 1), (below, -1)):
        for symbol in part.strip("()").split():
            found = _SYMBOL.fullmatch(symbol)
            if found and found[1] in _BASE | _DERIVED:
                for base, power in (_BASE | _DERIVED)[found[1]].items():
                    total[base] += sign * power * int(found[2] or 1)
            elif symbol not in ("1", "-"):
                raise ValueError(f"unit = {unit!r}; allowed: products and one quotient of {', '.join(_BASE | _DERIVED)}")
    return {base: power for base, power in total.items() if power}
