"""The rig as data: frozen, validated dataclasses with the unit and the basis of every figure, and their TOML file."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomli_w

from birthsim_env.physics.electronics import Electronics
from birthsim_env.physics.rig.quantities import Part, quantity
from birthsim_env.physics.rig.reading import read_toml
from birthsim_env.physics.rig.values import in_line, is_finite, shown

STOP_DEPTH = 0.01
"""m of piston travel that every chamber must keep as dead volume; collisions seen in tests go 5 mm deep."""

FASTEST_RATE = 7000.0
"""1/s. Runge-Kutta steps of 0.25 ms are stable up to 11000; the spring of the bristles takes its share."""


@dataclass(frozen=True)
class Geometry(Part):
    """Planar linkage of the paper's Fig. 1 and Table II; frame 0 at the pivot of cylinder 2, x forward, y up."""

    d3: float = quantity(0.35, "m", "assumed", least=1e-3, most=10)
    d6: float = quantity(0.25, "m", "assumed", least=1e-3, most=10)
    gamma3: float = quantity(math.pi / 2, "rad", "assumed", least=-math.pi, most=math.pi)
    k1: float = quantity(0.430, "m", "assumed; r4 = y1 + k1 (2)", least=1e-3, most=10)
    k2: float = quantity(0.500, "m", "assumed; r2 = y2 + k2 (2)", least=1e-3, most=10)


@dataclass(frozen=True)
class Cylinder(Part):
    """One double-acting, single-rod pneumatic cylinder."""

    piston_diameter: float = quantity(0.025, "m", "Table I", least=1e-3, most=1)
    rod_diameter: float = quantity(0.010, "m", "Table I, from its 295 and 247 N", least=0)
    stroke: float = quantity(0.200, "m", "Table I", least=1e-3, most=10)
    coulomb_friction: float = quantity(12.0, "N", "assumed, 4-5 % of the rated force", least=0, most=1e5, randomized=(6, 25))
    viscous_friction: float = quantity(35.0, "N s/m", "assumed", least=0, most=1e5, randomized=(10, 60))

    def _check_together(self) -> None:
        if self.rod_diameter >= self.piston_diameter:
            raise ValueError(
                f"Cylinder.rod_diameter = {self.rod_diameter!r} is impossible; "
                f"allowed: less than piston_diameter = {self.piston_diameter!r} (m)"
            )

    @property
    def area_p(self) -> float:
        """Piston area of chamber P, the full bore, m2."""
        return math.pi / 4 * self.piston_diameter * self.piston_diameter

    @property
    def area_n(self) -> float:
        """Piston area of chamber N, the bore less the rod, m2."""
        return math.pi / 4 * (self.piston_diameter * self.piston_diameter - self.rod_diameter * self.rod_diameter)


@dataclass(frozen=True)
class Mechanics(Part):
    """The point mass at the end effector and the end stops of the cylinders."""

    mass: float = quantity(3.0, "kg", "assumed", above=0, most=1e20, randomized=(2, 5))
    gravity: float = quantity(9.81, "m/s2", "standard", least=0, most=100)
    stop_stiffness: float = quantity(5e6, "N/m", "assumed, rigid end caps", above=0, most=1e7)
    stop_damping: float = quantity(1.0, "s/m", "assumed; force k p (1 + c dp/dt), Hunt and Crossley 1975", least=0, most=2)
    impact_speed: float = quantity(0.1, "m/s", "assumed; a faster collision with an end stop is reported", above=0, most=100)


@dataclass(frozen=True)
class Friction(Part):
    """Friction law of both pistons; the Coulomb and viscous levels belong to each cylinder."""

    law: str = quantity(
        "lugre",
        "-",
        "LuGre (Canudas de Wit 1995), the paper's (4), or elasto-plastic without presliding drift (Dupont 2002)",
        choices=("lugre", "coulomb", "elasto_plastic"),
    )
    static_ratio: float = quantity(1.33, "-", "assumed; Fs/Fc", least=1, most=10)
    stribeck_speed: float = quantity(0.015, "m/s", "assumed", least=1e-6, most=10)
    bristle_stiffness: float = quantity(5e4, "N/m", "assumed; s0", least=1, most=5e5)
    bristle_damping: float = quantity(150.0, "N s/m", "assumed; s1", least=0, most=2000)
    breakaway_ratio: float = quantity(
        0.7,
        "-",
        "assumed; z_ba/z_ss, elasto-plastic law only: below this fraction of the level it is a spring",
        above=0,
        most=0.9,
    )
    sign_speed: float = quantity(0.002, "m/s", "numerical; (4)'s sign(v) is v/sign_speed below it", least=0.001, most=10)


