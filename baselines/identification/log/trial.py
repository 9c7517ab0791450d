"""What a log holds of an experiment, as arrays."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.topology import TOPOLOGIES, TWO_CYLINDERS, Topology

TRACKER, ENCODERS = "electronics.position_latency", "electronics.encoder_latency"
"""How late a position is, of a tracker and of encoders."""


@dataclass(frozen=True)
class Trial:
    """T rows, one a period, SI units: ``times`` (T,); ``openings`` (4, T), each held until the next row; absolute
    ``pressures`` (4, T) of chambers P1, N1, P2, N2; ``positions`` (2, T) of the end effector as the log shows them, repeated
    until the tracker's next sample arrives; ``forces`` (2, T) of the hand.

    Pressures and positions are NaN where they were not measured. Openings and forces move the simulated rig and are always
    numbers; where the log lacks them for so long that they cannot be bridged, ``unknown`` (T,) is True. ``notes`` say in a
    line each what of the log was left out. Where encoders have counted the positions, ``counted`` (2,) is how well their zeros
    are known before, m, and positions are those at which the linkage ends.

    A rail, whose ``topology`` says so, has no openings and no pressures of cylinder 1: 0 and NaN.
    """

    times: Array
    openings: Array
    pressures: Array
    positions: Array
    forces: Array
    unknown: NDArray[np.bool_] | None = None
    notes: tuple[str, ...] = ()
    counted: Array | None = None
    topology: Topology = TOPOLOGIES[TWO_CYLINDERS]

    @property
    def axes(self) -> int:
        """Along how many axes positions have noise."""
        return len(self.topology.cylinders)

    @property
    def latency(self) -> str:
        """The parameter that says how late positions are."""
        return TRACKER if self.counted is None else ENCODERS

    @property
    def period(self) -> float:
        """s from row to row."""
        return float((self.times[-1] - self.times[0]) / (len(self.times) - 1))


def fresh_rows(positions: Array) -> NDArray[np.intp]:
    """Rows at which a sample of ``positions`` (2, T) has newly arrived: it is another than in the row before.

    After a row that is NaN the time of arrival is not known, so that such a sample is not fresh.
    """
    known = numbers(positions)
    changed = np.any(np.diff(positions, axis=1) != 0, axis=0)
    return np.flatnonzero(changed & known[1:] & known[:-1]) + 1


def numbers(values: Array) -> NDArray[np.bool_]:
    """Columns (T,) of values (C, T) that are finite."""
    return np.asarray(np.isfinite(values).all(axis=0))


def bridged(values: Array) -> Array:
    """Values (C, T) with straight lines across what is NaN; a row without any number is 0."""
    found, rows = values.copy(), np.arange(values.shape[1])
    for row in found:
        known = np.isfinite(row)
        if not known.all():
            row[~known] = np.interp(rows[~known], rows[known], row[known]) if known.any() else 0.0
    return found


def runs(mask: NDArray[np.bool_]) -> NDArray[np.intp]:
    """First row and the row after the last (2, R) of every run of True in ``mask`` (T,)."""
    edges = np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8))
    return np.array([np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)])


def long_runs(mask: NDArray[np.bool_], least: int) -> NDArray[np.bool_]:
    """``mask`` (T,) without its runs of fewer than ``least`` rows."""
    found = np.zeros_like(mask)
    for first, last in runs(mask).T:
        if last - first >= least:
            found[first:last] = True
    return found
