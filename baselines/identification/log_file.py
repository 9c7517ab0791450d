"""Trials as files: what a laboratory's log must hold, what is wrong with one that does not, and logs of simulated rigs."""

from pathlib import Path

import numpy as np

from baselines.identification.log_columns import (
    COLUMNS,
    FORCES,
    OPENINGS,
    PISTONS,
    POSITIONS,
    PRESSURES,
    LogOptions,
    read_columns,
)
from baselines.identification.rows import checked_trial
from baselines.identification.trial import Trial
from baselines.logs.log import Log, Series
from baselines.logs.writing import WRITERS, write_log
from birthsim_env.files import write_text
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.geometry import end_effector
from birthsim_env.physics.rig.parameters import Parameters


def read_trial(path: Path, rig: Parameters, options: LogOptions = LogOptions()) -> Trial:  # noqa: B008  frozen
    """The trial that a log holds; ``rig`` gives the workspace and the atmosphere. ``ValueError`` in one line for a bad log."""
    source, rows = read_columns(path, options)
    groups = (OPENINGS, PRESSURES, FORCES)
    openings, pressures, forces = (np.array([rows[name] for name in group]) for group in groups)
    counted = PISTONS[0] in rows
    positions = np.array([rows[name] for name in (PISTONS if counted else POSITIONS)])
    if counted:
        positions = _ends(source, positions, rig)
    return checked_trial(source, Trial(rows["time"], openings, pressures, positions, forces), rig)


def _ends(source: str, pistons: Array, rig: Parameters) -> Array:
    """Where the end effector is (2, T) by the positions of pistons (2, T); NaN where one of these is."""
    known = np.isfinite(pistons).all(axis=0)
    positions = np.full(pistons.shape, np.nan)
    try:
        positions[:, known] = end_effector(pistons[:, known], rig)
    except ValueError as error:
        raise ValueError(f"{source}: {', '.join(PISTONS)} of encoders: {error}") from None
    return positions


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
