"""Flow of a servovalve over its opening: the catalogue's curve beside the package's characteristic."""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from baselines.work.tasks import Result
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.tables.reading import read_table

FILE = Path("valve_flow") / "valve_table_2-2.csv"
CENTRE, SPAN = 5.0, 5.0
"""V: the voltage at which the valve is shut, and what opens it from there."""

SHOWN = 11
"""Openings of the picture."""


def curve(data: Path) -> tuple[Array, Array]:
    """Relative opening and relative flow of the catalogue."""
    table = read_table("--data", data / FILE)
    flow = table.column("Exp. Vol. flow rate")
    return (table.column("Voltage") - CENTRE) / SPAN, flow / flow.max()


def characteristic(opening: Array, overlap: float, curvature: float) -> Array:
    """Relative flow."""
    beyond = np.maximum(opening - overlap, 0.0) / (1.0 - overlap)
    return beyond * (1.0 + curvature * (1.0 - beyond))


def measure(data: str, files: dict[str, str]) -> Result:
    """Both numbers by least squares, and the largest error of the curve and of a flow linear in the opening."""
    opening, flow = curve(Path(data))
    found: Any = least_squares(lambda own: characteristic(opening, *own) - flow, [0.06, 0.4])
    openings = np.linspace(0, 1, SHOWN)
    return {
        "overlap": float(found.x[0]),
        "curvature": float(found.x[1]),
        "largest": float(np.abs(found.fun).max()),
        "linear": float(np.abs(opening - flow).max()),
        "openings": openings.tolist(),
        "catalogue": np.interp(openings, opening, flow).tolist(),
        "files": files,
    }
