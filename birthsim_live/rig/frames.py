"""What a frame shows: one row of numbers per instant, in memory, in recordings and, named, on the way to the page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate
from typing import Any

import numpy as np

from birthsim_env.info import Info, describe, single_info
from birthsim_env.loop.rows import Signals, World
from birthsim_env.physics import geometry
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.simulation import Simulation
from birthsim_live.rig import inside
from birthsim_live.rig.hand import Hands

FIELDS = {
    "time": 1,
    "episode_time": 1,
    "joints": 2,
    "position": 2,
    "velocity": 2,
    "target": 2,
    "compliant": 2,
    "scenario_force": 2,
    "drag_force": 2,
    "pointer": 2,
    "pressures": 4,
    "openings": 4,
    "stiffness": 2,
    "pneumatic": 2,
    "pneumatic_setpoint": 2,
    "friction": 2,
    "flows": 4,
}
"""Name -> how many numbers, SI units; a pointer that is not there is NaN."""

COLUMNS = sum(FIELDS.values())
_ENDS = list(accumulate(FIELDS.values()))
SLICES = {name: slice(end - size, end) for (name, size), end in zip(FIELDS.items(), _ENDS, strict=True)}

LEAST_FORCE, LEAST_GIVEN = 5.0, 1e-4
"""N and m, assumed: below them the quotient of force and displacement says nothing."""


def row_of(simulation: Simulation, hands: Hands, episode_time: float) -> Array:
    """The present instant as a row (COLUMNS,)."""
    now, plant, rows, within = simulation, simulation.plant, np.empty((Info.size, 1)), np.empty((inside.ROWS, 1))
    world, seen = World(np.zeros((World.size, 1))), Signals(np.zeros((Signals.size, 1)))
    world.rig[:], world.state[:], world.motion.rows[:] = plant.lane_parameters, plant.state, now.motion
    world.force[:], world.impact[:], world.since_jump[:] = now.force, now.impacts, now.since_jump
    seen.time[:], seen.reference.rows[:] = now.time, now.reference.rows
    describe(world, seen, Info(rows), 1)
    info = single_info(rows)
    inside.look_inside(plant.state, plant.lane_parameters, within)
    hold = hands.hold
    pointer = (math.nan, math.nan) if hold is None else hold.pointer(plant.end_effector()[:2, 0], hands.stiffness)
    parts: Sequence[Any] = (
        info["time"], episode_time, info["piston_position"], info["position"], info["velocity"], info["target"],
        info["compliant_target"], hands.scenario_now, hands.drag_now, pointer, info["pressure"], info["opening"],
        info["stiffness_setpoint"], info["pneumatic_stiffness"], info["pneumatic_stiffness_setpoint"],
        within[:, 0],
    )  # fmt: skip
    return np.concatenate([np.atleast_1d(part) for part in parts])


def frame_of(row: Array, rig: Parameters) -> dict[str, Any]:
    """A row as named numbers, rounded to what can be seen, and what follows from them; None where there is no number."""
    rounded = [float(f"{value:.7g}") if math.isfinite(value) else None for value in row]
    frame: dict[str, Any] = {name: rounded[part.start] if FIELDS[name] == 1 else rounded[part] for name, part in SLICES.items()}
    if frame["pointer"][0] is None:
        frame["pointer"] = None
    force = row[SLICES["scenario_force"]] + row[SLICES["drag_force"]]
    given = row[SLICES["position"]] - row[SLICES["target"]]
    off = row[SLICES["position"]] - row[SLICES["compliant"]]
    frame["force"] = _numbers(force)
    frame["error_mm"] = _numbers([1e3 * math.hypot(*off)])[0]
    frame["rendered"] = _numbers(
        [
            f / x if abs(f) >= LEAST_FORCE and abs(x) >= LEAST_GIVEN and f * x > 0 else math.nan
            for f, x in zip(force, given, strict=True)
        ]
    )
    frame["linkage"] = linkage(row[SLICES["joints"]], rig)
    return frame


def _numbers(values: Any) -> list[float | None]:
    return [float(f"{value:.6g}") if math.isfinite(value) else None for value in values]


def linkage(joints: Array, rig: Parameters) -> list[list[float]] | None:
    """Pivot 1, joint, pivot 2 and end effector, m, for piston positions (2,), m; None where the linkage cannot close."""
    g = rig.geometry
    try:
        tilt = float(geometry.theta1(joints[0], rig))
    except ValueError:
        return None
    along, r2 = (math.sin(tilt), -math.cos(tilt)), g.k2 + float(joints[1])
    points = (
        (g.d3 * math.cos(g.gamma3), g.d3 * math.sin(g.gamma3)),
        (g.d6 * along[0], g.d6 * along[1]),
        (0.0, 0.0),
        (r2 * along[0], r2 * along[1]),
    )
    return [[round(x, 7), round(y, 7)] for x, y in points]
