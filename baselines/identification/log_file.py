"""Trials as files: what a laboratory's log must hold, what is wrong with one that does not, and logs of simulated rigs."""

from pathlib import Path

import numpy as np

from baselines.identification.log_columns import COLUMNS, FORCES, OPENINGS, POSITIONS, PRESSURES, LogOptions, read_columns
from baselines.identification.trial import Trial
from baselines.logs.log import Log, Series
from baselines.logs.writing import WRITERS, write_log
from birthsim_env.files import write_text
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.geometry import inverse_geometry
from birthsim_env.physics.rig.parameters import Parameters

SHORTEST = 2.0
"""s of a log."""

LONGEST_PERIOD, SHORTEST_PERIOD = 0.0101, 0.00024
"""s from row to row: those of control boards, with some room."""

UNEVEN = 0.5
"""Fraction of a period by which a row may be early or late."""

FEWEST = 50
"""Samples of the tracker that tell anything of motion."""

OUTSIDE = 0.005
"""m that a noisy position may lie outside of the workspace."""


def read_trial(path: Path, rig: Parameters, options: LogOptions = LogOptions()) -> Trial:  # noqa: B008  frozen
    """The trial that a log holds; ``rig`` gives the workspace and the atmosphere. ``ValueError`` in one line for a bad log."""
    source, rows = read_columns(path, options)
    for name, values in rows.items():
        _check_finite(source, name, values)
    _check_times(source, rows["time"])
    groups = (OPENINGS, PRESSURES, POSITIONS, FORCES)
    openings, pressures, positions, forces = (np.array([rows[name] for name in group]) for group in groups)
    _check_openings(source, openings)
    _check_pressures(source, pressures, rig)
    _check_positions(source, positions, rig)
    even = np.linspace(rows["time"][0], rows["time"][-1], len(rows["time"]))
    return Trial(even, openings, pressures, positions, forces)


def _check_finite(source: str, name: str, values: Array) -> None:
    if not np.isfinite(values).all():
        row = int(np.argmin(np.isfinite(values)))
        raise ValueError(f"{source}, row {row}: {name} = {values[row]:g}; allowed: finite numbers in every row")


def _check_times(source: str, times: Array) -> None:
    steps = np.diff(times)
    if len(times) < 2:
        raise ValueError(f"{source} has {len(times)} rows; allowed: at least {SHORTEST:g} s of them")
    if not (steps > 0).all():
        row = int(np.argmax(~(steps > 0))) + 1
        raise ValueError(f"{source}, row {row}: time {times[row]:.9g} after {times[row - 1]:.9g}; allowed: increasing times")
    period = float(np.median(steps))
    if not SHORTEST_PERIOD <= period <= LONGEST_PERIOD:
        units = {"ms": 1e-3, "us": 1e-6, "ns": 1e-9}
        like = [unit for unit, size in units.items() if SHORTEST_PERIOD <= period * size <= LONGEST_PERIOD]
        guess = f"; it looks like {like[0]}, allowed: s" if like else ""
        words = f"allowed: a row every 0.25 to 10 ms, as often as the valves are commanded{guess}"
        raise ValueError(f"{source} has a row every {period:.4g} s; {words}")
    if times[-1] - times[0] < SHORTEST:
        raise ValueError(f"{source} holds {times[-1] - times[0]:.3g} s; allowed: at least {SHORTEST:g} s")
    even = np.linspace(times[0], times[-1], len(times))
    off = np.abs(times - even)
    uneven = np.abs(steps - period) > UNEVEN * period
    if uneven.any() or off.max() > 2 * period:
        row = int(np.argmax(uneven)) + 1 if uneven.any() else int(np.argmax(off))
        words = f"{1e3 * steps[row - 1]:.3g} ms after the row before, others {1e3 * period:.3g} ms"
        raise ValueError(f"{source}, row {row}: {words}; allowed: evenly spaced rows, up to half a period early or late")