@dataclass(frozen=True)
class Chambers(Part):
    """What all four chambers share: dead volume and heat exchange (the paper's section V)."""

    dead_volume: float = quantity(10e-6, "m3", "assumed, tubing included; V0", above=0, most=1000, randomized=(5e-6, 25e-6))
    wall_heat_transfer: float = quantity(
        50.0, "W/(m2 K)", "assumed; h, cools in 0.2-1 s", least=0, most=1e4, randomized=(20, 100)
    )
    piston_conductance: float = quantity(0.012, "W/K", "assumed; G12, heat between the chambers of a cylinder", least=0, most=5)


@dataclass(frozen=True)
class Valves(Part):
    """Proportional servovalve: ISO 6358 orifices behind a spool with a first-order lag."""

    sonic_conductance: float = quantity(3.9e-9, "m3/(s Pa)", "from 100 l/min nominal, 6 to 5 bar; C", least=1e-12, most=2e-8)
    critical_ratio: float = quantity(0.30, "-", "from 100 l/min nominal, 6 to 5 bar; b", least=0, most=0.9)
    leakage_ratio: float = quantity(0.005, "-", "assumed; Cl/C", least=0, most=0.5)
    time_constant: float = quantity(0.004, "s", "assumed; -3 dB near 125 Hz", least=2e-4, most=10, randomized=(0.0015, 0.008))
    deadband: float = quantity(
        0.0,
        "-",
        "off; opening within which nothing opens, up to 0.05 assumed of overlapped spools",
        least=0,
        most=0.5,
        option=True,
    )
    hysteresis: float = quantity(
        0.0, "-", "off; width of the play in the opening, up to 0.02 assumed", least=0, most=0.5, option=True
    )
    opening_limit: float = quantity(1.0, "-", "off; largest opening, 0.8 to 1 assumed", above=0, most=1, option=True)


@dataclass(frozen=True)
class Air(Part):
    """Supply, surroundings and the gas itself; absolute pressures."""

    supply_pressure: float = quantity(7.0e5, "Pa", "Table I quotes 6 bar gauge", above=0, most=15e5)
    atmospheric_pressure: float = quantity(1.013e5, "Pa", "standard", least=1e4, most=2e5)
    temperature: float = quantity(293.15, "K", "standard; supply, surroundings and walls", least=230, most=370)
    gas_constant: float = quantity(287.05, "J/(kg K)", "standard; r of dry air", least=10, most=1e4)
    heat_capacity_ratio: float = quantity(1.4, "-", "standard; gamma", least=1.01, most=2)
    polytropic_index: float = quantity(1.2, "-", "assumed; k of the control model (6)", least=1, most=2)
    reference_density: float = quantity(1.185, "kg/m3", "ISO 6358; rho0", least=0.01, most=100)
    reference_temperature: float = quantity(293.15, "K", "ISO 6358; T0", least=100, most=1000)

    def _check_together(self) -> None:
        if self.supply_pressure <= self.atmospheric_pressure:
            raise ValueError(
                f"Air.supply_pressure = {self.supply_pressure!r} is impossible; "
                f"allowed: more than atmospheric_pressure = {self.atmospheric_pressure!r} (Pa)"
            )


