"""The rows that kernels compute with: every parameter of the plant, and every number that is derived from parameters.

They stand in the order of the sections and of their declarations, the derived numbers of a section behind its parameters, those
of the whole rig last. A row of a cylinder has the cylinder's number behind its name.
"""

from collections.abc import Callable, Iterator
from functools import cache
from operator import attrgetter
from typing import Any, NamedTuple

from birthsim_env.physics.rig.declaration import Derived
from birthsim_env.physics.rig.parameters import SECTIONS, Parameters, value_of


class RigRow(NamedTuple):
    """A row: what it is ``about``, and the ``formula`` of a ``section``, or of the whole rig where that is ``""``."""

    name: str
    unit: str
    about: str
    section: str
    formula: Callable[[Any], Any]

    def of(self, rig: Any) -> Any:
        """Its value for a rig."""
        return self.formula(getattr(rig, self.section) if self.section else rig)


def _rows() -> Iterator[RigRow]:
    for section, part in SECTIONS.items():
        number = section.strip("_abcdefghijklmnopqrstuvwxyz")
        for name, one in part.parameters.items():
            if one.row is not None and not one.choices:
                yield RigRow((one.row or name) + number, one.unit.replace("-", "1"), one.about, section, attrgetter(name))
        for own in part.derived.values():
            yield RigRow(own.row + number, own.unit, own.about, section, own.formula)
    for whole in (one for one in vars(Parameters).values() if isinstance(one, Derived)):
        yield RigRow(whole.row, whole.unit, whole.about, "", whole.formula)


RIG_ROWS = tuple(_rows())


class Substitute:
    """What has the sections of a rig, with other values than floats: those that ``value`` gives by dotted name.

    What is derived from parameters is computed from these values.
    """

    def __init__(self, value: Callable[[str], Any], section: str = "") -> None:
        self._value, self._section = value, section

    def __getattr__(self, name: str) -> Any:
        if not self._section and name in SECTIONS:
            return Substitute(self._value, name)
        derived = vars(type(SECTIONS[self._section]) if self._section else Parameters).get(name)
        return derived.formula(self) if isinstance(derived, Derived) else self._value(f"{self._section}.{name}")


def rows_of(rig: Any) -> tuple[Any, ...]:
    """The values of ``RIG_ROWS``.

    Parameters
    ----------
    rig : Parameters
        Or what has its sections; these may hold arrays, with a value per lane, or expressions.

    Returns
    -------
    tuple
        A number, an array or an expression for each row, SI units.
    """
    parts = {"": rig, **{section: getattr(rig, section) for section in SECTIONS}}
    return tuple(row.formula(parts[row.section]) for row in RIG_ROWS)


def parameters_read(function: Callable[[Any], Any], rig: Parameters) -> frozenset[str]:
    """Dotted names of the parameters that a function of a rig reads."""
    read = set[str]()

    def value(name: str) -> Any:
        read.add(name)
        return value_of(rig, name)

    function(Substitute(value))
    return frozenset(read)


@cache
def plant_parameters() -> frozenset[str]:
    """Dotted names of the parameters that any row is computed from."""
    return parameters_read(rows_of, Parameters())
