"""What a result keeps of a run: figures of every lane, and curves over frequency and time as a few quantiles of the lanes."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from baselines.work.tasks import Result
from birthsim_env.physics.compiled.lanes import Array
from lab.studies.haptics.rendering import PEAKS

PEAK = 10.0
"""N: the hand's force of tables and curves."""

SHOWN = 2000.0
"""N/m, the setpoint of the curves, where it was measured."""

QUARTILES = (0.25, 0.5, 0.75)

DIGITS = 6
"""Of every number that is kept; tables show three."""

_RAW = (
    "pose", "direction", "frequency", "felt", "declared", "port_damping", "differences", "energy_over_time", "energy_period",
    "motion_mm", "given_back", "time", "offset_mm",
)  # fmt: skip
"""What is kept as curves or not at all."""


def kept(run: dict[str, Any]) -> dict[str, Any]:
    """A run of ``lab.studies.haptics.measurements.gathered`` without the responses of each lane."""
    found = dict(run)
    if "impedance" in run:
        shown = next((one for one in run["impedance"] if one["stiffness"] == SHOWN), run["impedance"][-1])
        found["impedance"] = [_impedance(piece) for piece in run["impedance"]]
        found["impedance"][run["impedance"].index(shown)]["curves"] = _curves(shown)
    if "release" in run:
        found["release"] = [_release(piece) for piece in run["release"]]
    return {name: _rounded(value) for name, value in found.items()}


def _impedance(piece: Result) -> Result:
    """Of a lane ``shortage`` at the frequency where it is largest, and the just noticeable differences at 1 Hz, ``noticed``."""
    found = _plain(piece) | {"shortage": _numbers(piece["shortage"]).max(axis=0)}
    if "differences" in piece:
        line = int(np.argmin(np.abs(np.array(piece["frequency"]) - 1.0)))
        found["noticed"] = piece["differences"][line]
    return found


def _curves(piece: Result) -> Result:
    """Over frequency: quartiles of magnitude, N/m, and phase, degrees, medians of those declared, and the median and the least
    of the port's damping; over time, the energy that the worst lane has given. Of lanes at ``PEAK`` that are not lost."""
    lanes = (np.array(piece["peak"]) == PEAK) & ~np.array(piece["lost"], dtype=bool)
    felt, damping = _complex(piece["felt"])[:, lanes], _numbers(piece["port_damping"])[:, lanes]
    declared = None if piece["declared"] is None else _complex(piece["declared"])
    wanted = (
        None
        if declared is None
        else {"magnitude": np.median(np.abs(declared), axis=1), "phase": np.median(np.degrees(np.angle(declared)), axis=1)}
    )
    return {
        "frequency": piece["frequency"], "magnitude": _quantiles(np.abs(felt), QUARTILES),
        "phase": _quantiles(phase(felt, None if declared is None else declared[:, lanes]), QUARTILES), "declared": wanted,
        "damping": _quantiles(damping, (0.5, 0.0)), "energy": piece["energy_over_time"][PEAKS.index(PEAK)],
        "energy_period": piece["energy_period"],
    }  # fmt: skip


def _release(piece: Result) -> Result:
    """``curves``: the displacement's median, least and largest over time, and the median of the declared impedance's."""
    ideal = piece["ideal"]
    wanted = None if ideal is None else np.median(ideal["offset_mm"], axis=0)
    offset = _quantiles(_numbers(piece["offset_mm"]).T, (0.5, 0.0, 1.0))
    return _plain(piece) | {
        "ideal": None if ideal is None else _plain(ideal),
        "curves": {"time": piece["time"], "offset_mm": offset, "declared": wanted},
    }


def phase(felt: Any, declared: Any | None) -> Array:
    """Degrees, (F, N): within half a turn of what is declared, (F, N), or of 90 degrees where nothing is."""
    about = 90.0 if declared is None else np.degrees(np.angle(declared))
    return np.asarray((np.degrees(np.angle(felt)) - about + 180) % 360 - 180 + about)


def _quantiles(values: Array, places: Sequence[float]) -> Array:
    """Over the lanes of ``values`` (F, N) that have a number: (places, F); NaN where none has."""
    found = np.full((len(places), len(values)), np.nan)
    for k, row in enumerate(values):
        if len(numbers := row[~np.isnan(row)]):
            found[:, k] = np.quantile(numbers, places)
    return found


def _plain(piece: Result) -> Result:
    return {name: value for name, value in piece.items() if name not in _RAW}


def _numbers(values: Any) -> Array:
    """JSON's null is NaN."""
    return np.array(values, dtype=np.float64)


def _complex(parts: Any) -> Any:
    real, imaginary = _numbers(parts)
    return real + 1j * imaginary


def _rounded(content: Any) -> Any:
    """As JSON takes it, numbers in ``DIGITS`` digits; None for what is not finite."""
    if isinstance(content, np.ndarray):
        content = content.tolist()
    if isinstance(content, dict):
        return {name: _rounded(value) for name, value in content.items()}
    if isinstance(content, (list, tuple)):
        return [_rounded(value) for value in content]
    if isinstance(content, float):
        return float(f"{content:.{DIGITS}g}") if np.isfinite(content) else None
    return content
