"""The characteristic of a valve from a measured table of openings and relative flows.

A table does not reach the kernels: overlap, curvature and share of each edge do, fitted to it; why, says
``physics.pneumatics.characteristic``. How far the form is from the table is told, and a table that it does not fit is refused.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.pneumatics.characteristic import edge_of, opened_part
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.servovalves import MPYE_5_M5, Curve
from birthsim_env.tables.reading import read_table
from birthsim_env.tables.selection import Selection
from birthsim_env.tables.table import Reading

FIELDS = {"opening": "1", "flow": "1"}
"""Columns: opening of the spool, -1 to 1, and what flows then, in parts of the flow at full opening to the supply."""

LEAST = 6
"""Rows that an edge needs, assumed: three times its numbers."""

FITS = 0.05
"""Parts of full flow by which a table may be away from the form; half of what a maker of such valves promises."""

OTHERS = "a heading that names opening and flow, each without unit or in %"


@dataclass(frozen=True)
class Side:
    """What was fitted to the rows of one edge: its ``curve``, its ``share`` of the conductance, and the largest ``error``, in
    parts of full flow."""

    curve: Curve
    share: float
    error: float


@dataclass(frozen=True)
class ValveTable:
    """The edges of a valve as a table has them; None where it has no rows of an edge, which then is as the other one."""

    supply: Side | None
    exhaust: Side | None

    def changes(self, rig: Parameters, chamber: str = "") -> dict[str, float]:
        """What changes of a ``rig``, as ``Parameters.replace`` takes it: of all its valves, or of that of a ``chamber``, such
        as ``"N2"``, alone.

        A table of relative flows does not tell the conductance to the supply, only how many times that to the exhaust is.
        """
        first = self.supply or self.exhaust
        assert first is not None, "a table has rows of one edge or of both"
        supply, exhaust, shared = self.supply or first, self.exhaust or first, rig.valves
        found = {
            "supply_overlap": supply.curve.overlap,
            "supply_curvature": supply.curve.curvature,
            "exhaust_overlap": exhaust.curve.overlap,
            "exhaust_curvature": exhaust.curve.curvature,
        }
        ratio = exhaust.share / supply.share
        if not chamber:
            return {f"valves.{name}": value for name, value in found.items()} | {"valves.exhaust_ratio": ratio}
        own = {name: value - getattr(shared, name) for name, value in found.items()}
        section = f"valve_{chamber.lower()}"
        to_supply = 1.0 + float(getattr(rig, section).supply_conductance)
        own["exhaust_conductance"] = to_supply * ratio / shared.exhaust_ratio - 1.0
        return {f"{section}.{name}": value for name, value in own.items()}

    def words(self) -> list[str]:
        """A line an edge, and how well the form fits."""
        return [
            f"edge to the {name}: overlap {side.curve.overlap:.3f}, curvature {side.curve.curvature:.3f}, "
            f"at most {100 * side.error:.1f} % of full flow away"
            for name, side in (("supply", self.supply), ("exhaust", self.exhaust))
            if side
        ]


def fit_valve_table(path: Path) -> ValveTable:
    """The edges that fit a table best: openings from -1 to 1 and flows, of which those at negative openings leave.

    Raises ``ValueError`` in one line for a table that cannot be used, or that the form does not fit.
    """
    table = read_table("--valve-table", path, Reading(names=frozenset(FIELDS)))
    chosen = Selection(table, FIELDS, {}, OTHERS)
    chosen.check(FIELDS)
    opening, flow = (chosen.values(name) for name in FIELDS)
    if not (np.isfinite(opening).all() and np.isfinite(flow).all() and np.abs(opening).max(initial=0.0) <= 1.0):
        raise ValueError(f"{table.source}: openings and flows; allowed: finite numbers, openings from -1 to 1")
    sides = {}
    for name, sign in (("supply", 1.0), ("exhaust", -1.0)):
        rows = sign * opening > 0.0
        sides[name] = fit_edge(sign * opening[rows], np.abs(flow[rows]), f"{table.source}, edge to the {name}")
    found = ValveTable(**sides)
    if not any(sides.values()):
        raise ValueError(
            f"{table.source} has openings of 0 alone; allowed: {LEAST} rows or more of an edge, up to full opening"
        )
    return found


def parts_of(opening: Array, overlap: float, curvature: float, share: float = 1.0) -> Array:
    """Part of the valve's conductance that an edge opens at each ``opening``."""
    edge = edge_of(overlap, curvature, share)
    return np.array([opened_part(one, edge) for one in opening.tolist()])


def fit_edge(opening: Array, flow: Array, where: str) -> Side | None:
    """What fits the rows of one edge best; None without rows. Raises ``ValueError``, as ``fit_valve_table`` does."""
    if not len(opening):
        return None
    if len(opening) < LEAST or opening.max() < 0.9 or flow.max() <= 0.0:
        raise ValueError(
            f"{where} has {len(opening)} rows up to an opening of {opening.max():g}; allowed: {LEAST} or more, up to "
            "0.9 or more, some with flow"
        )
    most = float(flow.max())

    best = least_squares(
        lambda numbers: parts_of(opening, *numbers) - flow / most, [*MPYE_5_M5, 1.0], bounds=([0.0, -0.8, 0.5], [0.5, 0.8, 2.0])
    )
    error = float(np.abs(best.fun).max())
    if error > FITS:
        worst = int(np.argmax(np.abs(best.fun)))
        raise ValueError(
            f"{where}: the best overlap and curvature, {best.x[0]:.3f} and {best.x[1]:.3f}, are {100 * error:.1f} % of full "
            f"flow away at an opening of {opening[worst]:g}; allowed: {100 * FITS:g} % from a curve t (1 + c (1 - t))"
        )
    return Side(Curve(float(best.x[0]), float(best.x[1])), float(best.x[2]) * most, error)
