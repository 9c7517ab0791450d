"""Functions of a user's own: how many arguments they take, whatever they are made of."""

import inspect
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Arguments:
    """How many positional arguments a callable needs and takes at most, what it calls the first of them, and which keywords it
    cannot do without."""

    needed: int
    most: float
    names: tuple[str, ...] = ()
    keywords: tuple[str, ...] = ()

    def take(self, count: int) -> bool:
        """Whether it can be called with so many."""
        return self.needed <= count <= self.most and not self.keywords


def arguments_of(function: Callable[..., Any]) -> Arguments:
    """The arguments of a function, method, class, partial, callable object, compiled function or ``np.vectorize``.

    What does not say what it takes, takes anything."""
    if isinstance(function, np.vectorize):
        function = function.pyfunc
    try:
        listed = list(inspect.signature(function).parameters.values())
    except (TypeError, ValueError):
        return Arguments(0, math.inf)
    placed = [one for one in listed if one.kind in (one.POSITIONAL_ONLY, one.POSITIONAL_OR_KEYWORD)]
    needed = [one for one in placed if one.default is one.empty]
    most = math.inf if any(one.kind is one.VAR_POSITIONAL for one in listed) else len(placed)
    keywords = tuple(one.name for one in listed if one.kind is one.KEYWORD_ONLY and one.default is one.empty)
    return Arguments(len(needed), most, tuple(one.name for one in placed), keywords)
