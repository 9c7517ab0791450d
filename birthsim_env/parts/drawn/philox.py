"""Philox4x64-10 (Salmon, Moraes, Dror and Shaw 2011): random words of a key and a number, with nothing to carry along.

NumPy's generator ``numpy.random.Philox(key=...)`` gives the same words one after the other. A function of a key and a number
needs neither seeding nor a state, so that kernels and devices draw any word of any stream at once.
"""

import numpy as np

from birthsim_env.physics.compiled.compilation import helper

ROUNDS = 10
_FACTOR, _OTHER_FACTOR = np.uint64(0xD2E7470EE14C6C93), np.uint64(0xCA5A826395121157)
_STEP, _OTHER_STEP = np.uint64(0x9E3779B97F4A7C15), np.uint64(0xBB67AE8584CAA73B)
_HALF = np.uint64(0xFFFFFFFF)


@helper
def _product_high(a: np.uint64, b: np.uint64) -> np.uint64:
    """The upper 64 bits of a 64-bit product."""
    shift = np.uint64(32)
    a_high, a_low, b_high, b_low = a >> shift, a & _HALF, b >> shift, b & _HALF
    middle = a_high * b_low + ((a_low * b_low) >> shift)
    other = a_low * b_high + (middle & _HALF)
    return a_high * b_high + (middle >> shift) + (other >> shift)


@helper
def word(seed: np.uint64, part: np.uint64, number: np.uint64) -> np.uint64:
    """Word ``number`` from 0 on of the stream whose key is (``seed``, ``part``)."""
    # A counter gives four words; NumPy counts from 1 on.
    a, b, c, d = (number >> np.uint64(2)) + np.uint64(1), np.uint64(0), np.uint64(0), np.uint64(0)
    for _ in range(ROUNDS):
        a, b, c, d = (
            _product_high(_OTHER_FACTOR, c) ^ b ^ seed,
            _OTHER_FACTOR * c,
            _product_high(_FACTOR, a) ^ d ^ part,
            _FACTOR * a,
        )
        seed, part = seed + _STEP, part + _OTHER_STEP
    low, high = number & np.uint64(1), number & np.uint64(2)
    first, second = (b if low else a), (d if low else c)
    return second if high else first


@helper
def fraction(word: np.uint64) -> float:
    """A number in [0, 1) with 53 of a word's bits, as NumPy makes it."""
    return (word >> np.uint64(11)) * (1.0 / 9007199254740992.0)