def _check_openings(source: str, openings: Array) -> None:
    most = np.abs(openings).max()
    if most > 1 + 1e-9:
        like = "V" if most <= 10 else "percent"
        raise ValueError(
            f"{source} has openings up to {most:g}; allowed: -1 to 1, 0 is shut; they look like {like}: an opening is "
            f"{'(V - 5) / 5 where 5 V is shut' if like == 'V' else 'percent / 100'}"
        )
    still = [name for name, values in zip(OPENINGS, openings, strict=True) if np.ptp(values) == 0]
    if still:
        raise ValueError(
            f"{source}: {', '.join(still)} never changes; allowed: valves that move, as in birthsim identify --propose"
        )


def _check_pressures(source: str, pressures: Array, rig: Parameters) -> None:
    atmosphere, supply, most = rig.air.atmospheric_pressure, rig.air.supply_pressure, float(np.median(pressures))
    if most < 0.3 * atmosphere:
        like = "bar" if most < 20 else "kPa" if most < 2000 else "gauge pressures"
        raise ValueError(f"{source} has pressures about {most:.4g}; they look like {like}, allowed: absolute pressures in Pa")
    low, high = float(np.quantile(pressures, 0.001)), float(np.quantile(pressures, 0.999))
    if low < 0.8 * atmosphere:
        words = f"they look like gauge pressures, allowed: absolute pressures in Pa, {atmosphere:g} or more"
        raise ValueError(f"{source} has pressures down to {low:.4g} Pa; {words}")
    if high > 1.1 * supply:
        words = f"the rig's air.supply_pressure is {supply:g} Pa; allowed: a rig (--parameters) with the laboratory's supply"
        raise ValueError(f"{source} has pressures up to {high:.4g} Pa; {words}")
    still = [name for name, values in zip(PRESSURES, pressures, strict=True) if np.ptp(values) == 0]
    if still:
        raise ValueError(f"{source}: {', '.join(still)} never changes; allowed: measured pressures")


def _check_positions(source: str, positions: Array, rig: Parameters) -> None:
    largest = float(np.median(np.hypot(*positions)))
    g, half = rig.geometry, 0.5 * rig.cylinder2.stroke
    if largest > 20 * (g.k2 + half):
        raise ValueError(f"{source} has positions about {largest:.4g} from the pivot; they look like mm, allowed: m")
    if (np.ptp(positions, axis=1) == 0).all():
        raise ValueError(f"{source}: the position never changes; allowed: a log of a rig that moves")
    samples = int(np.any(np.diff(positions, axis=1) != 0, axis=0).sum())
    if samples < FEWEST:
        raise ValueError(f"{source}: the position changes {samples} times; allowed: at least {FEWEST} samples of the tracker")
    for row in range(0, positions.shape[1], max(1, positions.shape[1] // 2000)):
        try:
            inverse_geometry(_towards_the_middle(positions[:, row], rig), rig)
        except ValueError as error:
            raise ValueError(f"{source}, row {row}: {error} (geometry of the rig, origin at the pivot of cylinder 2)") from None


def _towards_the_middle(position: Array, rig: Parameters) -> Array:
    """A position moved by ``OUTSIDE`` at most towards the middle of the workspace, so that noise does not put it outside."""
    away = np.array([rig.geometry.k2, 0.0]) - position
    return np.asarray(position + away * min(1.0, OUTSIDE / max(float(np.hypot(*away)), 1e-12)))


def write_trial(trial: Trial, path: Path, rig: Parameters) -> None:
    """Write a trial of a simulated ``rig`` to a file .csv, .parquet or .mcap."""
    rows = np.vstack([trial.times, trial.openings, trial.pressures, trial.positions, trial.forces])
    suffix = path.suffix.lower()
    if suffix == ".csv":
        lines = [",".join(COLUMNS), *(",".join(f"{value:.10g}" for value in row) for row in rows.T)]
        write_text(path, "\n".join(lines) + "\n")
    elif suffix in WRITERS:
        values = dict(zip(COLUMNS, map(np.ascontiguousarray, rows), strict=True))
        write_log(Log(dict(COLUMNS), [Series("/rig", trial.times, values)], [], {"rig": rig.to_dict()}), path)
    else:
        raise ValueError(f"--out {str(path)!r}; allowed: a file that ends in .csv, {', '.join(WRITERS)}")
