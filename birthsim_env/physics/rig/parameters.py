"""The rig as data: a frozen, validated dataclass of sections, what they must fulfil together, and its TOML file."""

import dataclasses
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import tomli_w

from birthsim_env.files import write_text
from birthsim_env.physics.electronics import Electronics
from birthsim_env.physics.rig.consistency import check_together, follow
from birthsim_env.physics.rig.declaration import Parameter, Section
from birthsim_env.physics.rig.mechanical import Cylinder, Friction, Geometry, Mechanics
from birthsim_env.physics.rig.pneumatic import Air, Chambers
from birthsim_env.physics.rig.reading import read_toml
from birthsim_env.physics.rig.servovalves import Valve, Valves, edge_rows
from birthsim_env.physics.rig.topology import Linkage, locked_rows
from birthsim_env.physics.rig.values import in_line, is_finite, near, path_of, shown

__all__ = [
    "DECLARED", "SECTIONS", "Air", "Chambers", "Cylinder", "Electronics", "Friction", "Geometry", "Linkage", "Mechanics",
    "Parameters", "Valve", "Valves", "load_parameters", "parameter_of", "value_of",
]  # fmt: skip


@dataclass(frozen=True)
class Parameters:
    """A whole rig. ``Parameters()`` is the paper's BirthSIM with the assumptions of the design made explicit.

    Parameters
    ----------
    linkage : Linkage
        Two cylinders, or one on a rail.
    geometry : Geometry
        Of the linkage of two cylinders, m.
    cylinder1, cylinder2 : Cylinder
        Bores and strokes (m), friction of the seals (N, N s/m).
    mechanics : Mechanics
        Mass (kg), gravity (m/s2), end stops, and how the structure bends.
    friction : Friction
        Its law, and what both cylinders share of it.
    chambers : Chambers
        Dead volume (m3), heat transfer, leaks and tubes.
    valves : Valves
        Their conductance and characteristic, and what is imperfect in their spools.
    valve_p1, valve_n1, valve_p2, valve_n2 : Valve
        What the valve of each chamber has more than all four share.
    air : Air
        Supply and atmosphere (Pa), temperature (K), and the gas itself.
    electronics : Electronics
        Control period (s), sensors and their errors.
    ranges : tuple of (str, float, float) or (str, str, ...)
        The owner's own ranges for domain randomisation, (dotted name, low, high), or (dotted name, word, ...) of a choice: the
        table ``[randomize]`` of a file, ``"mechanics.mass" = [7.2, 10.8]``. ``("friction", name)``, there ``friction = name``,
        is a friction of ``parts.drawn.frictions``.

    Raises
    ------
    ValueError
        Names the field, its value and what is allowed.

    Notes
    -----
    Every part is a frozen dataclass; docs/reference/rig.md lists all fields with their units, limits and sources. ``replace``
    makes a changed copy, ``from_toml`` and ``to_toml`` read and write a laboratory's own rig; a file names only what differs
    from the defaults. Strokes and forces are those of Herzig et al., IROS 2015, doi 10.1109/IROS.2015.7353583.

    Examples
    --------
    >>> import birthsim
    >>> rig = birthsim.Parameters().replace({"mechanics.mass": 4.0})
    >>> rig.mechanics.mass, rig.cylinder2.stroke
    (4.0, 0.4)
    >>> env = birthsim.make("BirthSIM/Circle-v2", parameters=rig)
    """

    linkage: Linkage = Linkage()
    geometry: Geometry = Geometry()
    cylinder1: Cylinder = Cylinder()
    cylinder2: Cylinder = Cylinder(stroke=0.400, coulomb_friction=11.7)
    mechanics: Mechanics = Mechanics()
    friction: Friction = Friction()
    chambers: Chambers = Chambers()
    valves: Valves = Valves()
    valve_p1: Valve = Valve()
    valve_n1: Valve = Valve()
    valve_p2: Valve = Valve()
    valve_n2: Valve = Valve()
    air: Air = Air()
    electronics: Electronics = Electronics()
    ranges: tuple[tuple[Any, ...], ...] = ()

    vars().update(edge_rows())
    vars().update(locked_rows())

    def __post_init__(self) -> None:
        for name, part in SECTIONS.items():
            if not isinstance(getattr(self, name), type(part)):
                raise ValueError(f"{name} = {shown(getattr(self, name))}; allowed: an instance of {type(part).__name__}")
        check_together(self)

    @property
    def own_ranges(self) -> dict[str, tuple[Any, ...]]:
        """``ranges`` by name."""
        return {name: tuple(bounds) for name, *bounds in self.ranges}

    def replace(self, changes: dict[str, Any]) -> Self:
        """A copy with changes given by dotted names, for example ``{"mechanics.mass": 4.0}``.

        Three parameters depend on bores and strokes, and follow where ``changes`` do not name them. The dead volume grows with
        the largest piston, the linkage with a stroke of cylinder 1 that it has no room for, and k2 with a longer cylinder 2. A
        rail has the gamma3 and k1 that its inclination asks for.
        """
        if not isinstance(changes, Mapping):
            raise ValueError(f"changes = {shown(changes)}; allowed: a mapping such as {{'mechanics.mass': 4.0}}")
        grouped: dict[str, dict[str, Any]] = {}
        for dotted, value in changes.items():
            parameter_of(dotted)
            section, _, name = dotted.partition(".")
            grouped.setdefault(section, {})[name] = value
        parts = {section: dataclasses.replace(getattr(self, section), **values) for section, values in grouped.items()}
        follow(parts, self, changes)
        return dataclasses.replace(self, **parts)

    def to_dict(self, options: bool = False) -> dict[str, dict[str, Any]]:
        """All values as ``{section: {field: value}}``, and ``{"randomize": {name: [low, high]}}`` where there are ranges.

        Without ``options`` these (``declaration.Parameter``) are named only where they differ from their defaults.
        """
        sections = {name: getattr(self, name).to_dict(options) for name in SECTIONS if self.linkage.topology.has(name)}
        if not sections["linkage"]:
            del sections["linkage"]  # what was stored of a rig before there were others stays equal
        if self.linkage.is_rail:
            del sections["geometry"]["gamma3"], sections["geometry"]["k1"]  # they follow
        table = {name: bounds[0] if name == FRICTION else list(bounds) for name, bounds in self.own_ranges.items()}
        return {**sections, **({RANDOMIZE: table} if table else {})}

    @classmethod
    def from_dict(cls, sections: dict[str, Any]) -> Self:
        """Inverse of ``to_dict``; ``"mechanics.mass"`` may name a value too. What is not named keeps its default."""
        if not isinstance(sections, Mapping):
            raise ValueError(f"sections = {shown(sections)}; allowed: a mapping such as {{'mechanics': {{'mass': 4.0}}}}")
        changes = {}
        for section, values in sections.items():
            if isinstance(section, str) and "." in section:
                changes[section] = values
            elif not isinstance(values, Mapping):
                raise ValueError(
                    f"{_word(section)} = {shown(values)}; allowed: a section, one of {', '.join(SECTIONS)}, {RANDOMIZE}"
                )
            elif section not in (*SECTIONS, RANDOMIZE):
                parameter_of(section)
            elif section != RANDOMIZE:
                changes.update({f"{section}.{_word(name)}": value for name, value in values.items()})
        return dataclasses.replace(cls().replace(changes), ranges=_own_ranges(sections.get(RANDOMIZE, {})))

    def to_toml(self, path: str | os.PathLike[str]) -> None:
        """Write every value to a TOML file, one table per part."""
        write_text(Path(path), tomli_w.dumps(self.to_dict(options=True)))

    @classmethod
    def from_toml(cls, path: str | os.PathLike[str]) -> Self:
        """Read a TOML file; raises ``ValueError`` naming the file and what is wrong in it."""
        tables = read_toml("parameters", path)
        try:
            return cls.from_dict(tables)
        except ValueError as error:
            raise ValueError(f"parameters = {str(path)!r}: {error}") from error


