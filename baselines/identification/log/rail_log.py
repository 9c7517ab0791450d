"""The log of one cylinder on a rail: its columns, and the trial that stands for it, in which cylinder 1 is locked."""

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np

from baselines.identification.log.log_columns import LogOptions, check_counts, headed_table
from baselines.identification.log.trial import Trial
from baselines.logs.log import Column
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.tables.selection import NOTHING, SCALED, Mapped, Selection, clock_note, mapping_of

VALVES, CELLS = ("openings_P", "openings_N"), ("pressures_P", "pressures_N")

RAIL_COLUMNS = {
    "time": Column("s", "time; rows are evenly spaced"),
    **{name: Column("1", "opening commanded of the chamber's valve, -1 to 1, held until the next row") for name in VALVES},
    **{name: Column("Pa", "absolute pressure of the chamber") for name in CELLS},
    "position": Column("m", "position of the rod from mid stroke, positive as it extends, as its encoder counts"),
    "force": Column("N", "force of the hand along the rail, positive as the rod extends; 0 where there is none"),
}
"""What a log of a simulated rail holds; the force may be missing."""

ONE_VALVE = "opening"
"""Column that may stand in place of ``VALVES``: that of one 5/3 valve, which gives chamber N the opposite."""

UNITS = {name: column.unit for name, column in RAIL_COLUMNS.items()} | {ONE_VALVE: "1"}

NEEDS = (
    f"one cylinder's log has time, position (m from mid stroke), {' and '.join(VALVES)} or {ONE_VALVE} of one 5/3 valve, "
    f"{' and '.join(CELLS)}, and force where a hand pushes; --columns NAME=COLUMN,... for other names, and "
    f"NAME={SCALED} for volts: {ONE_VALVE}=u*0.2-1 where 5 V is shut and 10 V fully open"
)

FURTHER_OUT = 0.02
"""m past the ends of the stroke from which positions are counted from another zero."""


def read_rail(path: Path, options: LogOptions, rig: Parameters) -> tuple[str, Trial]:
    """The file as errors name it, and its trial; ``ValueError`` says what is missing and what one cylinder needs."""
    mapping = mapping_of("--columns ", options.columns, list(UNITS)) if options.columns else {}
    table = headed_table(path, options, mapping, ("time", *VALVES, *CELLS, "position"))
    chosen = Selection(table, UNITS, mapping, NEEDS)
    one_valve = ONE_VALVE in chosen.used and not set(VALVES) & set(chosen.used)
    chosen.check(("time", "position", *((ONE_VALVE,) if one_valve else VALVES), *CELLS))
    times, position = chosen.values("time"), chosen.values("position")
    check_counts(chosen, times)
    openings, pressures = np.zeros((4, len(times))), np.full((4, len(times)), np.nan)
    for k, name in enumerate(VALVES):
        openings[2 + k] = (1 - 2 * k) * chosen.values(ONE_VALVE) if one_valve else chosen.values(name)
    pressures[2:] = [chosen.values(name) for name in CELLS]
    measured = "force" in chosen.used and mapping.get("force") != Mapped(NOTHING)
    force = chosen.values("force") if measured else np.zeros(len(times))
    _check_zero(table.source, position, rig)
    note = "" if measured else f"{table.source} has no force; it is taken as 0, as where nobody touches the rig"
    for words in (*table.notes, chosen.note(), clock_note(chosen), note):
        if words:
            warnings.warn(words, stacklevel=3)
    direction = rail_direction(rig)
    places, forces = (direction[:, None] * one for one in (rig.geometry.k2 + position, force))
    return table.source, on_rail(Trial(times, openings, pressures, places, forces), rig)


def on_rail(trial: Trial, rig: Parameters) -> Trial:
    """A trial as the sensors of a rail have it: the encoder of the rod, and nothing of cylinder 1."""
    openings, pressures = trial.openings.copy(), trial.pressures.copy()
    openings[:2], pressures[:2] = 0.0, np.nan
    direction, counted = rail_direction(rig), np.array([0.0, rig.electronics.encoder_offset])
    along = direction[:, None] * (direction @ trial.positions)
    topology = rig.linkage.topology
    return replace(trial, openings=openings, pressures=pressures, positions=along, counted=counted, topology=topology)


def rail_rows(trial: Trial, rig: Parameters) -> Array:
    """The rows of ``RAIL_COLUMNS``, (7, T)."""
    along, push = (rail_direction(rig) @ one for one in (trial.positions, trial.forces))
    return np.vstack([trial.times, trial.openings[2:], trial.pressures[2:], along - rig.geometry.k2, push])


def rail_direction(rig: Parameters) -> Array:
    """Unit vector (2,) along which the rod of a rail extends."""
    angle = rig.linkage.inclination
    return np.array([np.cos(angle), np.sin(angle)])


def _check_zero(source: str, position: Array, rig: Parameters) -> None:
    """Refuse positions (T,) that are not counted from mid stroke, or in another unit."""
    known, half = position[np.isfinite(position)], rig.cylinder2.stroke / 2
    furthest = float(np.quantile(np.abs(known), 0.99)) if len(known) else 0.0
    if furthest > half + FURTHER_OUT:
        low, high = float(known.min()), float(known.max())
        unit = high - low > 10 * rig.cylinder2.stroke
        like = "like mm" if unit else f"as if they were counted from an end of the stroke: --columns position=COLUMN*1-{half:g}"
        raise ValueError(
            f"{source} has positions of {low:.4g} to {high:.4g}; they look {like}; allowed: m from mid stroke, within "
            f"+-{half:g}, half of cylinder2.stroke (--parameters)"
        )
