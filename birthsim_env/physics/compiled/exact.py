"""Elementary functions from + - * / and whole numbers alone: the same bits on every processor.

The C library chooses its ``exp``, ``log``, ``sin`` and ``cos`` by the processor, NumPy its own, and they differ in the last
bit; after some seconds of dry friction so does the number in a table. Everything that decides an episode therefore calls
these, from kernels and from Python. Errors, against 40 digits, are below one unit in the last place where nothing else is
said (`tests/physics/compiled/test_exact.py`). Sources: argument reduction of Cody and Waite (1980), Taylor series.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.physics.compiled.compilation import helper, kernel, over

PI = 3.141592653589793
LOG2_E = 1.4426950408889634

# ln 2 in two parts, pi/2 in three: the first parts end in zeros, so that their products with a small whole number are exact.
_LN2_HIGH, _LN2_LOW = float.fromhex("0x1.62e42fee00000p-1"), float.fromhex("0x1.a39ef35793c76p-33")
_HALF_PI = tuple(map(float.fromhex, ("0x1.921fb54400000p+0", "0x1.0b4611a600000p-34", "0x1.3198a2e037073p-69")))

_SINE = tuple((-1) ** k / math.factorial(2 * k + 1) for k in range(9))
_COSINE = tuple((-1) ** k / math.factorial(2 * k) for k in range(9))
_EXP = tuple(1 / math.factorial(k) for k in range(15))
_LOG = tuple(2 / (2 * k + 3) for k in range(12))


@helper
def rounded(value: float, step: float) -> float:
    """The multiple of ``step`` that is nearest to ``value``, the larger of two."""
    return step * math.floor(value / step + 0.5)


@helper
def _series(square: float, coefficients: tuple[float, ...]) -> float:
    """Polynomial in ``square`` by Horner's rule, lowest coefficient first."""
    value = coefficients[-1]
    for k in range(len(coefficients) - 2, -1, -1):
        value = value * square + coefficients[k]
    return value


@helper
def _turn(x: float, quarter: float) -> float:
    """sin(x + quarter pi/2) for a whole number ``quarter``."""
    turns = np.floor(x * (2.0 / PI) + 0.5)
    rest = ((x - turns * _HALF_PI[0]) - turns * _HALF_PI[1]) - turns * _HALF_PI[2]
    square, turns = rest * rest, turns + quarter
    quadrant = turns - 4.0 * np.floor(0.25 * turns)
    even = quadrant == 0.0 or quadrant == 2.0
    value = rest * _series(square, _SINE) if even else _series(square, _COSINE)
    return value if quadrant < 2.0 else -value


@helper
def sine(x: float) -> float:
    """sin(x), x in rad; beyond 1e6 the error grows."""
    return _turn(x, 0.0)


@helper
def cosine(x: float) -> float:
    """cos(x), x in rad; beyond 1e6 the error grows."""
    return _turn(x, 1.0)


def direction(angle: Any) -> tuple[Any, Any]:
    """cos and sin of an angle, rad, a number or an array (L,)."""
    if np.ndim(angle) == 0:
        return cosine(float(angle)), sine(float(angle))
    rows = np.empty_like(angle, shape=(2, len(angle)))
    over(_directions, angle, rows)
    return rows[0], rows[1]


@kernel
def _directions(angle: NDArray[np.float64], rows: NDArray[np.float64]) -> None:
    for i in range(angle.shape[0]):
        rows[0, i], rows[1, i] = cosine(angle[i]), sine(angle[i])


@helper
def _less_one(x: float, doublings: float) -> float:
    """exp(x) - 1 without its power of two: exp(x - ``doublings`` ln 2) - 1, for the nearest whole number of doublings."""
    rest = (x - doublings * _LN2_HIGH) - doublings * _LN2_LOW
    return rest * _series(rest, _EXP[1:])


@helper
def _power(doublings: float) -> float:
    """2^doublings for a whole number from -1022 to 1023."""
    return np.int64(np.int64(np.int32(doublings) + 1023) << 52).view(np.float64)


@helper
def exp(x: float) -> float:
    """e^x; 0 below -708, infinite above 709.7, NaN for NaN."""
    if not -708.0 < x < 709.7:
        return math.inf if x >= 709.7 else 0.0 if x <= -708.0 else x
    doublings = np.floor(x * LOG2_E + 0.5)
    return _power(doublings) * (1.0 + _less_one(x, doublings))


@helper
def exp2(x: float) -> float:
    """2^x, exact for whole numbers; 0 below -1022, infinite above 1023, NaN for NaN."""
    if not -1022.0 <= x <= 1023.0:
        return math.inf if x > 1023.0 else 0.0 if x < -1022.0 else x
    doublings = np.floor(x + 0.5)
    rest = x - doublings
    return _power(doublings) * (1.0 + _less_one(rest * _LN2_HIGH + rest * _LN2_LOW, 0.0))


@helper
def log(x: float) -> float:
    """Natural logarithm of a positive normal number; -infinity at 0, NaN below, itself for infinity and NaN."""
    if not 0.0 < x < math.inf:
        return -math.inf if x == 0.0 else math.nan if x < 0.0 else x
    bits = np.float64(x).view(np.int64)
    mantissa = np.int64((bits & 0x000FFFFFFFFFFFFF) | 0x3FF0000000000000).view(np.float64)
    large = mantissa > 1.4142135623730951
    doublings = float((bits >> 52) - 1023) + (1.0 if large else 0.0)
    above = (0.5 * mantissa if large else mantissa) - 1.0
    # log(1 + f) = 2 s + (2/3) s^3 + (2/5) s^5 + ... with s = f/(2 + f), and 2 s = f - s f.
    s = above / (2.0 + above)
    square = s * s
    return doublings * _LN2_HIGH + (above - (s * (above - square * _series(square, _LOG)) - doublings * _LN2_LOW))


@helper
def log2(x: float) -> float:
    """Logarithm of ``x`` to base 2, within two units in the last place; exact for powers of two."""
    return log(x) / log(2.0)


@helper
def log1p(x: float) -> float:
    """ln(1 + x) for x > -1, exact for small x too; infinite for infinity."""
    whole = 1.0 + x
    # What rounding 1 + x took away, to first order.
    return log(whole) + (x - (whole - 1.0)) / whole if whole < math.inf else log(whole)


@helper
def tanh(x: float) -> float:
    """Hyperbolic tangent, within three units in the last place; NaN for NaN. It has no branches, so that loops vectorise."""
    size = abs(x) if abs(x) < 20.0 else 20.0
    doublings = np.floor(2.0 * size * LOG2_E + 0.5)
    power = _power(doublings)
    # exp(2 |x|) - 1 without the loss of a difference.
    grown = power * _less_one(2.0 * size, doublings) + (power - 1.0)
    return math.copysign(grown / (grown + 2.0), x) if x == x else x


@kernel
def _number(which: int, x: float) -> float:
    return sine(x) if which == 0 else cosine(x) if which == 1 else exp(x) if which == 2 else log2(x)


def number(name: str, x: float) -> float:
    """``sine``, ``cosine``, ``exp`` or ``log2`` of a number, from Python; one kernel for the four."""
    return float(_number(("sine", "cosine", "exp", "log2").index(name), float(x)))
