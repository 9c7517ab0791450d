"""Every row of every signal of a log, checked before anything is fitted.

A row that no rig makes is left out and named: pressures and positions count as not measured, openings and forces, which move
the simulated rig, are bridged. A log in which a signal has many such rows is refused with the cause of most.
"""

from dataclasses import replace

import numpy as np

from baselines.identification.log.faults import STILL as STANDING
from baselines.identification.log.faults import clipped, held, jumps, pinned, samples_of, spikes, standing, strayed
from baselines.identification.log.log_columns import OPENINGS, PRESSURES
from baselines.identification.log.signals import Signal
from baselines.identification.log.timing import Grid, even_grid
from baselines.identification.log.trial import Trial, bridged, fresh_rows, long_runs, numbers, runs
from baselines.identification.log.units import (
    OVER,
    check_exchanged,
    check_moving,
    check_openings,
    check_positions,
    check_pressures,
    inside,
    moved_along,
)
from baselines.identification.windows.noise import noise_of
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage.geometry import workspace
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.topology import Topology

FEWEST = 50
"""Samples of the tracker that tell anything of motion."""

BELOW, ABOVE = 0.8, 1.1
"""Times the atmosphere and the supply between which cells show pressures."""

QUICKEST = 2e7
"""Pa/s; a choked valve of three times the default conductance fills the least dead volume as quickly."""

LOUDEST = 30.0
"""N by which a force may stand out of both neighbours."""

BEYOND = 1.1
"""Times ``electronics.force_range`` up to which forces are taken for measured."""

SHARE = 0.001
"""Fraction of a signal that may stray from its range before it is refused: noise does so."""

CHANGED = 1e4
"""Pa by which a chamber's pressure changes while the other cell of its cylinder has lost its sensor."""

CLIPPED = 5e3
"""Pa by which a pressure would go beyond the end of a cell's range."""

PUSHED = 1e5
"""Pa by which pressures change while the head no longer stands still."""

STRIDE = 0.02
"""m between two rows of a signal that strays; a tracker's sample after the other is nearer."""

RESTS = 0.5
"""s of rest that are worth a word."""

BRIDGED = 0.005
"""s for which openings and forces are bridged; windows with longer gaps are left out."""


def checked_trial(source: str, raw: Trial, rig: Parameters) -> Trial:
    """The trial of a log as it was read, on an even grid, without what no rig makes; ``notes`` name all that is left out.

    ``source`` names the log in errors, ``rig`` gives workspace, atmosphere, supply, and range of the force sensor.
    ``ValueError`` names what is wrong with the log as a whole, or with more than ``MOST`` of the rows of a signal.
    """
    with np.errstate(all="ignore"):  # 1e308 is a number that a file may hold
        return _checked(even_grid(source, raw.times), raw, rig)


def _checked(grid: Grid, raw: Trial, rig: Parameters) -> Trial:
    source = grid.source
    openings, pressures, positions, forces = map(grid.spread, (raw.openings, raw.pressures, raw.positions, raw.forces))
    grid = _without_repeats(grid, openings, pressures, positions)
    check_openings(source, openings)
    chambers = raw.topology.chambers
    moving, named = list(chambers), [raw.topology.name_of(name) for name in (*OPENINGS, *PRESSURES)]
    valves = [Signal(named[k], openings[k : k + 1], "", grid) for k in chambers]
    for valve in valves:
        valve.take(np.abs(valve.whole[0]) > 1 + OVER, "is no opening", "-1 to 1")
    cells = _cells(grid, pressures, raw.topology, rig)
    tracker = _tracker(grid, positions, bridged(pressures), rig)
    sensor = _sensor(grid, forces, rig)
    driven = [named[k] for k in chambers], openings[moving]
    check_moving(source, *driven, "valves that move, as in birthsim identify --propose")
    check_moving(source, [named[4 + k] for k in chambers], pressures[moving], "measured pressures")
    check_exchanged(source, raw.topology, bridged(openings), bridged(pressures), grid.period)
    lacking = ~numbers(np.concatenate([openings, forces]))
    notes = [*grid.notes, *(note for signal in (*valves, *cells, tracker, sensor) for note in signal.notes())]
    driving, hand = np.clip(bridged(openings), -1, 1), bridged(forces)
    notes += [f"the position stands still from {words}: nothing of that time is used" for words in _rests(grid, positions)]
    if np.ptp(hand, axis=1).max() == 0 and np.any(hand):
        notes.append(f"the force is ({hand[0, 0]:g}, {hand[1, 0]:g}) N in every row, as of a sensor that hangs")
    unknown = long_runs(lacking, int(BRIDGED / grid.period) + 2)
    return Trial(grid.times, driving, pressures, positions, hand, unknown, (*raw.notes, *notes), raw.counted, raw.topology)


def _without_repeats(grid: Grid, *signals: Array) -> Grid:
    """The grid without rows that a logger wrote again and again, in which ``signals`` (C, T) become NaN."""
    every = np.concatenate(signals)
    same = np.append(False, (np.diff(every, axis=1) == 0).all(axis=0))
    same = long_runs(same, int(STANDING / grid.period))
    if not same.any():
        return grid
    for signal in signals:
        signal[:, same] = np.nan
    first, last = runs(same).T[0]
    words = (
        f"the log repeats one row in all its columns, {grid.where(first, last)} ({int(same.sum())} such rows in all); left out"
    )
    kept = ~same[grid.place]
    return replace(grid, rows=grid.rows[kept], place=grid.place[kept], notes=(*grid.notes, words))


