"""Recordings for tests, without a rig: rows that a rig could have shown, and files of them."""

from pathlib import Path
from typing import Any

import numpy as np

from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.logs.recording import COLUMNS, EVERY, FIELDS, FORMAT, SLICES, packed

INTERVAL = EVERY * 0.001
SETTINGS = {
    "scenario": "circle", "controller": "pid", "compare": "lqr", "Kclx": 2000.0, "mass": 3.0, "friction": 1.0,
    "scenario_force": False,
}  # fmt: skip


def example(count: int, second: bool = False) -> np.ndarray:
    """Rows (``count``, 2 COLUMNS) of a head that swings under a pull after the first quarter; the rig beside it is a mm off."""
    rows, times = np.full((count, 2 * COLUMNS), np.nan), INTERVAL * np.arange(count)
    values: dict[str, Any] = {
        "time": times, "episode_time": times, "joints": 0.01 * np.sin(times), "position": [0.5, 0.0], "velocity": [0.0, 0.0],
        "target": [0.5, 0.0], "compliant": [0.5, 0.0], "scenario_force": [0.0, 0.0], "drag_force": [0.0, 0.0],
        "pressures": [3e5, 5e5, 4e5, 4.5e5], "openings": [0.1, -0.1, 0.0, 0.0], "stiffness": [2000.0, 2000.0],
        "pneumatic": [4600.0, 2300.0], "pneumatic_setpoint": [4600.0, 2300.0], "friction": [3.0, -2.0],
        "flows": [1e-4, -1e-4, 0.0, 0.0],
    }  # fmt: skip
    for name, value in values.items():
        rows[:, SLICES[name]] = np.reshape(value, (-1, 1)) if np.shape(value) == (count,) else value
    pulled = rows[count // 4 :]
    pulled[:, SLICES["pointer"]], pulled[:, SLICES["drag_force"]] = [0.53, 0.01], [20.0, 5.0]
    pulled[:, SLICES["position"]] += 0.01 * np.sin(5.0 * times[count // 4 :])[:, None]
    pulled[:, SLICES["compliant"]] = [0.51, 0.0025]
    if second:
        rows[:, COLUMNS:] = rows[:, :COLUMNS]
        rows[:, COLUMNS:][:, SLICES["position"]] += 1e-3
    return rows


def events_of(count: int) -> list[dict[str, Any]]:
    """What was set: another controller after half of the rows."""
    path = [[0.45 + 0.05 * np.cos(0.1 * k), 0.05 * np.sin(0.1 * k)] for k in range(64)]
    return [
        {"row": 0, "settings": SETTINGS}, {"row": 0, "path": [[0.5, 0.0]]}, {"row": 0, "lost": None},
        {"row": count // 2, "settings": {**SETTINGS, "controller": "backstepping", "Kclx": 3000.0}},
        {"row": count // 2, "path": path},
    ]  # fmt: skip


def header_of(rig: Parameters) -> dict[str, Any]:
    return {"format": FORMAT, "birthsim": "0", "rig": rig.to_dict(), "columns": list(FIELDS), "interval": INTERVAL}


def write_recording(path: Path, rows: np.ndarray, rig: Parameters | None = None) -> Path:
    """A file of rows in two chunks, with ``events_of``; ``path``."""
    half, events = len(rows) // 2, events_of(len(rows))
    first, then = ([one for one in events if (one["row"] < half) == early] for early in (True, False))
    chunks = packed({"events": first}, rows[:half]) + packed({"events": then}, rows[half:])
    path.write_bytes(packed(header_of(rig or Parameters())) + chunks)
    return path
