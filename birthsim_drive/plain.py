"""Helpers of kernels as the Python functions that they are."""

from collections.abc import Callable
from typing import Any


def in_python(helper: Callable[..., float]) -> Callable[..., float]:
    """A helper of kernels in Python, with the same bits: a call of machine code takes longer than a few operations, and the
    first one, of what was not built, a second."""
    function: Any = getattr(helper, "py_func", helper)
    plain: Callable[..., float] = function
    return plain
