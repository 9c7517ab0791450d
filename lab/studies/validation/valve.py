"""Flow of a servovalve over its opening: the catalogue's curve beside the package's characteristic."""

from pathlib import Path

import numpy as np

from baselines.identification.valve_table import fit_edge
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


def measure(data: str, files: dict[str, str]) -> Result:
    """What ``identify --valve-table`` fits, and the largest error of the curve and of a flow linear in the opening."""
    opening, flow = curve(Path(data))
    side = fit_edge(opening, flow, "--data")
    assert side, "the catalogue has rows"
    openings = np.linspace(0, 1, SHOWN)
    return {
        "overlap": side.curve.overlap,
        "curvature": side.curve.curvature,
        "share": side.share,
        "largest": side.error,
        "linear": float(np.abs(opening - flow).max()),
        "openings": openings.tolist(),
        "catalogue": np.interp(openings, opening, flow).tolist(),
        "files": files,
    }
