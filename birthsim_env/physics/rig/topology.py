"""Which cylinders and chambers a rig has: whatever leaves a cylinder out asks here.

A rail is the linkage with cylinder 1 locked where theta1 of (1) is gamma3, so at w = 0: cylinder 2 alone moves the mass along a
line through its pivot, ``inclination`` above x. Everything of cylinder 1 stays in the arrays of the plant, at rest: infinite
inertia, no weight, valves shut and tight (``locked_rows``). A rail is therefore computed by the same kernels.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from operator import attrgetter
from typing import Any, NamedTuple

from birthsim_env.physics.rig.declaration import Derived, Section, derived, parameter

TWO_CYLINDERS, RAIL = "two-cylinders", "rail"
"""Words of ``linkage.kind``."""


class Topology(NamedTuple):
    """What of the linkage's two cylinders moves: ``cylinders``, counted from 0."""

    cylinders: tuple[int, ...]

    @property
    def chambers(self) -> tuple[int, ...]:
        """Which of P1, N1, P2, N2 it has."""
        return tuple(2 * cylinder + side for cylinder in self.cylinders for side in range(2))

    @property
    def cylinder_names(self) -> tuple[str, ...]:
        """Sections of its cylinders."""
        return tuple(f"cylinder{cylinder + 1}" for cylinder in self.cylinders)

    def name_of(self, name: str) -> str:
        """What something of a chamber is called in a log, without the number of the only cylinder: ``pressures_P2``."""
        return name if len(self.cylinders) > 1 else name[:-1]

    def has(self, name: str) -> bool:
        """Whether a section, or a dotted name in it, is of something that moves."""
        idle = {str(one + 1) for one in range(2) if one not in self.cylinders}
        return not (name.startswith(("cylinder", "valve_")) and name.partition(".")[0][-1] in idle)


TOPOLOGIES = {TWO_CYLINDERS: Topology((0, 1)), RAIL: Topology((1,))}
"""Word of ``linkage.kind`` -> what moves."""


@dataclass(frozen=True)
class Linkage(Section, shared=True):
    """What the cylinders move: the planar linkage by both, or a carriage on a rail by cylinder 2 alone, whose stroke it has."""

    kind: str = parameter(
        "-",
        "two cylinders, or a rail: one cylinder, which stands in the sections and rows of cylinder 2",
        default=TWO_CYLINDERS,
        source="the paper; one cylinder is the usual bench, such as that of Abry et al. 2016",
        choices=tuple(TOPOLOGIES),
        option=True,
    )
    inclination: float = parameter(
        "rad",
        "of a rail above x, along which the rod extends",
        default=0.0,
        source="assumed, horizontal",
        least=-math.pi / 2,
        most=math.pi / 2,
        option=True,
        row=None,
    )

    free = derived("1", "0 where cylinder 1 is locked, else 1", lambda own: 1.0 - (own.kind == RAIL))

    @property
    def topology(self) -> Topology:
        """What moves."""
        return TOPOLOGIES[self.kind]

    @property
    def is_rail(self) -> bool:
        """Whether it is a rail."""
        return self.kind == RAIL

    def locked_geometry(self, d3: float, d6: float) -> dict[str, float]:
        """The angle gamma3, rad, and the offset k1, m, of a rail, for given pivots, m."""
        return {"gamma3": self.inclination + math.pi / 2, "k1": math.hypot(d3, d6)}


def _leakage(cylinder: int, rig: Any) -> Any:
    return rig.valves.leakage * (rig.linkage.free if cylinder == 0 else 1.0)


def _if_free(of: str, rig: Any) -> Any:
    return rig.linkage.free * attrgetter(of)(rig)


def locked_rows() -> Iterator[tuple[str, Derived]]:
    """Rows of a rig in which a locked cylinder 1 differs from a free one."""
    for name, unit, about, of in (
        ("inverse_mass1", "1/kg", "1/mass for cylinder 1; 0 where it is locked", "mechanics.inverse_mass"),
        ("gravity1", "m/s2", "gravity for cylinder 1, likewise", "mechanics.gravity"),
        ("spool_rate1", "1/s", "1/tau of the valves of cylinder 1, likewise", "valves.spool_rate"),
    ):
        yield name, derived(unit, about, partial(_if_free, of), name)
    for k, chamber in enumerate(("p1", "n1", "p2", "n2")):
        name = f"leakage_{chamber}"
        yield (
            name,
            derived("m3/(s Pa)", f"leakage conductance, valve of chamber {chamber.upper()}", partial(_leakage, k // 2), name),
        )
