"""The elementary functions of ours against 40 digits of mpmath, and their bits compiled against plain Python's."""

import math

import mpmath
import numpy as np
import pytest

from birthsim_env.physics.compiled import exact

RNG = np.random.default_rng(0)
SMALL = 10.0 ** RNG.uniform(-12, 0, 300)
ANY = RNG.uniform(-1, 1, 300)
TURNS = np.concatenate([ANY, 100 * ANY, 1e6 * ANY, SMALL, math.pi / 2 * np.arange(-20, 21)])

# Function, its truth, where, and the error in units in the last place. A series whose last addition dominates is off by less
# than one unit; argument reduction, a division or a second logarithm add one each.
CASES = {
    "sine": (mpmath.sin, TURNS, 2),
    "cosine": (mpmath.cos, TURNS, 2),
    "exp": (mpmath.exp, np.concatenate([ANY, 700 * ANY, SMALL]), 2),
    "exp2": (lambda x: mpmath.mpf(2) ** x, np.concatenate([ANY, 1000 * ANY, SMALL]), 2),
    "log": (mpmath.log, np.concatenate([10.0 ** (300 * ANY), 1 + 1e-3 * ANY, 1 + 0.4 * ANY]), 2),
    "log2": (lambda x: mpmath.log(x, 2), np.concatenate([10.0 ** (300 * ANY), 1 + 0.4 * ANY]), 3),
    "log1p": (mpmath.log1p, np.concatenate([SMALL, 1e3 * SMALL, -0.9 * SMALL]), 2),
    "tanh": (mpmath.tanh, np.concatenate([3 * ANY, SMALL, 30 * ANY]), 3),
}


@pytest.mark.parametrize("name", CASES)
def test_against_forty_digits_and_plain_python(name):
    truth, places, units = CASES[name]
    function = getattr(exact, name)
    with mpmath.workdps(40):
        for x in map(float, places):
            got, want = function(x), truth(mpmath.mpf(x))
            assert abs(mpmath.mpf(got) - want) <= units * math.ulp(float(want)), (name, x)
            assert function.py_func(x) == got, (name, x)


def test_whole_powers_of_two_are_exact():
    for k in range(-1022, 1024):
        assert exact.exp2(float(k)) == math.ldexp(1.0, k)
        assert exact.log2(math.ldexp(1.0, k)) == pytest.approx(k, rel=3 * 2**-53)
    assert [exact.log2(2.0**k) for k in range(-4, 5)] == list(range(-4, 5))


def test_special_values():
    infinity, nothing = math.inf, math.nan
    assert [exact.exp(x) for x in (0.0, infinity, -infinity, 750.0, -708.0)] == [1.0, infinity, 0.0, infinity, 0.0]
    assert [exact.exp2(x) for x in (0.0, infinity, -infinity, 1023.2, -1022.2)] == [1.0, infinity, 0.0, infinity, 0.0]
    assert [exact.log(x) for x in (1.0, 0.0, infinity)] == [0.0, -infinity, infinity]
    assert [exact.log1p(x) for x in (0.0, 1e-300, infinity)] == [0.0, 1e-300, infinity]
    assert [exact.tanh(x) for x in (infinity, -infinity, 20.0, -20.0, 1e-300)] == [1.0, -1.0, 1.0, -1.0, 1e-300]
    assert [exact.tanh(-x) for x in ANY] == [-exact.tanh(x) for x in ANY]
    assert math.copysign(1.0, exact.tanh(-0.0)) == math.copysign(1.0, exact.sine(-0.0)) == -1.0
    assert (exact.sine(math.pi / 2), exact.cosine(0.0)) == (1.0, 1.0)
    assert all(math.isnan(f(nothing)) for f in (exact.exp, exact.exp2, exact.log, exact.log1p, exact.tanh))
    assert math.isnan(exact.log(-1.0))


def test_a_multiple_is_the_nearest_and_the_larger_of_two():
    assert [exact.rounded(x, 0.5) for x in (0.7, 0.75, 0.8, -0.7, -0.75, -0.8)] == [0.5, 1.0, 1.0, -0.5, -0.5, -1.0]


def test_directions_and_functions_by_name():
    for angles in np.array([[0.0, 0.3, -2.0, 7.5], [1.0, 2.0, 3.0, 4.0]]):  # twice: a fresh array may hold what was freed
        along, across = exact.direction(angles)
        np.testing.assert_array_equal(along, [exact.cosine(x) for x in angles])
        np.testing.assert_array_equal(across, [exact.sine(x) for x in angles])
    assert exact.direction(0.3) == (exact.cosine(0.3), exact.sine(0.3))
    for name in ("sine", "cosine", "exp", "log2"):
        assert exact.number(name, 0.7) == getattr(exact, name)(0.7)
