"""The ``info`` of the environments: the true state of the rig and its task in SI units."""

from __future__ import annotations

import numpy as np

from birthsim_env.loop.signals import compliance
from birthsim_env.physics import control_model, dynamics
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array

FIELDS = {
    "time": (1, "s since the episode began"),
    "since_jump": (1, "s since the user force or a stiffness setpoint jumped"),
    "position": (2, "m, end effector x, y"),
    "velocity": (2, "m/s, end effector"),
    "target": (2, "m"),
    "compliant_target": (2, "m, (19)"),
    "tracking_error": (2, "m, end effector minus compliant target"),
    "user_force": (2, "N"),
    "stiffness_setpoint": (2, "N/m, Kclx and Kcly"),
    "piston_position": (2, "m, y1 and y2"),
    "piston_velocity": (2, "m/s"),
    "pressure": (4, "Pa absolute, chambers P1, N1, P2, N2"),
    "temperature": (4, "K, chambers P1, N1, P2, N2"),
    "opening": (4, "1, spools of chambers P1, N1, P2, N2"),
    "pneumatic_force": (2, "N, Pp Sp - Pn Sn of both cylinders (3)"),
    "pneumatic_stiffness": (2, "N/m, (9)"),
    "pneumatic_stiffness_setpoint": (2, "N/m"),
    "supply_flow": (1, "kg/s drawn from the supply"),
    "impact_speed": (2, "m/s, fastest collision of each piston with an end stop in the last step; 0 where none"),
}
"""Name -> (number of values, unit and meaning)."""

ROWS = sum(size for size, _ in FIELDS.values())
_STARTS = np.cumsum([0] + [size for size, _ in FIELDS.values()])
SLICES = {name: slice(int(a), int(b)) for name, a, b in zip(FIELDS, _STARTS, _STARTS[1:], strict=False)}
"""Name -> rows of ``describe``."""


@helper
def describe(
    time: Array,
    since: Array,
    state: Array,
    motion: Array,
    reference: Array,
    force: Array,
    impacts: Array,
    p: Array,
    rows: Array,
) -> None:
    """Writes all fields of N lanes, ``rows`` (ROWS, N), in the order of ``FIELDS``; parameters ``p`` (PARAMETERS, N)."""
    for i in range(state.shape[1]):
        rows[0, i], rows[1, i] = time[i], since[i]
        given = compliance(force[0, i], force[1, i], reference[8, i], reference[9, i], reference[14, i])
        for k in range(2):
            compliant = reference[k, i] + given[k]
            rows[2 + k, i], rows[4 + k, i] = motion[k, i], motion[2 + k, i]
            rows[6 + k, i], rows[8 + k, i] = reference[k, i], compliant
            rows[10 + k, i] = motion[k, i] - compliant
            rows[12 + k, i], rows[14 + k, i] = force[k, i], reference[8 + k, i]
            rows[36 + k, i] = reference[10 + k, i]
            rows[39 + k, i] = impacts[k, i]
        rows[16, i], rows[17, i], rows[18, i], rows[19, i] = state[at.Y1, i], state[at.Y2, i], state[at.V1, i], state[at.V2, i]
        for k in range(4):
            rows[20 + k, i] = state[at.PRESSURES[k], i]
            rows[24 + k, i] = state[at.TEMPERATURES[k], i]
            rows[28 + k, i] = state[at.SPOOLS[k], i]
        rows[32, i] = state[at.PP1, i] * p[at.AREA_P1, i] - state[at.PN1, i] * p[at.AREA_N1, i]
        rows[33, i] = state[at.PP2, i] * p[at.AREA_P2, i] - state[at.PN2, i] * p[at.AREA_N2, i]
        half1, half2 = p[at.HALF_L1, i], p[at.HALF_L2, i]
        y1, y2 = max(-0.99 * half1, min(0.99 * half1, state[at.Y1, i])), max(-0.99 * half2, min(0.99 * half2, state[at.Y2, i]))
        rows[34, i] = control_model.pneumatic_stiffness(
            state[at.PP1, i], state[at.PN1, i], p[at.AREA_P1, i], p[at.AREA_N1, i], half1 + y1, half1 - y1, p[at.INDEX, i]
        )
        rows[35, i] = control_model.pneumatic_stiffness(
            state[at.PP2, i], state[at.PN2, i], p[at.AREA_P2, i], p[at.AREA_N2, i], half2 + y2, half2 - y2, p[at.INDEX, i]
        )
        rows[38, i] = (
            max(dynamics.flows_of(state, p, i, at.PP1, at.TP1, at.S1P)[0], 0.0)
            + max(dynamics.flows_of(state, p, i, at.PN1, at.TN1, at.S1N)[0], 0.0)
            + max(dynamics.flows_of(state, p, i, at.PP2, at.TP2, at.S2P)[0], 0.0)
            + max(dynamics.flows_of(state, p, i, at.PN2, at.TN2, at.S2N)[0], 0.0)
        )


def vector_info(rows: Array) -> dict[str, Array]:
    """Name -> (N,) for single values, (N, size) for several."""
    return {
        name: rows[part.start] if size == 1 else rows[part].T
        for (name, part), (size, _) in zip(SLICES.items(), FIELDS.values(), strict=True)
    }


def single_info(rows: Array) -> dict[str, float | Array]:
    """Name -> number or array (size,) of the first lane."""
    column = rows[:, 0]
    values = column.tolist()
    return {
        name: values[part.start] if size == 1 else column[part]
        for (name, part), (size, _) in zip(SLICES.items(), FIELDS.values(), strict=True)
    }