def _word(key: Any) -> str:
    """A key of a mapping in a line; of what is no text, how Python writes it."""
    return in_line(key) if isinstance(key, str) else shown(key)


def _own_ranges(table: Mapping[Any, Any]) -> tuple[tuple[Any, ...], ...]:
    """The table ``[randomize]`` of a file; names and limits are checked where they are drawn from."""
    found: list[tuple[Any, ...]] = []
    for name, bounds in table.items():
        words = f"[{RANDOMIZE}] {_word(name)} = {shown(bounds)}"
        if name == FRICTION:
            if not isinstance(bounds, str):
                raise ValueError(f"{words}; allowed: the name of a friction, such as 'drawn'")
            found.append((name, bounds))
        elif parameter_of(name).choices:
            if not (isinstance(bounds, list) and bounds and all(isinstance(one, str) for one in bounds)):
                raise ValueError(f'{words}; allowed: "section.field" = [word, ...], some of its choices')
            found.append((name, *bounds))
        else:
            if not (isinstance(bounds, list) and len(bounds) == 2 and all(map(is_finite, bounds))):
                raise ValueError(f'{words}; allowed: "section.field" = [low, high], finite')
            found.append((name, float(bounds[0]), float(bounds[1])))
    return tuple(sorted(found))


RANDOMIZE, FRICTION = "randomize", "friction"
"""The table of a file that holds an owner's own ranges, and the key there that names a friction of the sweep."""