@dataclass(frozen=True)
class Parameters:
    """A whole rig. ``Parameters()`` is the paper's BirthSIM with the assumptions of the design made explicit.

    Every part is a frozen dataclass; ``replace`` makes a changed copy, ``from_toml`` and ``to_toml`` read and write a
    laboratory's own rig (a file names only what differs from the defaults). ``ranges`` are the owner's own for domain
    randomisation, (dotted name, low, high): the table ``[randomize]`` of a file, ``"mechanics.mass" = [7.2, 10.8]``.
    Raises ``ValueError`` naming the field, its value and what is allowed.
    """

    geometry: Geometry = Geometry()
    cylinder1: Cylinder = Cylinder()
    cylinder2: Cylinder = Cylinder(stroke=0.400, coulomb_friction=15.0)
    mechanics: Mechanics = Mechanics()
    friction: Friction = Friction()
    chambers: Chambers = Chambers()
    valves: Valves = Valves()
    air: Air = Air()
    electronics: Electronics = Electronics()
    ranges: tuple[tuple[str, float, float], ...] = ()

    def __post_init__(self) -> None:
        for field in _parts(type(self)):
            expected = type(field.default)
            if not isinstance(getattr(self, field.name), expected):
                raise ValueError(
                    f"{field.name} = {shown(getattr(self, field.name))}; allowed: an instance of {expected.__name__}"
                )
        self._check_linkage()
        self._check_dead_volume()
        self._check_stability()

    def _check_linkage(self) -> None:
        g = self.geometry
        for name, offset, cylinder in (("k1", g.k1, self.cylinder1), ("k2", g.k2, self.cylinder2)):
            if offset <= 0.55 * cylinder.stroke:
                raise ValueError(
                    f"Geometry.{name} = {offset!r} is impossible; allowed: more than {0.55 * cylinder.stroke:g} m, "
                    f"0.55 strokes, so that the cylinder's length stays positive"
                )
        shortest, longest = abs(g.d3 - g.d6), g.d3 + g.d6
        least, most = g.k1 - self.cylinder1.stroke / 2, g.k1 + self.cylinder1.stroke / 2
        if not shortest * 1.05 < least < most < longest * 0.98:
            raise ValueError(
                f"Geometry.k1 = {g.k1!r} with stroke {self.cylinder1.stroke!r} is impossible; allowed: cylinder 1's "
                f"length {least:g} to {most:g} m must lie in {shortest * 1.05:g} to {longest * 0.98:g} m"
            )

    def _check_dead_volume(self) -> None:
        # A hard collision pushes a piston millimetres into its end stop; the chamber there must not lose all its volume.
        least = least_dead_volume(self)
        if self.chambers.dead_volume < least:
            raise ValueError(
                f"Chambers.dead_volume = {self.chambers.dead_volume!r} is impossible; allowed: at least {least:.3g} m3, "
                f"{1e3 * STOP_DEPTH:g} mm of the largest piston"
            )

    def _check_stability(self) -> None:
        f, viscous = self.friction, max(self.cylinder1.viscous_friction, self.cylinder2.viscous_friction)
        coulomb = max(self.cylinder1.coulomb_friction, self.cylinder2.coulomb_friction)
        damping = viscous + (coulomb / f.sign_speed if f.law == "coulomb" else f.bristle_damping)
        if damping / self.mechanics.mass > FASTEST_RATE:
            raise ValueError(
                f"Mechanics.mass = {self.mechanics.mass!r} is impossible with this friction; allowed: at least "
                f"{damping / FASTEST_RATE:.3g} kg, or less friction, so that steps of 0.25 ms follow the motion"
            )

    def replace(self, changes: dict[str, Any]) -> Parameters:
        """A copy with changes given by dotted names, for example ``{"mechanics.mass": 4.0}``.

        What hangs on bores and strokes follows where ``changes`` do not name it: the dead volume grows with the largest
        piston, the linkage with a stroke of cylinder 1 that it has no room for, k2 with a longer cylinder 2.
        """
        grouped: dict[str, dict[str, Any]] = {}
        for dotted, value in changes.items():
            section, _, name = dotted.partition(".")
            field_of(dotted)
            grouped.setdefault(section, {})[name] = value
        parts = {section: dataclasses.replace(getattr(self, section), **values) for section, values in grouped.items()}
        follow(parts, self, changes)
        return dataclasses.replace(self, **parts)

    def to_dict(self) -> dict[str, dict[str, Any]]:
        """All values as ``{section: {field: value}}``, and ``{"randomize": {name: [low, high]}}`` where there are ranges.

        Options (``quantities.quantity``) are named where they differ from their defaults.
        """
        return self._sections(options=False)

    def _sections(self, options: bool) -> dict[str, dict[str, Any]]:
        sections = {field.name: getattr(self, field.name).to_dict(options) for field in _parts(type(self))}
        return {**sections, **({RANDOMIZE: {name: [low, high] for name, low, high in self.ranges}} if self.ranges else {})}

    @classmethod
    def from_dict(cls, sections: dict[str, dict[str, Any]]) -> Parameters:
        """Inverse of ``to_dict``; what is not named keeps its default."""
        changes = {}
        for section, values in sections.items():
            if not isinstance(values, dict):
                raise ValueError(
                    f"{in_line(section)} = {shown(values)}; allowed: a section, one of {', '.join(_SECTIONS)}, {RANDOMIZE}"
                )
            if section != RANDOMIZE:
                changes.update({f"{section}.{name}": value for name, value in values.items()})
        return dataclasses.replace(cls().replace(changes), ranges=_own_ranges(sections.get(RANDOMIZE, {})))

    def to_toml(self, path: str | Path) -> None:
        """Write every value to a TOML file, one table per part."""
        Path(path).write_text(tomli_w.dumps(self._sections(options=True)), encoding="utf-8")

    @classmethod
    def from_toml(cls, path: str | Path) -> Parameters:
        """Read a TOML file; raises ``ValueError`` naming the file and what is wrong in it."""
        tables = read_toml("parameters", path)
        try:
            return cls.from_dict(tables)
        except ValueError as error:
            raise ValueError(f"parameters = {str(path)!r}: {error}") from error


