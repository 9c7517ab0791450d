"""Exact derivatives of helpers: their own source runs on numbers that carry a gradient (forward differentiation).

At a kink, where ``max``, ``min`` or ``abs`` meet a tie, the gradient is the mean of those of both sides. Central differences
tend to the same value, and so does the first harmonic of the answer to a small sine: the describing function of a
characteristic of slopes k- and k+ is (k- + k+)/2 at every amplitude.
"""

from __future__ import annotations

import math
from functools import cache
from types import FunctionType, ModuleType, SimpleNamespace
from typing import Any

from birthsim_env.physics.compiled.lanes import Array


class Dual:
    """A value and its gradient (D,) with respect to D chosen quantities."""

    __slots__ = ("gradient", "value")

    def __init__(self, value: float, gradient: Array) -> None:
        self.value, self.gradient = value, gradient

    def __add__(self, other: Dual | float) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.value + other.value, self.gradient + other.gradient)
        return Dual(self.value + other, self.gradient)

    def __mul__(self, other: Dual | float) -> Dual:
        if isinstance(other, Dual):
            return Dual(self.value * other.value, self.gradient * other.value + self.value * other.gradient)
        return Dual(self.value * other, self.gradient * other)

    def __rtruediv__(self, other: float) -> Dual:
        inverse = 1.0 / self.value
        return Dual(other * inverse, self.gradient * (-other * inverse * inverse))

    def __truediv__(self, other: Dual | float) -> Dual:
        return self * (1.0 / other)

    def __neg__(self) -> Dual:
        return Dual(-self.value, -self.gradient)

    def __sub__(self, other: Dual | float) -> Dual:
        return self + (-other)

    def __rsub__(self, other: float) -> Dual:
        return -self + other

    __radd__, __rmul__ = __add__, __mul__

    def __abs__(self) -> Dual:
        return maximum(self, -self)  # type: ignore[return-value]

    def __gt__(self, other: Dual | float) -> bool:
        return self.value > value_of(other)

    def __lt__(self, other: Dual | float) -> bool:
        return self.value < value_of(other)


def value_of(number: Dual | float) -> float:
    """The number without its gradient."""
    return number.value if isinstance(number, Dual) else number


def maximum(a: Dual | float, b: Dual | float) -> Dual | float:
    """The larger of two; of two equal ones the mean, which has the mean gradient."""
    if value_of(a) == value_of(b):
        return 0.5 * (a + b)
    return a if a > b else b


def minimum(a: Dual | float, b: Dual | float) -> Dual | float:
    """The smaller of two, as ``maximum``."""
    return -maximum(-a, -b)


def root(number: Dual | float) -> Dual | float:
    """The square root."""
    if not isinstance(number, Dual):
        return math.sqrt(number)
    value = math.sqrt(number.value)
    return Dual(value, number.gradient * (0.5 / value))


class _Module:
    """A module of helpers as ``lifted`` sees it."""

    def __init__(self, module: ModuleType) -> None:
        self._module = module

    def __getattr__(self, name: str) -> Any:
        return lifted(getattr(self._module, name))


@cache
def lifted(thing: Any) -> Any:
    """A compiled helper as a Python function that also takes ``Dual``; modules become their lifted selves, data stays."""
    if thing is math:
        return SimpleNamespace(sqrt=root)
    if isinstance(thing, ModuleType):
        return _Module(thing)
    source = getattr(thing, "py_func", thing)
    if not isinstance(source, FunctionType):
        return thing
    names = {name: lifted(source.__globals__[name]) for name in source.__code__.co_names if name in source.__globals__}
    return FunctionType(source.__code__, names | {"max": maximum, "min": minimum})
