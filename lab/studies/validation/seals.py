"""Friction of measured pistons: the package's laws, driven by the motion and the pressure that were measured."""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import savgol_filter

from baselines.work.tasks import Result
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.seals import friction
from birthsim_env.tables.reading import read_table

FOLDER = "piston_friction"
SEALS = ("NAPN", "NAP310", "PK", "KDN")
BARS = (1, 3, 5, 7)
AREA = np.pi / 4 * 0.025**2
"""m2, of the bore on which the pressure acts."""

PERIOD, SUBSTEPS, WINDOW, SETTLED = 0.010, 20, 11, 15
"""s between samples that are used; steps of the bristle in one; samples of the filter that gives speed; rows left out."""

SLIDING = 2e-3
"""m/s, above which a sample counts as sliding."""

LAWS = {"LuGre": True, "elasto-plastic": False}
SPEED, PRESSURE, FORCE = range(3)
"""Rows of a ``motion``."""

NAMES = ("f0", "per_bar", "static_ratio", "stribeck_speed", "bristle_stiffness", "viscous")
F0, PER_BAR, RATIO, STRIBECK, STIFFNESS, VISCOUS = range(len(NAMES))
UNITS = {
    "f0": "N",
    "per_bar": "N/bar",
    "static_ratio": "1",
    "stribeck_speed": "m/s",
    "bristle_stiffness": "N/m",
    "viscous": "N s/m",
}
LEAST = np.array([0.1, 0.0, 1.0, 1e-3, 1e3, 0.0])
MOST = np.array([40.0, 5.0, 3.0, 0.2, 5e5, 300.0])
SCALE = np.array([5.0, 0.5, 0.3, 0.01, 2e4, 30.0])
STARTS = ((5.0, 0.5, 1.2, 0.01, 2e4, 10.0), (8.0, 0.2, 1.05, 0.05, 8e3, 10.0))
DAMPING, BREAKAWAY = 150.0, 0.7
"""N s/m and the fraction of ``Friction``: these motions are too slow to tell either."""


def file_of(data: Path, seal: str, bar: int) -> Path:
    """The log of a seal at a nominal gauge pressure."""
    return data / FOLDER / f"{seal}_{bar}bar.csv"


def motion(file: Path) -> Array:
    """Speed (m/s), gauge pressure (bar) and friction with an offset (N) every ``PERIOD``, (3, T)."""
    table = read_table("--data", file)
    time, *measured = (table.column(name)[SETTLED:] for name in ("time", "laser_mm", "pressure_bar_gauge", "force"))
    even = np.arange(time[0], time[-1], 1e3 * PERIOD)
    place, pressure, force = (np.interp(even, time, one) for one in measured)
    smooth = savgol_filter(1e-3 * place, WINDOW, 2)
    speed = savgol_filter(smooth, WINDOW, 2, deriv=1, delta=PERIOD)
    return np.stack([speed, pressure, force - 1e5 * AREA * pressure])


@kernel
def _driven(moved: Array, numbers: Array, lugre: bool, found: Array) -> None:
    deflection, steepness = 0.0, 1.0 / (1.0 - BREAKAWAY)
    for k in range(moved.shape[1]):
        speed, rate = moved[SPEED, k], 0.0
        coulomb = friction.pressed_level(numbers[F0], numbers[PER_BAR], moved[PRESSURE, k], 0.0, 0.0)
        weakness = friction.inverse_level(speed, coulomb, numbers[RATIO] * coulomb, numbers[STRIBECK])
        for _ in range(SUBSTEPS):
            rate = friction.bristle_rate_by_law(speed, deflection, weakness, numbers[STIFFNESS], lugre, BREAKAWAY, steepness)
            deflection += rate * PERIOD / SUBSTEPS
        found[k] = friction.lugre_force(speed, deflection, rate, numbers[STIFFNESS], DAMPING, numbers[VISCOUS])


def driven(moved: Array, numbers: Array, lugre: bool = True) -> Array:
    """Friction (N) at every sample of ``motion``, of parameters in the order of ``NAMES``, (T,)."""
    found = np.empty(moved.shape[1])
    _driven(moved, np.ascontiguousarray(numbers, dtype=float), lugre, found)
    return found


def errors(numbers: Array, moved: list[Array], lugre: bool = True) -> list[Array]:
    """Measured less modelled friction of each motion, N, less its median, which holds the offsets of both sensors."""
    left = (one[FORCE] - driven(one, numbers, lugre) for one in moved)
    return [one - np.median(one) for one in left]


def fitted(moved: list[Array], by_pressure: bool, lugre: bool = True) -> Array:
    """Parameters of the least robust sum of squares (soft L1 at 1 N), in the order of ``NAMES``; without ``by_pressure`` one
    level holds at all pressures."""
    free = np.array([by_pressure or name != "per_bar" for name in NAMES])

    def whole(part: Array) -> Array:
        numbers = np.zeros(len(NAMES))
        numbers[free] = part
        return numbers

    tried = [
        least_squares(
            lambda part: np.concatenate(errors(whole(part), moved, lugre)),
            np.array(start)[free],
            bounds=(LEAST[free], MOST[free]),
            x_scale=SCALE[free],
            max_nfev=60,
            loss="soft_l1",
        )
        for start in STARTS
    ]
    return whole(min(tried, key=lambda one: one.cost).x)


def level(moved: Array) -> float:
    """Friction of sliding, N: half the difference of both directions' medians, from which offsets drop out."""
    speed, force = moved[SPEED], moved[FORCE]
    return 0.5 * float(np.median(force[speed > SLIDING]) - np.median(force[speed < -SLIDING]))


def _rms(left: list[Array]) -> list[float]:
    return [float(np.sqrt(np.mean(one * one))) for one in left]


def measure(data: str, seal: str, files: dict[str, str]) -> Result:
    """One seal: its levels, and what each model leaves of its friction at each pressure, RMS N.

    ``files`` are the hashes of its logs, so that other data are measured anew. A pressure is ``foretold`` by parameters that
    were fitted to the other three.
    """
    moved = [motion(file_of(Path(data), seal, bar)) for bar in BARS]
    models = dict[str, Any]()
    for law, lugre in LAWS.items():
        others = [[one for one in moved if one is not left] for left in moved]
        models[law] = {
            "own": [_rms(errors(fitted([one], False, lugre), [one], lugre))[0] for one in moved],
            "one_level": _rms(errors(fitted(moved, False, lugre), moved, lugre)),
            "foretold": [
                _rms(errors(fitted(three, True, lugre), [one], lugre))[0] for three, one in zip(others, moved, strict=True)
            ],
        }
        numbers = fitted(moved, True, lugre)
        models[law]["by_pressure"] = _rms(errors(numbers, moved, lugre))
        models[law]["parameters"] = dict(zip(NAMES, numbers, strict=True))
    speeds = [float(np.quantile(np.abs(one[SPEED]), 0.99)) for one in moved]
    return {"levels": [level(one) for one in moved], "models": models, "fastest": max(speeds), "files": files}
