"""What an attribute may be when a state is given back: declared by the class that owns it, ``in_state``, and checked here.

What a class of the package does not declare follows from its kind. Floats are finite and have the shape that they had; all
else, whole numbers above all, is a constant and the same. A class of a user's own may keep whatever is of the same kind.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Integral, Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.physics.rig.values import shown

PACKAGES = ("birthsim_env", "baselines", "agents", "birthsim_build", "birthsim_drive", "birthsim_live")

POSITIONS = {"pos": 624, "buffer_pos": 4}
"""Where generators of NumPy stand in their own tables, and the lengths of these: NumPy itself checks neither."""


@dataclass(frozen=True)
class Kept:
    """An attribute that a state restores: numbers from ``least`` to ``most``, ``whole`` ones or any, also in a list or array.

    Where ``most`` is a name, the numbers count what the attribute of this name has along its first axis, or are an ``index``
    there. ``at`` are the places in an array where numbers are limited, if not all. An array that ``grows`` may have another
    length along its first axis, but ``shortest`` at least.
    """

    least: float = -math.inf
    most: float | str = math.inf
    whole: bool = False
    finite: bool = True
    index: bool = False
    at: tuple[Any, ...] = ()
    grows: bool = False
    shortest: int = 0

    def complaint(self, before: Any, value: Any, most: float) -> str:
        """Why ``value`` may not stand where ``before`` stood, or nothing; ``most`` is the limit as a number.

        What is None before it is first needed becomes an array of floats."""
        if before is None:
            before = value if value is None or getattr(value, "dtype", None) == np.float64 else np.zeros(0)
        if value is None:
            return "" if before is None else "is None; allowed: an array"
        if isinstance(before, np.ndarray):
            return _misshapen(before, value, self.grows, self.shortest) or self._beyond(value, most)
        if type(value) is not type(before) or (isinstance(value, list) and len(value) != len(before)):
            return f"is {shown(value)}; allowed: {type(before).__name__}, like {shown(before)}"
        for one in value if isinstance(value, list) else [value]:
            if isinstance(one, bool) or not isinstance(one, Integral if self.whole else Real):
                return f"is {shown(value)}; allowed: {'whole ' * self.whole}numbers"
            if complaint := self._beyond(np.array([one], dtype=object if isinstance(one, int) else np.float64), most):
                return complaint
        return ""

    def _beyond(self, array: NDArray[Any], most: float) -> str:
        if array.dtype.kind == "f" and self.finite and not np.isfinite(array).all():
            return "is not finite; allowed: finite numbers"
        array, allowed = (
            np.atleast_1d(array[self.at]),
            f"allowed: {'whole ' * self.whole}numbers from {self.least:.17g} to {most:.17g}",
        )
        if array.size and array.dtype.kind in "iufO" and not (array.min() >= self.least and array.max() <= most):
            wrong = array.max() if array.min() >= self.least else array.min()
            return f"has {shown(wrong)}; {allowed}"
        return f"has a fraction; {allowed}" if self.whole and array.dtype.kind == "f" and (array % 1.0).any() else ""


FLOATS = Kept()
"""What floats of the package are without a declaration."""

ANY = Kept(finite=False)
"""Floats that may also be infinite or NaN."""

Declared = Mapping[str, Kept | None]
"""Attribute -> what it may be; None leaves it out of states."""


def declared(kind: type) -> dict[str, Kept | None]:
    """What a class and those that it derives from declare."""
    return {name: kept for base in reversed(kind.__mro__) for name, kept in vars(base).get("in_state", {}).items()}


def is_own(kind: type) -> bool:
    """Whether a class is the package's."""
    return kind.__module__.partition(".")[0] in PACKAGES


def _misshapen(before: NDArray[Any], value: Any, grows: bool, shortest: int = 0) -> str:
    """Why ``value`` is no array like ``before``, or nothing."""
    if not isinstance(value, np.ndarray) or value.dtype != before.dtype:
        given = f"{value.dtype} {value.shape}" if isinstance(value, np.ndarray) else shown(value)
        return f"is {given}; allowed: an array of {before.dtype}"
    same = value.shape[1:] == before.shape[1:] and value.ndim == before.ndim and len(value) >= shortest
    if value.shape != before.shape and not (grows and same):
        allowed = f"(M, {', '.join(map(str, before.shape[1:]))})" if grows else str(before.shape)
        return f"has shape {value.shape}; allowed: {allowed}"
    return ""


def constant_complaint(before: Any, value: Any) -> str:
    """Why ``value`` is not what it was, or nothing."""
    if isinstance(before, (np.ndarray, np.generic)):
        same = isinstance(value, np.ndarray) and value.dtype == before.dtype and np.array_equal(before, value)
    else:
        same = not isinstance(value, np.ndarray) and json.dumps(before) == json.dumps(value) and type(before) is type(value)
    return "" if same else f"is {shown(value)}; allowed: {shown(before)}, as this environment has it"


def own_complaint(before: Any, value: Any, compiled: bool) -> str:
    """Why ``value`` may not stand for what a user's own part had, or nothing.

    None may become anything. Arrays may grow, but not those of a part that derives from a ``compiled`` one."""
    if before is None or value is None:
        return ""
    if isinstance(before, np.generic):
        before = np.array(before)
    if isinstance(before, np.ndarray):
        empty = isinstance(value, np.ndarray) and value.dtype == before.dtype and 0 in (value.size, before.size)
        return "" if empty and not compiled else _misshapen(before, value, before.ndim > 1 and not compiled)
    numbers = isinstance(before, Real) and isinstance(value, Real)
    if isinstance(value, np.ndarray) or not (numbers or type(before) is type(value)):
        return f"is {shown(value)}; allowed: a {type(before).__name__}"
    return ""


def is_beyond(state: Mapping[str, Any]) -> bool:
    """Whether the state of a generator stands beyond its own table."""
    tables = state, state.get("state", {})
    return any(not 0 <= table.get(name, 0) <= most for table in tables for name, most in POSITIONS.items())


def generator_complaint(before: np.random.Generator, value: Any) -> str:
    """Why ``value`` is no state of such a generator, or nothing."""
    kind: Any = type(before.bit_generator)
    allowed = f"allowed: the state of a {kind.__name__}"
    try:
        trial = kind()
        trial.state = value
        beyond = is_beyond(value)
    except Exception as error:
        return f"is no state of a generator ({type(error).__name__}); {allowed}"
    return f"stands beyond its table; {allowed}" if beyond else ""
