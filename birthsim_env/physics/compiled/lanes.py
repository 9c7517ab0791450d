"""Row numbers of the arrays that kernels share: the state (18, N) and the parameters of every lane.

A lane is one environment. Arrays are laid out quantity by quantity, (rows, N), so that a kernel's innermost loop walks
over lanes with unit stride.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from birthsim_env.physics.compiled.records import Numbers, number
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.rows import RIG_ROWS, rows_of
from birthsim_env.physics.rig.values import length_of, shown

Array = NDArray[np.float64]

STATE_NAMES = (
    *("y1", "v1", "y2", "v2", "z1", "z2"),
    *("Pp1", "Tp1", "Pn1", "Tn1", "Pp2", "Tp2", "Pn2", "Tn2"),
    *("s1P", "s1N", "s2P", "s2N"),
)
"""Rows of the state: piston positions (m) and speeds (m/s), bristle deflections (m), chamber pressures (Pa) and
temperatures (K), spool openings (-)."""

STATE_UNITS = (*("m", "m/s") * 2, "m", "m", *("Pa", "K") * 4, *("1",) * 4)
STATES = len(STATE_NAMES)
Y1, V1, Y2, V2, Z1, Z2, PP1, TP1, PN1, TN1, PP2, TP2, PN2, TN2, S1P, S1N, S2P, S2N = range(STATES)
PRESSURES = (PP1, PN1, PP2, PN2)
TEMPERATURES = (TP1, TN1, TP2, TN2)
SPOOLS = (S1P, S1N, S2P, S2N)


class Rig(Numbers):
    """The parameters of one rig, as controllers and plants compute with them: ``rig.rows``."""

    vars().update({row.name: number(row.unit, row.about) for row in RIG_ROWS})
    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> float: ...


PARAMETER_NAMES, PARAMETER_UNITS = tuple(Rig.groups), tuple(group.units[0] for group in Rig.groups.values())
PARAMETERS = len(PARAMETER_NAMES)

globals().update({name.upper(): group.first for name, group in Rig.groups.items()})
"""A row's number, ``MASS`` for that of ``mass``: kernels take it for a constant."""

if TYPE_CHECKING:

    def __getattr__(name: str) -> int: ...


def parameter_column(parameters: Parameters) -> Array:
    """``Rig`` of one rig: one lane's column of the parameter array, (PARAMETERS,), SI units."""
    return np.array(rows_of(parameters), dtype=np.float64)


def parameter_columns(parameters: Parameters, num_lanes: int) -> Array:
    """``parameter_column`` of lanes (PARAMETERS, num_lanes); fields of ``parameters`` but geometry may be (num_lanes,)."""
    columns = np.empty((PARAMETERS, num_lanes))
    for row, value in zip(columns, rows_of(parameters), strict=True):
        row[:] = value
    return columns


def parameter_array(parameters: Parameters | Sequence[Parameters], num_lanes: int) -> Array:
    """Parameters of all lanes, (PARAMETERS, num_lanes): one rig for all, or a sequence with one per lane."""
    if isinstance(parameters, Parameters):
        return parameter_columns(parameters, num_lanes)
    if length_of(parameters) != num_lanes:
        raise ValueError(
            f"parameters has {length_of(parameters):g} entries; allowed: one Parameters, or one for each of {num_lanes} lanes"
        )
    for lane, rig in enumerate(parameters):
        if not isinstance(rig, Parameters):
            raise ValueError(f"parameters[{lane}] = {shown(rig)}; allowed: a Parameters")
    return np.stack([parameter_column(p) for p in parameters], axis=1)