def _parts(rig: type[Parameters]) -> list[dataclasses.Field[Any]]:
    return [field for field in dataclasses.fields(rig) if field.name != "ranges"]


def _own_ranges(table: dict[str, Any]) -> tuple[tuple[str, float, float], ...]:
    """The table ``[randomize]`` of a file; names and limits are checked where they are drawn from."""
    found = []
    for name, bounds in table.items():
        if not (isinstance(bounds, list) and len(bounds) == 2 and all(map(is_finite, bounds))):
            words = f"[{RANDOMIZE}] {in_line(name)} = {shown(bounds)}"
            raise ValueError(f'{words}; allowed: "section.field" = [low, high], finite')
        field_of(name)
        found.append((name, float(bounds[0]), float(bounds[1])))
    return tuple(sorted(found))


def follow(parts: dict[str, Any], rig: Parameters, changes: dict[str, Any]) -> None:
    """Put into ``parts`` of a changed ``rig`` what hangs on its bores and strokes, as far as ``changes`` do not name it."""

    def part(name: str) -> Any:
        return parts.get(name, getattr(rig, name))

    def bore(one: Any, other: Any) -> float:
        return float(max(one.area_p, other.area_p))

    grown = bore(part("cylinder1"), part("cylinder2")) / bore(rig.cylinder1, rig.cylinder2)
    if grown != 1.0 and "chambers.dead_volume" not in changes:
        parts["chambers"] = dataclasses.replace(part("chambers"), dead_volume=grown * rig.chambers.dead_volume)
    g = part("geometry")
    if not {"geometry.d3", "geometry.d6", "geometry.k1"} & set(changes):
        room = 1.9 * min(0.98 * (g.d3 + g.d6) - g.k1, g.k1 - 1.05 * abs(g.d3 - g.d6))
        longer = max(1.0, part("cylinder1").stroke / max(room, rig.cylinder1.stroke))
        if longer > 1.0:
            g = dataclasses.replace(g, d3=longer * g.d3, d6=longer * g.d6, k1=longer * g.k1)
    if part("cylinder2").stroke > rig.cylinder2.stroke and "geometry.k2" not in changes:
        g = dataclasses.replace(g, k2=max(g.k2, 0.6 * part("cylinder2").stroke))
    if g is not part("geometry"):
        parts["geometry"] = g


RANDOMIZE = "randomize"
"""The table of a file that holds an owner's own ranges."""

_SECTIONS = {field.name: field.default for field in _parts(Parameters)}


def least_dead_volume(rig: Parameters) -> float:
    """The least possible of a rig, m3: ``STOP_DEPTH`` of its largest piston."""
    return STOP_DEPTH * max(rig.cylinder1.area_p, rig.cylinder2.area_p)


def field_of(dotted: str) -> dataclasses.Field[Any]:
    """The field behind a dotted name such as ``"mechanics.mass"``; ``ValueError`` names the alternatives."""
    section, _, name = dotted.partition(".")
    if section not in _SECTIONS:
        raise ValueError(f"unknown parameter section {shown(section)}; allowed: {', '.join(_SECTIONS)}")
    fields = {field.name: field for field in dataclasses.fields(_SECTIONS[section])}  # type: ignore[arg-type]
    if name not in fields:
        raise ValueError(f"unknown parameter {shown(dotted)}; allowed in {section}: {', '.join(fields)}")
    return fields[name]


def load_parameters(parameters: Parameters | str | Path | None) -> Parameters:
    """What ``parameters=`` accepts everywhere: nothing (defaults), a ``Parameters`` or the path of a TOML file."""
    if parameters is None:
        return Parameters()
    if isinstance(parameters, Parameters):
        return parameters
    if isinstance(parameters, (str, Path)):
        return Parameters.from_toml(parameters)
    raise ValueError(f"parameters = {shown(parameters)}; allowed: None, a Parameters or the path of a TOML file")
