"""Which columns of a laboratory's log are which: by name, by unit, or as the user maps them; nothing is left out silently."""

import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from baselines.logs.log import Column
from baselines.logs.table import read_table
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.values import in_line
from birthsim_env.tables.headings import is_like_force
from birthsim_env.tables.selection import NOTHING, Mapped, Selection, clock_note, mapping_of
from birthsim_env.tables.table import Reading, Table

CHAMBERS = ("P1", "N1", "P2", "N2")
OPENINGS = tuple(f"openings_{chamber}" for chamber in CHAMBERS)
PRESSURES = tuple(f"pressures_{chamber}" for chamber in CHAMBERS)
POSITIONS = ("position_x", "position_y")
FORCES = ("force_x", "force_y")
COLUMNS = {
    "time": Column("s", "time; rows are evenly spaced"),
    **{name: Column("1", "opening commanded of the chamber's valve, -1 to 1, held until the next row") for name in OPENINGS},
    **{name: Column("Pa", "absolute pressure of the chamber") for name in PRESSURES},
    **{name: Column("m", "position of the end effector, as the tracker last showed it") for name in POSITIONS},
    **{name: Column("N", "force of the hand on the end effector; 0 where there is none") for name in FORCES},
}
"""What a log holds; forces may be missing."""

PISTONS = ("piston_y1", "piston_y2")
"""Positions of both pistons from mid stroke, m, by encoders: they may stand in place of ``POSITIONS``."""

COUNTED_COLUMNS = {
    (PISTONS[POSITIONS.index(name)] if name in POSITIONS else name): (
        Column("m", "position of the piston from mid stroke, as its encoder counts") if name in POSITIONS else column
    )
    for name, column in COLUMNS.items()
}
"""What a log of a simulated rig with encoders holds."""

UNITS = {name: column.unit for name, column in COLUMNS.items()}
COUNTED = {name: unit for name, unit in UNITS.items() if name not in POSITIONS} | dict.fromkeys(PISTONS, "m")
"""What is read of a log of a rig with encoders."""
NEEDED = tuple(name for name in COLUMNS if name not in FORCES)

RECORDED = ("scenario_force", "drag_force")
"""Columns of a recording that together are the force of the hand."""

OTHERS = "--columns NAME=COLUMN,... for other names, and NAME=none for a force that was not measured"


@dataclass(frozen=True)
class LogOptions:
    """How a log is read: ``columns`` maps (``force_x=Fz,force_y=Fy``), ``skip`` lines before the heading, decimal commas."""

    columns: str = ""
    skip: int | None = None
    decimal_comma: bool = False


def read_columns(path: Path, options: LogOptions) -> tuple[str, dict[str, Array]]:
    """The file as errors name it, and the columns ``UNITS`` or ``COUNTED`` of a log (T,) in SI; forces are 0 where it has none.

    Warns of what is not used, and of a log without forces. ``ValueError`` names what is missing, or cannot be used.
    """
    counted = any(name in options.columns for name in PISTONS)
    mapping = mapping_of("--columns ", options.columns, list(COUNTED if counted else UNITS)) if options.columns else {}
    for name, asked in mapping.items():
        if asked.column == NOTHING and name not in FORCES:
            raise ValueError(f"--columns {name}={NOTHING}; allowed: a column, and {NOTHING} for {', '.join(FORCES)} only")
    table = headed_table(path, options, mapping, NEEDED)
    pairs = {name: [f"{name}_{axis}" for axis in "xy"] for name in RECORDED}
    recorded = {column: "N" for pair in pairs.values() for column in pair if set(pair) <= set(table.columns)}
    units = UNITS
    chosen = Selection(table, units, mapping, OTHERS)
    if counted or (not any(name in chosen.used for name in POSITIONS) and set(PISTONS) <= set(table.columns)):
        units = COUNTED
        chosen = Selection(table, units, mapping, OTHERS)
    elif set(PISTONS) <= set(table.columns):
        units = UNITS | COUNTED  # a tracker and encoders
        chosen = Selection(table, units, mapping, OTHERS)
    if not any(name in chosen.used or name in mapping for name in FORCES):
        chosen = Selection(table, units | recorded, mapping, OTHERS)
    needed = [name for name in units if name not in FORCES]
    chosen.check(needed)
    found = {name: chosen.values(name) for name in needed}
    check_counts(chosen, found["time"])
    forces, note = _forces(chosen, mapping, recorded)
    for words in (*table.notes, chosen.note(), clock_note(chosen), note):
        if words:
            warnings.warn(words, stacklevel=3)
    return table.source, found | dict(zip(FORCES, forces, strict=True))


def headed_table(path: Path, options: LogOptions, mapping: Mapping[str, Mapped], needed: Iterable[str]) -> Table:
    """The table of a log; ``ValueError`` for one without a heading."""
    named = frozenset(one.column for one in mapping.values())
    table = read_table(path, Reading(options.skip, options.decimal_comma, named, has_options=True))
    if not table.headed:
        raise ValueError(f"{table.source} has no heading; allowed: a line that names {', '.join(needed)}, then numbers")
    return table


def check_counts(chosen: Selection, times: Array) -> None:
    """``ValueError`` for times that are row numbers."""
    counts = len(times) > 1 and times[0] in (0, 1) and bool((np.diff(times) == 1).all())
    if not chosen.table.units.get(chosen.used["time"]) and counts:
        raise ValueError(
            f"{chosen.table.source} has a row every 1 s; allowed: a row every 0.25 to 10 ms, as often as the valves are "
            "commanded; it looks like ms, allowed: s, or time (ms) as the heading; or like row numbers, which are no times"
        )


def _forces(chosen: Selection, mapping: dict[str, Mapped], recorded: Iterable[str]) -> tuple[Array, str]:
    """The force of the hand (2, T), and what there is to say where no column is one."""
    none = np.zeros(chosen.table.rows)
    if any(name in chosen.used or name in mapping for name in FORCES):
        chosen.check(name for name in FORCES if mapping.get(name) != Mapped(NOTHING))
        return np.array([chosen.values(name) if name in chosen.used else none for name in FORCES]), ""
    if recorded:
        axes = [[chosen.values(one) for one in recorded if one.endswith(axis)] for axis in ("_x", "_y")]
        return np.sum(axes, axis=1), ""
    source, units = chosen.table.source, chosen.table.units
    like = [name for name in chosen.unused if is_like_force(name, units.get(name, ""))]
    if like:
        raise ValueError(
            f"{source} lacks {', '.join(FORCES)}, but {in_line(', '.join(like))} may be a force; allowed: --columns "
            f"force_x=COLUMN,force_y=COLUMN, or force_x={NOTHING},force_y={NOTHING} where nobody touches the rig"
        )
    apart = [name for name in chosen.table.elsewhere if is_like_force(name, "")]
    if apart:
        raise ValueError(
            f"{source} lacks {', '.join(FORCES)}, but {in_line(', '.join(apart))}, which is not read, may be a force; allowed: "
            f"all columns in one channel, or --columns force_x={NOTHING},force_y={NOTHING} where nobody touches the rig"
        )
    return np.array([none, none]), f"{source} has no force; it is taken as 0, as where nobody touches the rig"
