"""Trials as files: what a laboratory's log must hold, what is wrong with one that does not, and logs of simulated rigs."""

from pathlib import Path

import numpy as np

from baselines.identification.log.log_columns import (
    COLUMNS,
    COUNTED_COLUMNS,
    FORCES,
    OPENINGS,
    PISTONS,
    POSITIONS,
    PRESSURES,
    LogOptions,
    read_columns,
)
from baselines.identification.log.rail_log import RAIL_COLUMNS, rail_rows, read_rail
from baselines.identification.log.rows import checked_trial
from baselines.identification.log.trial import Trial
from baselines.identification.windows.encoders import zeros_by_tracker
from baselines.logs.log import Log, Series
from baselines.logs.writing import WRITERS, write_log
from birthsim_env.files import write_text
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage.geometry import end_effector, inverse_geometry
from birthsim_env.physics.rig.parameters import Parameters


def read_trial(path: Path, rig: Parameters, options: LogOptions = LogOptions()) -> Trial:  # noqa: B008  frozen
    """The trial that a log holds; ``rig`` gives the workspace and the atmosphere. ``ValueError`` in one line for a bad log."""
    if rig.linkage.is_rail:
        source, found = read_rail(path, options, rig)
        return checked_trial(source, found, rig)
    source, rows = read_columns(path, options)
    groups = (OPENINGS, PRESSURES, FORCES)
    openings, pressures, forces = (np.array([rows[name] for name in group]) for group in groups)
    positions, known, notes = np.array([rows[name] for name in POSITIONS if name in rows]), None, tuple[str, ...]()
    if PISTONS[0] in rows:
        pistons = np.array([rows[name] for name in PISTONS])
        ends, known = _ends(source, pistons, rig), np.full(2, rig.electronics.encoder_offset)
        if len(positions):
            zeros = zeros_by_tracker(rows["time"], pistons, positions, rig)
            known, notes = zeros.deviation, (zeros.words(),)
            ends = _ends(source, pistons - zeros.offset[:, None], rig)
        positions = ends
    trial = Trial(rows["time"], openings, pressures, positions, forces, notes=notes, counted=known)
    return checked_trial(source, trial, rig)


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
    columns, places = COLUMNS, trial.positions
    if rig.linkage.is_rail:
        columns, rows = RAIL_COLUMNS, rail_rows(trial, rig)
    elif trial.counted is not None:
        columns, places = COUNTED_COLUMNS, inverse_geometry(np.ascontiguousarray(places), rig)
    if not rig.linkage.is_rail:
        rows = np.vstack([trial.times, trial.openings, trial.pressures, places, trial.forces])
    suffix = path.suffix.lower()
    if suffix == ".csv":
        lines = [",".join(columns), *(",".join(f"{value:.10g}" for value in row) for row in rows.T)]
        write_text(path, "\n".join(lines) + "\n")
    elif suffix in WRITERS:
        values = dict(zip(columns, map(np.ascontiguousarray, rows), strict=True))
        write_log(Log(dict(columns), [Series("/rig", trial.times, values)], [], {"rig": rig.to_dict()}), path)
    else:
        raise ValueError(f"--out {str(path)!r}; allowed: a file that ends in .csv, {', '.join(WRITERS)}")
