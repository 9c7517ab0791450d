"""What a parameter of a rig is: one declaration, from which everything follows that names parameters.

    @dataclass(frozen=True)
    class Mechanics(Section):
        mass: float = parameter("kg", "moving mass", default=3.0, source="assumed", above=0, most=1e20, range=(2, 5))
        inverse_mass = derived("1/kg", "1/mass", lambda own: 1 / own.mass)

Kernels find both in a row of their own (``rig.rows``), ``p[at.MASS]`` and ``p[at.INVERSE_MASS]``. Files of rigs, domain
randomisation, identification, FMUs and the tables of the documentation take what they need to know from the declaration.
"""

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, ParamSpec, Self, overload

from birthsim_env.physics.rig.values import is_within, limits, make_plain, shown

P = ParamSpec("P")


@dataclass(frozen=True)
class Prior:
    """What is known of a parameter before its rig is measured: a normal distribution of its coordinate about the owner's value.

    The coordinate is log(value - ``floor``), or value over ``scale`` where that is not zero.

    Parameters
    ----------
    spread : float
        Standard deviation of the coordinate, assumed.
    floor : float
        What the value cannot fall to, in its own unit.
    scale : float
        What the value is counted in, for a value that may be zero, in its own unit.
    needs : str
        Parameter of the same section whose value in the owner's rig is another than its default's, or this one is not looked
        for; one that needs itself and has a ``scale`` is also looked for where a log shows that it is there.
    """

    spread: float
    floor: float = 0.0
    scale: float = 0.0
    needs: str = ""

    def coordinate(self, value: float) -> float:
        """The coordinate of a value."""
        return value / self.scale if self.scale else math.log(max(value - self.floor, 1e-12))

    def value(self, coordinate: float) -> float:
        """The value at a coordinate."""
        return coordinate * self.scale if self.scale else self.floor + math.exp(coordinate)


@dataclass(frozen=True)
class Parameter:
    """What is declared of a parameter.

    Parameters
    ----------
    unit : str
        SI unit, such as ``"N s/m"``; ``"-"`` of a ratio.
    about : str
        What it is.
    default : float or str
        Its value in ``Parameters()``.
    source : str
        Where that comes from; ``"assumed"`` where no source gives it.
    above, least, most : float
        Limits of a number: more than ``above``, at least ``least``, at most ``most``.
    choices : tuple of str
        The words that are allowed, where it is no number.
    range : tuple of float, optional
        What domain randomisation draws it from, (low, high).
    on_request : bool
        Whether ``range`` is drawn from only where ``randomize`` or the owner's own ranges name the parameter.
    logarithmic : bool
        Whether its logarithm is drawn uniformly, of a parameter that is known by its order of magnitude alone.
    identified : Prior, optional
        What is known of it beforehand, where identification may find it from a log.
    option : bool
        Whether ``Parameters.to_dict`` names it only where it differs from its default, so that what is stored by the result
        keeps its place when options are added.
    shared : bool
        Whether it is the same in all lanes, so that it cannot be drawn for each.
    hardest_low : bool
        Whether its least value is the hardest on what rigs must fulfil; of all others it is the largest.
    row : str, optional
        Name of its row in kernels: its own where it is ``""``, such as a symbol of the equations; None where kernels compute
        only with numbers that are derived from it.
    """

    unit: str
    about: str
    _: dataclasses.KW_ONLY
    default: Any
    source: str
    above: float = -math.inf
    least: float = -math.inf
    most: float = math.inf
    choices: tuple[str, ...] = ()
    range: tuple[float, float] | None = None
    on_request: bool = False
    logarithmic: bool = False
    identified: Prior | None = None
    option: bool = False
    shared: bool = False
    hardest_low: bool = False
    row: str | None = ""

    @property
    def allowed(self) -> str:
        """What is allowed, in words."""
        if self.choices:
            return f"one of {', '.join(map(repr, self.choices))}"
        return f"a finite number{limits(self.above, self.least, self.most)} ({self.unit})"

    @property
    def drawn(self) -> str:
        """What it is drawn from, in words; nothing where it is not drawn."""
        how = ", logarithmic" if self.logarithmic else ""
        return f"{self.range[0]:g} to {self.range[1]:g}{how}" if self.range else ""

    def allows(self, value: Any) -> bool:
        """Whether a value is allowed."""
        if self.choices:
            return isinstance(value, str) and value in self.choices
        return is_within(value, self.above, self.least, self.most)


