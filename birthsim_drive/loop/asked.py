"""What was asked for in a drive, as a table beside its log: phase, target, stiffness, and openings that the controller wanted.

The rows are those of the log, so that errors follow from both. Openings here are those of controller and plan, before limits,
ramps and a dry run change them.
"""

import numpy as np

from baselines.identification.log.rail_log import rail_direction
from birthsim_drive.loop.record import PHASES, Period
from birthsim_env.loop.rows import Signals
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters

PLANE: tuple[str, ...] = (
    "target_x", "target_y", "stiffness_x", "stiffness_y", "wanted_P1", "wanted_N1", "wanted_P2", "wanted_N2",
)  # fmt: skip
RAIL: tuple[str, ...] = ("target", "stiffness", "wanted_P", "wanted_N")
"""Columns behind time, s, and phase: m, as in the log; N/m; openings, -1 to 1."""


def asked_table(sampled: Array, rig: Parameters) -> str:
    """The table, as CSV, of the periods (Period.size, T) in which a sample came."""
    signals = Signals(sampled[Period.signals.place])
    reference, wanted = signals.reference, sampled[Period.law.place]
    columns, rows = PLANE, np.vstack([reference.position, reference.stiffness, wanted])
    if rig.linkage.is_rail:
        target = rail_direction(rig) @ reference.position - rig.geometry.k2
        columns, rows = RAIL, np.vstack([target, reference.stiffness[0], wanted[2:]])
    phases = [PHASES[int(phase)] for phase in sampled[Period.phase.first]]
    lines = [
        f"{time:.10g},{phase},{','.join(f'{value:.10g}' for value in row)}"
        for time, phase, row in zip(signals.time, phases, rows.T, strict=True)
    ]
    return "\n".join([",".join(("time", "phase", *columns)), *lines]) + "\n"
