"""What the plant computes from a rig's parameters, as C: the Python that does it is run on names instead of numbers."""

from typing import Any

import numpy as np

from birthsim_env.physics.rig.parameters import DECLARED, Parameters, value_of
from birthsim_env.physics.rig.rows import Substitute, plant_parameters, rows_of

STAYS = "geometry"
"""The section whose numbers stay as they were built: the law and the target know the linkage too."""

_INFIX = {"add": "+", "subtract": "-", "multiply": "*", "divide": "/", "greater": ">"}
_CHOOSING = {"maximum": ">", "minimum": "<"}


class Expression(np.lib.mixins.NDArrayOperatorsMixin):
    """A number that C will know, as the C expression that computes it; operations of NumPy on it give longer ones."""

    def __init__(self, text: str) -> None:
        self.text = text

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> "Expression":
        terms = [_text(term) for term in inputs]
        if ufunc.__name__ in _INFIX:
            return Expression(f"({terms[0]} {_INFIX[ufunc.__name__]} {terms[1]})")
        if ufunc.__name__ in _CHOOSING:
            return Expression(f"({terms[0]} {_CHOOSING[ufunc.__name__]} {terms[1]} ? {terms[0]} : {terms[1]})")
        if ufunc is np.sqrt:
            return Expression(f"sqrt({terms[0]})")
        return NotImplemented  # type: ignore[no-any-return]

    def __array_function__(self, function: Any, types: Any, terms: tuple[Any, ...], options: Any) -> "Expression":
        if function is np.where:
            return Expression("({} ? {} : {})".format(*map(_text, terms)))
        return NotImplemented  # type: ignore[no-any-return]


def _text(term: Any) -> str:
    return term.text if isinstance(term, Expression) else float(term).hex()


def parameter_names(rig: Parameters) -> list[str]:
    """Dotted names of a rig's numbers that may be set, in the order of their declarations: those that its plant computes with.

    Options (``declaration.Parameter``) are not among them, since another plant is compiled for those.
    """
    return [
        name
        for name, one in DECLARED.items()
        if name in plant_parameters()
        and rig.linkage.topology.has(name)
        and not (one.choices or one.option or name.partition(".")[0] == STAYS)
    ]


def derived_parameters(rig: Parameters) -> list[str]:
    """C expressions of the rows of ``physics.compiled.lanes``, over ``p[k]``, the k-th of ``parameter_names``."""
    place = {name: Expression(f"p[{k}]") for k, name in enumerate(parameter_names(rig))}
    return [_text(row) for row in rows_of(Substitute(lambda name: place[name] if name in place else value_of(rig, name)))]
