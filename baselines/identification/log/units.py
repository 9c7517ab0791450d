"""What is wrong with a whole signal of a log: its unit, its sign, its column, a sensor that shows nothing.

Each check guesses from what most rows hold, so that a few odd ones neither hide nor feign a wrong unit.
"""

from collections.abc import Sequence

import numpy as np
from scipy.signal import lfilter

from baselines.identification.log.faults import Mask
from baselines.identification.log.log_columns import CHAMBERS, POSITIONS
from baselines.identification.log.timing import MOST
from baselines.identification.log.trial import runs
from birthsim_env.physics.compiled.lanes import Array, Rig, parameter_column
from birthsim_env.physics.linkage.inverse_kinematics import pistons_at
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.topology import Topology

OUTSIDE = 0.005
"""m that a noisy position may lie outside of the workspace."""

OVER = 1e-3
"""By which an opening may exceed 1: converters round."""

TYPICAL = 0.01
"""Fraction of the largest openings that do not tell the unit."""

LASTING = 3
"""Rows for which a signal in another unit is out of its range at a time; a spike is shorter."""

LAG, SLOW = 0.005, 0.03
"""s by which pressures follow openings, and over which their changes are compared; assumed."""

FOLLOWS, LOOSE = 0.6, 0.3
"""Correlations of a pressure's rate with the opening that makes it, at least, and with another one, at most; 0.77 to 0.97, and
-0.75 to 0.2, in logs of simulated rigs."""

CELLS = {"MPa": 1.0, "bar": 20.0, "psi": 100.0, "kPa": 2e3, "mbar": 1e4}
"""Unit -> up to which a usual absolute pressure has less in it."""

LENGTHS = {"mm": 1e-3, "cm": 1e-2, "inches": 0.0254}
"""Unit -> m."""


def check_openings(source: str, openings: Array) -> None:
    """Refuse openings (4, T) in V or percent."""
    sizes = np.abs(openings[np.isfinite(openings)])
    beyond = np.abs(np.nan_to_num(openings, posinf=0.0, neginf=0.0)) > 1 + OVER
    share = beyond.mean(axis=1).max()
    lengths = np.concatenate([np.diff(runs(row), axis=0)[0] for row in beyond])
    if share > MOST or (share > TYPICAL / 2 and np.median(lengths) > LASTING):
        most = float(np.quantile(sizes, 1 - TYPICAL))
        volts = "V: --columns NAME=COLUMN*0.2-1 where 5 V is shut and 10 V is open, COLUMN*0.1 where 0 V is shut"
        like = volts if most <= 10.5 else "percent: an opening is percent / 100" if most <= 101 else "numbers of a converter"
        raise ValueError(f"{source} has openings up to {most:.4g}; allowed: -1 to 1, 0 is shut; they look like {like}")


def check_pressures(source: str, name: str, pressures: Array, atmosphere: float) -> None:
    """Refuse pressures (T,) of a cell in another unit than Pa."""
    usual = float(np.median(pressures[np.isfinite(pressures)]))
    if abs(usual) < 0.3 * atmosphere:
        like = next((unit for unit, least in CELLS.items() if abs(usual) < least), "gauge pressures")
        words = f"{f'they look like {like}, ' if usual else ''}allowed: absolute pressures in Pa"
        raise ValueError(f"{source} has {name} about {usual:.4g}; {words}")


def check_positions(source: str, positions: Array, rig: Parameters) -> None:
    """Refuse positions (2, T) in another unit than m, and such with x and y exchanged."""
    known = positions[:, np.isfinite(positions).all(axis=0)]
    usual, middle = float(np.median(np.hypot(*known))), rig.geometry.k2
    if usual > 10 * middle:
        like = min(LENGTHS, key=lambda unit: abs(np.log(usual * LENGTHS[unit] / middle)))
        raise ValueError(f"{source} has positions about {usual:.4g} from the pivot; they look like {like}, allowed: m")
    if inside(known, rig).mean() < 0.5 < 0.9 < inside(known[::-1], rig).mean():
        raise ValueError(f"{source}: position_x and position_y look exchanged; allowed: positions within the workspace")


def inside(positions: Array, rig: Parameters) -> Mask:
    """Whether finite positions (2, T), moved by ``OUTSIDE`` at most towards the middle, are within the workspace (T,)."""
    away = np.array([[rig.geometry.k2], [0.0]]) - positions
    x, y = positions + away * np.minimum(1.0, OUTSIDE / np.maximum(np.hypot(*away), 1e-12))
    near = (np.hypot(x, y) > 1e-9) & (np.hypot(x, y) < 1e6)
    # A motion at 1 rad/s about the pivot: the sign of cylinder 1's speed tells on which branch the linkage is.
    motion = np.where(near, [x, y, -y, x], [[1.0], [0.0], [0.0], [1.0]])
    joints = np.empty_like(motion)
    pistons_at(motion, Rig(parameter_column(rig)), joints)
    first, second = 0.5 * rig.cylinder1.stroke + 1e-12, 0.5 * rig.cylinder2.stroke + 1e-12
    return np.asarray(near & (np.abs(joints[0]) <= first) & (np.abs(joints[1]) <= second) & (joints[2] < 0))


def moved_along(positions: Array, rig: Parameters) -> tuple[tuple[str, ...], Array]:
    """Names and values of the axes (2, T) along which a rig moves; of a rail the one along it, (1, T)."""
    if not rig.linkage.is_rail:
        return POSITIONS, positions
    return ("position",), np.hypot(*positions)[None]


def check_moving(source: str, names: Sequence[str], values: Array, allowed: str) -> None:
    """Refuse signals (C, T), NaN where they are left out, that show one value only."""
    still = [name for name, row in zip(names, values, strict=True) if not np.nanmin(row) < np.nanmax(row)]
    if still:
        raise ValueError(f"{source}: {', '.join(still)} never changes; allowed: {allowed}")


def check_exchanged(source: str, topology: Topology, openings: Array, pressures: Array, period: float) -> None:
    """Refuse pressures (4, T) that follow the valve of another chamber, or their own the wrong way round."""
    found = _correlations(openings, pressures, period)
    names = [topology.name_of(chamber) for chamber in CHAMBERS]
    for k in topology.chambers:
        row = found[k]
        other, words = int(np.argmax(row)), ""
        if np.argmax(np.abs(row)) == k and row[k] < -FOLLOWS:
            words = f"pressures_{names[k]} falls where openings_{names[k]} is above 0"
        elif row[other] > FOLLOWS and row[k] < LOOSE:
            words = f"pressures_{names[k]} follows openings_{names[other]}; columns look exchanged"
        if words:
            allowed = "an opening above 0 fills the chamber of its own column, below 0 empties it"
            raise ValueError(f"{source}: {words}; allowed: {allowed}")


def _correlations(openings: Array, pressures: Array, period: float) -> Array:
    """Of the rate of each pressure (rows) with each opening (columns), both without what changes slowly."""
    kept, short, long = np.exp(-period / LAG), max(2, round(LAG / period)), max(3, round(SLOW / period))
    rates = pressures[:, short:] - pressures[:, :-short]
    followed = lfilter([1.0 - kept], [1.0, -kept], openings, axis=1)[:, short // 2 :][:, : rates.shape[1]]
    quick = [values[:, long:] - values[:, :-long] for values in (rates, followed)]
    rates, followed = (values - values.mean(axis=1, keepdims=True) for values in quick)
    sizes = np.outer(np.linalg.norm(rates, axis=1), np.linalg.norm(followed, axis=1))
    return np.asarray(rates @ followed.T / np.maximum(sizes, 1e-300))
