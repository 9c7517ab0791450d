"""Arrays that a user gives: what becomes floats, and what does not, with the reason."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.physics.rig.values import number_of, problem

UNREADABLE = (TypeError, ValueError, OverflowError, RecursionError, MemoryError, RuntimeError)
"""What arrays of other libraries raise besides: PyTorch a ``RuntimeError`` for a tensor that requires a gradient."""

KINDS = {"b": "True and False", "c": "complex numbers", "U": "text", "S": "text", "M": "dates", "m": "times", "V": "records"}
"""Kinds of arrays that are no numbers, by NumPy's letter."""


def floats_of(value: Any, arrays: Any = np) -> NDArray[np.float64]:
    """``value`` as float64, as an array of NumPy's or of the module ``arrays``, and no copy where it is one already.

    Raises ``ValueError`` that says why not: for what is no array of numbers, and for masked entries, complex numbers, text, and
    True and False, which would become numbers in silence.
    """
    if type(value) is np.ndarray and value.dtype == np.float64 and arrays is np:
        return value
    try:
        masked = _is_masked(value)
        array = None if masked else arrays.asarray(value)
    except UNREADABLE as error:
        raise ValueError(problem(error)) from error
    if array is None:
        raise ValueError("it has masked entries")
    kind = array.dtype.kind
    if kind in KINDS:
        raise ValueError(f"it holds {KINDS[kind]}")
    if kind == "O" and not all(number_of(one) is not None for one in array.flat):
        raise ValueError("it holds what is no number")
    try:
        floats: NDArray[np.float64] = array.astype(np.float64, copy=False)
    except UNREADABLE as error:
        raise ValueError(problem(error)) from error
    return floats


def shape_of(value: Any) -> tuple[int, ...]:
    """The shape of an array, or () for what ``floats_of`` refuses."""
    try:
        return np.shape(value)
    except UNREADABLE:
        return ()


PLAIN = (np.ndarray, float, int, np.float64, np.float32)


def _is_masked(value: Any) -> bool:
    kind = type(value)  # nearly always one of these, in every step
    if kind in PLAIN:
        return False
    return any(map(_is_masked, value)) if kind in (list, tuple) else bool(np.ma.is_masked(value))
