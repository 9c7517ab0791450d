"""What a rig does in the windows of a log, so that a reader sees in which part of the model an error arises."""

from collections.abc import Mapping

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import NDArray

from baselines.identification.log.log_columns import CHAMBERS
from baselines.identification.windows.windows import Windows
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Array, Rig, parameter_column
from birthsim_env.physics.linkage.inverse_kinematics import pistons_at
from birthsim_env.physics.rig.parameters import Parameters

DEGREE = 3
"""Of the polynomials of time through a window's positions, from which speeds are taken."""

SLOW, FAST = 0.005, 0.1
"""m/s of a piston: at rest below, fast above; assumed. The proposed experiment goes up to 0.3 m/s."""

NEAR = 0.01
"""m from the end of a stroke that are near it; assumed."""

OPEN = 0.9
"""Opening at which a valve is wide open; assumed. It is shut within its overlaps, as the rig's file has them."""

EMPTY, FULL = 1.2, 0.95
"""Times the atmosphere, and the supply, from which a chamber is near it; assumed. Valves there are not choked."""

SUPPLY, EXHAUST = (tuple(getattr(at, f"{side}_OVERLAP_{name}") for name in CHAMBERS) for side in ("SUPPLY", "EXHAUST"))
"""Rows of the overlaps of the four valves' edges to either side."""

PUSHED = 1.0
"""N of the hand; assumed."""

SPEEDS = ("at rest", "slow", "fast")


def doings(windows: Windows, rig: Parameters) -> Mapping[str, NDArray[np.bool_]]:
    """Windows (W,) in which the rig does what a name says; of ``SPEEDS`` it does one."""
    trial, topology = windows.trial, windows.trial.topology
    places, speeds = _pistons(windows, rig)
    cylinders, chambers = list(topology.cylinders), list(topology.chambers)
    quickest = np.abs(speeds[cylinders]).max(axis=(0, 2))
    halves = np.array([getattr(rig, f"cylinder{k + 1}").stroke / 2 for k in cylinders])
    rows = windows.starts[:, None] + np.arange(windows.length)
    openings, forces = trial.openings[chambers][:, rows], trial.forces[:, rows]
    column = parameter_column(rig)
    supply, exhaust = (column[list(rows)][chambers, None] for rows in (SUPPLY, EXHAUST))
    highest, lowest = openings.max(axis=2), openings.min(axis=2)
    known = windows.pressure_weights[..., chambers] > 0
    pressures = windows.pressures[..., chambers]
    return {
        "at rest": quickest < SLOW,
        "slow": (quickest >= SLOW) & (quickest < FAST),
        "fast": quickest >= FAST,
        "a piston reverses": ((speeds[cylinders].min(axis=2) < -SLOW) & (speeds[cylinders].max(axis=2) > SLOW)).any(axis=0),
        "near a stop": (np.abs(places[cylinders]).max(axis=2) > halves[:, None] - NEAR).any(axis=0),
        "valves shut": ((highest <= supply) & (lowest >= -exhaust)).all(axis=0),
        "a valve crosses shut": ((lowest < -exhaust) & (highest > supply)).any(axis=0),
        "a valve wide open": (np.maximum(highest, -lowest) > OPEN).any(axis=0),
        "a chamber near the atmosphere": (known & (pressures < EMPTY * rig.air.atmospheric_pressure)).any(axis=(1, 2)),
        "a chamber near the supply": (known & (pressures > FULL * rig.air.supply_pressure)).any(axis=(1, 2)),
        "a hand pushes": (np.abs(forces).max(axis=2) > PUSHED).any(axis=0),
    }


def _pistons(windows: Windows, rig: Parameters) -> tuple[Array, Array]:
    """Positions, m, and speeds, m/s, of both pistons (2, W, F), at the positions that arrive; the first where there is none."""
    period, shape = windows.trial.period, windows.arrived.shape
    motion = np.empty((4, *shape))
    for w, (arrived, valid, places) in enumerate(zip(windows.arrived, windows.valid, windows.positions, strict=True)):
        when = np.where(valid, arrived, arrived[int(np.argmax(valid))]) * period
        scale = max(float(np.ptp(when)), period)
        fitted = polynomial.polyfit(when[valid] / scale, places[valid], min(DEGREE, int(valid.sum()) - 1))
        motion[:2, w] = polynomial.polyval(when / scale, fitted)
        motion[2:, w] = polynomial.polyval(when / scale, polynomial.polyder(fitted)) / scale
    joints = np.empty((4, motion[0].size))
    pistons_at(motion.reshape(4, -1), Rig(parameter_column(rig)), joints)
    return joints[:2].reshape(2, *shape), joints[2:].reshape(2, *shape)