SECTIONS: dict[str, Section] = {one.name: one.default for one in dataclasses.fields(Parameters) if one.name != "ranges"}  # type: ignore[misc]
"""Name of a section -> what it is in ``Parameters()``."""

DECLARED = {f"{section}.{name}": one for section, part in SECTIONS.items() for name, one in part.parameters.items()}
"""Dotted name of a parameter -> what is declared of it, in the order of the sections."""


def parameter_of(dotted: str) -> Parameter:
    """What is declared of a dotted name such as ``"mechanics.mass"``; ``ValueError`` names the alternatives."""
    if not isinstance(dotted, str):
        raise ValueError(f"unknown parameter {shown(dotted)}; allowed: dotted names such as 'mechanics.mass'")
    section, _, name = dotted.partition(".")
    if section not in SECTIONS:
        like = [f"{one}.{dotted}" for one, part in SECTIONS.items() if dotted in part.parameters]
        asked = f" (did you mean {' or '.join(map(repr, like))}?)" if like else near(section, SECTIONS)
        raise ValueError(f"unknown parameter section {shown(section)}{asked}; allowed: {', '.join(SECTIONS)}")
    known = SECTIONS[section].parameters
    if name not in known:
        raise ValueError(f"unknown parameter {shown(dotted)}{near(name, known)}; allowed in {section}: {', '.join(known)}")
    return known[name]


def value_of(rig: Parameters, dotted: str) -> Any:
    """The value of a dotted name."""
    section, _, name = dotted.partition(".")
    value = getattr(getattr(rig, section), name)
    return value if isinstance(value, str) else float(value)


def load_parameters(parameters: Parameters | Mapping[str, Any] | str | os.PathLike[str] | None) -> Parameters:
    """Read what ``parameters=`` accepts everywhere.

    Parameters
    ----------
    parameters : Parameters, mapping, path or None
        A ``Parameters``, the path of a TOML file, or what such a file holds as a mapping, ``{"mechanics": {"mass": 4.0}}`` or
        ``{"mechanics.mass": 4.0}``; None stands for the defaults.

    Returns
    -------
    rig : Parameters
        A valid rig.

    Raises
    ------
    ValueError
        Names the file and the field, the value and what is allowed.

    Examples
    --------
    >>> import birthsim
    >>> birthsim.load_parameters({"mechanics": {"mass": 4.0}}).mechanics.mass
    4.0
    """
    if parameters is None:
        return Parameters()
    if isinstance(parameters, Parameters):
        return parameters
    path = path_of(parameters)
    if path is not None:
        return Parameters.from_toml(path)
    if isinstance(parameters, Mapping):
        try:
            return Parameters.from_dict(dict(parameters))
        except ValueError as error:
            raise ValueError(f"parameters: {error}") from None
    raise ValueError(f"parameters = {shown(parameters)}; allowed: None, a Parameters, a mapping or the path of a TOML file")
