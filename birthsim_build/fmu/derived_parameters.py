"""What the plant computes from a rig's parameters, as C: the Python that does it is run on names instead of numbers."""

import dataclasses
from types import SimpleNamespace
from typing import Any

import numpy as np

from birthsim_env.physics.compiled.lanes import rows_of
from birthsim_env.physics.rig.parameters import Parameters

SECTIONS = ("cylinder1", "cylinder2", "mechanics", "friction", "chambers", "valves", "air")
"""Sections whose numbers may be set: the linkage stays as it was built, for the law and the target know it too."""

_INFIX = {"add": "+", "subtract": "-", "multiply": "*", "divide": "/", "greater": ">"}


class Expression(np.lib.mixins.NDArrayOperatorsMixin):
    """A number that C will know, as the C expression that computes it; operations of NumPy on it give longer ones."""

    def __init__(self, text: str) -> None:
        self.text = text

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> "Expression":
        terms = [_text(term) for term in inputs]
        if ufunc.__name__ in _INFIX:
            return Expression(f"({terms[0]} {_INFIX[ufunc.__name__]} {terms[1]})")
        if ufunc is np.maximum:
            return Expression(f"({terms[0]} > {terms[1]} ? {terms[0]} : {terms[1]})")
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
    """Dotted names of the numbers that may be set, in the order of ``SECTIONS``.

    Options (``quantities.quantity``) are not among them, since another plant is compiled for those, nor is the speed from which
    collisions are reported, which the plant does not use.
    """
    return [
        f"{section}.{field.name}"
        for section in SECTIONS
        for field in dataclasses.fields(getattr(rig, section))
        if not (isinstance(field.default, str) or field.metadata["option"] or field.name == "impact_speed")
    ]


def derived_parameters(rig: Parameters) -> list[str]:
    """C expressions of the rows of ``physics.compiled.lanes``, over ``p[k]``, the k-th of ``parameter_names``."""
    place = {name: Expression(f"p[{k}]") for k, name in enumerate(parameter_names(rig))}
    sections: dict[str, Any] = {"geometry": rig.geometry}
    for section in SECTIONS:
        part = getattr(rig, section)
        names = [field.name for field in dataclasses.fields(part)]
        sections[section] = SimpleNamespace(**{name: place.get(f"{section}.{name}", getattr(part, name)) for name in names})
        for name, derived in vars(type(part)).items():
            if isinstance(derived, property):
                assert derived.fget is not None
                setattr(sections[section], name, derived.fget(sections[section]))
    return [_text(row) for row in rows_of(SimpleNamespace(**sections))]
