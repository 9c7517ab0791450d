"""The sections of a rig's servovalves: what all four share, what each has of its own, and the rows of both.

    [valves]
    supply_overlap = 0.10
    [valve_n2]
    supply_overlap = 0.01     # 0.11 in all

``characteristic`` has the equation. What its four numbers are for a type of valve stands in ``Curve``.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from birthsim_env.physics.pneumatics import valves
from birthsim_env.physics.pneumatics.characteristic import edge_of
from birthsim_env.physics.rig.declaration import Derived, Prior, Section, derived, parameter


class Curve(NamedTuple):
    """Overlap and curvature of a type of valve, or the ranges of both."""

    overlap: Any
    curvature: Any

    def changes(self) -> dict[str, Any]:
        """The parameters of valves whose edges all have this curve, as ``Parameters.replace`` takes them."""
        return {f"valves.{side}_{name}": value for side in ("supply", "exhaust") for name, value in self._asdict().items()}


LINEAR = Curve(0.0, 0.0)
"""A valve whose flow is proportional to its opening."""
MPYE_5_M5 = Curve(0.11, 0.43)
"""The paper's valve, MPYE-5-M5-010-B, fitted to its catalogue with 6 bar before and 5 bar behind it, as table 2-2 of Y. Zhu,
PhD thesis, Vanderbilt 2006, has it: at most 1.8 % of full flow away."""
TOLERATED = Curve(*((0.9 * value, 1.1 * value) for value in MPYE_5_M5))
"""The maker promises the flow within 10 %."""
CURVE = "catalogue of the paper's MPYE-5-M5-010-B, within 10 %"


def _overlap(side: str) -> Any:
    return parameter(
        "-",
        f"overlap d of the edge to the {side}: opening of the spool up to which it stays shut",
        default=MPYE_5_M5.overlap,
        source=CURVE,
        least=0,
        most=0.5,
        range=TOLERATED.overlap,
        identified=Prior(5.0, scale=0.01),
        row=None,
    )


def _curvature(side: str) -> Any:
    return parameter(
        "-",
        f"curvature c of the edge to the {side}: how much steeper than on average its flow rises beyond the overlap",
        default=MPYE_5_M5.curvature,
        source=CURVE,
        least=-0.8,
        most=0.8,
        range=TOLERATED.curvature,
        identified=Prior(2.5, scale=0.1),
        row=None,
    )


def _more(of: str, most: float, drawn: float) -> Any:
    return parameter(
        "-",
        f"more {of}",
        default=0.0,
        source="assumed",
        least=-most,
        most=most,
        option=True,
        range=(-drawn, drawn),
        on_request=True,
        row=None,
    )


@dataclass(frozen=True)
class Valves(Section):
    """Proportional servovalve: ISO 6358 orifices behind a spool with a first-order lag."""

    sonic_conductance: float = parameter(
        "m3/(s Pa)",
        "sonic conductance C",
        default=3.9e-9,
        source="from 100 l/min nominal, 6 to 5 bar",
        least=1e-12,
        most=2e-8,
        identified=Prior(0.5),
        row="conductance",
    )
    critical_ratio: float = parameter(
        "-",
        "critical pressure ratio b",
        default=0.30,
        source="from 100 l/min nominal, 6 to 5 bar",
        least=0,
        most=0.9,
        identified=Prior(0.3),
        row="critical",
    )
    leakage_ratio: float = parameter(
        "-",
        "leakage over sonic conductance, Cl/C",
        default=0.005,
        source="assumed",
        least=0,
        most=0.5,
        identified=Prior(0.7),
        row=None,
    )
    time_constant: float = parameter(
        "s",
        "time constant of a spool",
        default=0.004,
        source="assumed, -3 dB at 40 Hz; the data sheet has 125 Hz for the spool of an MPYE-5-M5, 1.3 ms (docs/valves.md)",
        least=2e-4,
        most=10,
        range=(0.0012, 0.008),
        identified=Prior(0.7),
        row="tau",
    )
    supply_overlap: float = _overlap("supply")
    supply_curvature: float = _curvature("supply")
    exhaust_overlap: float = _overlap("exhaust")
    exhaust_curvature: float = _curvature("exhaust")
    exhaust_ratio: float = parameter(
        "-",
        "conductance of the fully open edge to the exhaust over that to the supply",
        default=1.0,
        source="assumed of a symmetric spool",
        least=0.1,
        most=2,
        option=True,
        range=(0.9, 1.1),
        on_request=True,
        identified=Prior(1.0, scale=0.1, needs="exhaust_ratio"),
        row=None,
    )
    crossing: float = parameter(
        "-",
        "part of the conductance over which a controller crosses the overlap; the plant does not know it",
        default=0.03,
        source="docs/valves.md",
        least=1e-4,
        most=1,
        option=True,
    )
    hysteresis: float = parameter(
        "-",
        "width of the play in the opening; 0 is none",
        default=0.0,
        source="up to 0.02 assumed",
        least=0,
        most=0.5,
        option=True,
        range=(0, 0.02),
        on_request=True,
        identified=Prior(2.0, scale=0.01, needs="hysteresis"),
        row="play",
    )
    opening_limit: float = parameter(
        "-",
        "largest opening; 1 is full",
        default=1.0,
        source="0.8 to 1 assumed",
        above=0,
        most=1,
        option=True,
        range=(0.8, 1),
        on_request=True,
    )

    leakage = derived("m3/(s Pa)", "leakage conductance", lambda own: own.leakage_ratio * own.sonic_conductance)
    knee = derived("1", "1/(1 - critical)", lambda own: 1 / (1 - own.critical_ratio))
    laminar = derived("1", "of ``valves.laminar_slope``", lambda own: valves.laminar_slope(own.critical_ratio))
    spool_rate = derived("1/s", "1/tau", lambda own: 1 / own.time_constant)


@dataclass(frozen=True)
class Valve(Section):
    """What one valve, of the chamber that its section names, has more than all four share."""

    supply_overlap: float = _more("overlap of the edge to the supply; one that comes below 0 is 0", 0.3, 0.02)
    supply_curvature: float = _more("curvature of the edge to the supply; one that comes beyond 0.95 is 0.95", 0.8, 0.04)
    supply_conductance: float = _more("conductance of the edge to the supply, as a part of it", 0.5, 0.1)
    exhaust_overlap: float = _more("overlap of the edge to the exhaust; one that comes below 0 is 0", 0.3, 0.02)
    exhaust_curvature: float = _more("curvature of the edge to the exhaust; one that comes beyond 0.95 is 0.95", 0.8, 0.04)
    exhaust_conductance: float = _more("conductance of the edge to the exhaust, as a part of it", 0.5, 0.1)


MOST_CURVED = 0.95
"""Beyond a curvature of 1 an edge would let less through again before it is fully open."""

VALVES = ("p1", "n1", "p2", "n2")
"""Chambers in the order of the state, whose valves have the sections ``valve_p1`` to ``valve_n2``."""


def _edge_number(side: str, valve: str, number: int, rig: Any) -> Any:
    """A ``number``, 0 to 2, of ``characteristic.Edge`` of a valve's edge to the ``side``, ``"supply"`` or ``"exhaust"``."""
    shared, own = rig.valves, getattr(rig, f"valve_{valve}")
    overlap = np.maximum(getattr(shared, f"{side}_overlap") + getattr(own, f"{side}_overlap"), 0.0)
    curvature = getattr(shared, f"{side}_curvature") + getattr(own, f"{side}_curvature")
    curvature = np.minimum(np.maximum(curvature, -MOST_CURVED), MOST_CURVED)
    share = 1.0 + getattr(own, f"{side}_conductance")
    if side == "exhaust":
        share = share * shared.exhaust_ratio
    return edge_of(overlap, curvature, share)[number]


def edge_rows() -> Iterator[tuple[str, Derived]]:
    """The rows of all edges, the same number of the four valves side by side."""
    numbers = (("overlap", "d"), ("slope", "of ``characteristic.Edge``"), ("bend", "of ``characteristic.Edge``"))
    for side in ("supply", "exhaust"):
        for k, (number, about) in enumerate(numbers):
            for valve in VALVES:
                name, of = f"{side}_{number}_{valve}", f"{about} of the edge to the {side}, valve of chamber {valve.upper()}"
                yield name, derived("1", of, partial(_edge_number, side, valve, k), name)