def _cells(grid: Grid, pressures: Array, topology: Topology, rig: Parameters) -> list[Signal]:
    """The cells, whose wrong rows of ``pressures`` (4, T) become NaN."""
    low, high = BELOW * rig.air.atmospheric_pressure, ABOVE * rig.air.supply_pressure
    step, gauge = QUICKEST * grid.period, f"absolute pressures of {low:g} Pa or more"
    supplied = f"at most {ABOVE:g} times the rig's air.supply_pressure of {rig.air.supply_pressure:g} Pa (--parameters)"
    cells = [Signal(topology.name_of(PRESSURES[k]), pressures[k : k + 1], "Pa", grid) for k in topology.chambers]
    for cell in cells:
        check_pressures(grid.source, cell.name, cell.values[0], rig.air.atmospheric_pressure)
        for sign, limit, cause, allowed in (
            (-1, low, "looks like a gauge pressure", gauge),
            (1, high, "is above the supply", supplied),
        ):
            beyond = sign * (cell.whole[0] - limit) > 0
            if strayed(beyond, cell.whole, step).mean() > SHARE:
                furthest = sign * float((sign * cell.whole[0]).max())
                cell.refuse(f"{cell.name} {cause} in {int(beyond.sum())} rows, up to {furthest:.4g} Pa; allowed: {allowed}")
            cell.take(beyond, "is below the atmosphere" if sign < 0 else cause, allowed)
        cell.take(spikes(cell.whole[0], step), "jumps and returns", "pressures that air can follow")
        cell.take(clipped(cell.whole[0], CLIPPED), "stays at the end of its range", "a cell that is not saturated")
    whole, rows = bridged(pressures), int(STANDING / grid.period)
    for k, cell in zip(topology.chambers, cells, strict=True):
        cell.take(standing(whole[k], whole[k ^ 1], rows, CHANGED), "stands still", "a cell that measures")
    return cells


def _tracker(grid: Grid, positions: Array, pressures: Array, rig: Parameters) -> Signal:
    """The tracker, whose wrong rows of ``positions`` (2, T) become NaN."""
    tracker = Signal("position", positions, "m", grid)
    check_positions(grid.source, positions, rig)
    outside, allowed = ~inside(tracker.whole, rig), f"{workspace(rig)} (origin at the pivot of cylinder 2)"
    if strayed(outside, tracker.whole, STRIDE).mean() > SHARE:
        first = int(np.argmax(outside))
        x, y = tracker.whole[:, first]
        tracker.refuse(f"position = ({x:.6g}, {y:.6g}) m is unreachable, {grid.where(first, first + 1)}; allowed: {allowed}")
    tracker.take(outside, "is outside of the workspace", allowed)
    _check_samples(grid.source, positions)
    check_moving(grid.source, *moved_along(positions, rig), "a log of a rig that moves")
    noise = noise_of(positions[:, fresh_rows(positions)])
    cut_off = jumps(positions, grid.period, noise)
    tracker.take(cut_off, "is cut off from the other rows by a jump", "positions that a motion leads to")
    tracker.take(pinned(positions), "stays at the end of its range", "a tracker that is not saturated")
    lost = held(positions, pressures, grid.period, PUSHED)
    tracker.take(lost, "stands still while the head moves", "a tracker that measures")
    _check_samples(grid.source, positions)
    return tracker


def _rests(grid: Grid, positions: Array) -> list[str]:
    """Times in words over which the position repeats one sample for longer than ``RESTS``."""
    _, sample = samples_of(positions)
    known = numbers(positions)
    long = np.flatnonzero(np.bincount(sample[known]) * grid.period > RESTS)
    stretches = [grid.times[known & (sample == one)] for one in long]
    return [f"{times[0]:.4g} to {times[-1]:.4g} s" for times in stretches]


def _check_samples(source: str, positions: Array) -> None:
    samples = len(fresh_rows(positions))
    if samples == 0:
        raise ValueError(f"{source}: the position never changes; allowed: a log of a rig that moves")
    if samples < FEWEST:
        raise ValueError(f"{source}: the position changes {samples} times; allowed: at least {FEWEST} samples of the tracker")


def _sensor(grid: Grid, forces: Array, rig: Parameters) -> Signal:
    """The force sensor, whose wrong rows of ``forces`` (2, T) become NaN."""
    sensor, most = Signal("force", forces, "N", grid), BEYOND * rig.electronics.force_range
    allowed = f"at most {BEYOND:g} times the rig's electronics.force_range of {rig.electronics.force_range:g} N"
    sensor.take(np.abs(sensor.whole).max(axis=0) > most, "is too large", allowed)
    out = np.any([spikes(axis, LOUDEST) for axis in sensor.whole], axis=0)
    sensor.take(out, "jumps and returns", "forces that last longer than two rows")
    return sensor