def _field_of(kind: Callable[P, Parameter]) -> Callable[P, Any]:
    def declare(*arguments: P.args, **named: P.kwargs) -> Any:
        declared = kind(*arguments, **named)
        return dataclasses.field(default=declared.default, metadata={"declared": declared})

    return declare


parameter = _field_of(Parameter)
"""A field of a section, with the arguments of ``Parameter``."""


class Derived:
    """A number that follows from parameters: a row of kernels, and what reading it from a section, or a rig, computes."""

    def __init__(self, unit: str, about: str, formula: Callable[[Any], Any], row: str) -> None:
        self.unit, self.about, self.formula, self.row = unit, about, formula, row
        self.__doc__ = f"{about}, {unit}."

    def __set_name__(self, owner: type, name: str) -> None:
        self.row = self.row or name

    @overload
    def __get__(self, part: None, owner: type) -> Self: ...

    @overload
    def __get__(self, part: object, owner: type) -> float: ...

    def __get__(self, part: object | None, owner: type) -> Any:
        return self if part is None else self.formula(part)


def derived(unit: str, about: str, formula: Callable[[Any], Any], row: str = "") -> Derived:
    """A number that follows from parameters.

    Parameters
    ----------
    unit, about : str
        Its unit, and what it is or how it is computed.
    formula : callable
        Computes it from the section that it stands in, or from the whole rig where it stands in ``Parameters``. Parameters are
        floats, arrays with a value per lane, or expressions that become C: operators and functions of NumPy alone.
    row : str
        Name of its row in kernels, where that is not its own.
    """
    return Derived(unit, about, formula, row)


LISTED = "Parameters (unit): meaning; source; range that is drawn from."
"""What stands between the docstring of a section and the list of its parameters."""


class Section:
    """A group of parameters: it checks every value by name, and lists its parameters in the docstring of each subclass.

    A subclass that is not of the ``plant`` has no rows in kernels of the rig; one that is ``shared`` is the same in all lanes.
    What a section declares comes before what it takes from the section that it derives from.
    """

    parameters: ClassVar[Mapping[str, Parameter]]
    derived: ClassVar[Mapping[str, Derived]]

    def __init_subclass__(cls, plant: bool = True, shared: bool = False) -> None:
        """Collect what is declared, and append it to the docstring."""
        fields = {name: one.metadata["declared"] for name, one in vars(cls).items() if isinstance(one, dataclasses.Field)}
        more = {**({} if plant else {"row": None}), **({"shared": True} if shared else {})}
        own = {name: dataclasses.replace(one, **more) for name, one in fields.items()}
        cls.parameters = {**own, **getattr(cls, "parameters", {})}
        cls.derived = {name: one for name, one in vars(cls).items() if isinstance(one, Derived)}
        lines = [cls.__doc__ or "", "", LISTED, ""]
        for name, one in cls.parameters.items():
            drawn = f"; {one.drawn}{' on request' if one.on_request else ''}" if one.range else ""
            lines.append(f"- ``{name}`` = {one.default!r} ({one.unit}): {one.about}; {one.source}{drawn}")
        cls.__doc__ = "\n".join(lines)

    def __post_init__(self) -> None:
        for name, one in self.parameters.items():
            value = getattr(self, name)
            if not one.allows(value):
                raise ValueError(f"{type(self).__name__}.{name} = {shown(value)} is impossible; allowed: {one.allowed}")
        make_plain(self)
        self._check_together()

    def to_dict(self, options: bool) -> dict[str, Any]:
        """All values by name; without ``options`` an option only where it differs from its default."""
        values = {name: getattr(self, name) for name in self.parameters}
        return {
            name: values[name]
            for name, one in self.parameters.items()
            if options or not one.option or values[name] != one.default
        }

    def _check_together(self) -> None:
        """Refuse values that are possible one by one but not together."""
