"""A trial cut into windows: what was measured in each, and a first guess of the state in which each begins.

One long simulation of a rig with friction drifts away from any log. Windows of a fraction of a second, each with a start state
of its own, do not; they are lanes of the plant.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter, savgol_filter

from baselines.identification.fit.budget import Budget
from baselines.identification.log.trial import Trial, bridged, fresh_rows, numbers
from baselines.identification.windows.tracks import admit_rows
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Array, Rig, parameter_column
from birthsim_env.physics.dynamics import coulomb_levels, steps_in
from birthsim_env.physics.linkage.inverse_kinematics import pistons_at
from birthsim_env.physics.pneumatics.spools import are_perfect
from birthsim_env.physics.rig.parameters import Parameters, value_of

LENGTH = 0.25
"""s of a window."""

SMOOTHED = 0.03
"""s on either side of a window's start from which its speed is guessed."""

NEAREST = 5
"""Position samples that are taken at least."""

SETTLED = 0.03
"""s in which the spools forget what their openings were; assumed, some time constants of theirs."""

ENOUGH = 0.5
"""Fraction of the usual measurements that a window needs."""

FREE = (at.Y1, at.V1, at.Y2, at.V2, at.Z1, at.Z2, at.PP1, at.PN1, at.PP2, at.PN2, at.TP1, at.TN1, at.TP2, at.TN2)
"""Rows of the state that a window's start leaves free; the spools follow from the openings before it."""

OF_CYLINDER_1 = (at.Y1, at.V1, at.Z1, at.PP1, at.PN1, at.TP1, at.TN1)
"""Those that stand still on a rail."""

REMEMBER = ("mechanics.mode_frequency",)
"""Options of a rig with states that no log holds at the start of a window."""

SUPPLY, ENDS = at.STATES, tuple(range(at.STATES + 1, at.STATES + 5))
"""Further rows of the state of a rig with options: pressures of the supply and at the valves' ends of the four tubes."""

BRISTLES = (at.Z1, at.Z2)
"""Rows that follow a rig's bristle stiffness, which may be ten times another's, so that bristles carry the same force."""

SPREADS = {
    **dict.fromkeys((at.Y1, at.Y2), 5e-3),
    **dict.fromkeys((at.V1, at.V2), 0.1),
    **dict.fromkeys(BRISTLES, 10.0),
    **dict.fromkeys(at.PRESSURES, 2e4),
    **dict.fromkeys(at.TEMPERATURES, 12.0),
    **dict.fromkeys((SUPPLY, *ENDS), 5e4),
}
"""m, m/s, Pa, K, and N of what bristles carry: standard deviations of a start state about its guess, assumed."""


@dataclass(frozen=True)
class Windows:
    """W windows of K periods of a trial.

    ``starts`` (W,) are rows of the trial. ``arrived`` (W, F) counts the periods from the start to each row at which a position
    sample newly arrived, and ``valid`` (W, F) is False beyond the last. ``pressures`` (W, K, 4) and ``positions`` (W, F, 2) are
    the measurements, ``state`` (S, W) the guess of the start, of which rows ``free`` are sought.
    Residuals count with ``pressure_weights`` (W, K, 4) and
    ``position_weights`` (W, F), which are 0 where nothing was measured. ``budget`` bounds how often they are predicted.
    ``stiffness``, N/m, is that of the bristles whose deflections ``state`` has.
    """

    trial: Trial
    length: int
    starts: NDArray[np.intp]
    arrived: NDArray[np.intp]
    valid: NDArray[np.bool_]
    pressures: Array
    positions: Array
    state: Array
    pressure_weights: Array
    position_weights: Array
    budget: Budget
    free: tuple[int, ...] = FREE
    stiffness: float = 5e4

    @property
    def spread(self) -> Array:
        """Standard deviations (F,) of a start state about its guess."""
        return np.array([SPREADS[row] / (self.stiffness if row in BRISTLES else 1.0) for row in self.free])

    def latency_of(self, rig: Parameters) -> float:
        """s by which positions of a rig arrive late."""
        return late(self.trial, rig)

    def some(self, chosen: NDArray[np.intp] | NDArray[np.bool_]) -> Windows:
        """The windows with the numbers ``chosen``, or where ``chosen`` (W,) is True."""
        return Windows(
            self.trial,
            self.length,
            self.starts[chosen],
            self.arrived[chosen],
            self.valid[chosen],
            self.pressures[chosen],
            self.positions[chosen],
            self.state[:, chosen],
            self.pressure_weights[chosen],
            self.position_weights[chosen],
            self.budget,
            self.free,
            self.stiffness,
        )

    def beginning(self, rows: int) -> Windows:
        """The same windows, of whose measurements the first ``rows`` count."""
        pressure_weights, arrived = self.pressure_weights.copy(), self.arrived < rows
        pressure_weights[:, rows:] = 0.0
        return replace(self, pressure_weights=pressure_weights, position_weights=self.position_weights * arrived)


def check_begins(rig: Parameters, purpose: str) -> None:
    """``ValueError`` for a rig with options that ``REMEMBER``."""
    given = [name for name in REMEMBER if value_of(rig, name)]
    if given:
        raise ValueError(f"{given[0]} = {value_of(rig, given[0])!r}; allowed for {purpose}: 0, {', '.join(REMEMBER)}")


def late(trial: Trial, rig: Parameters) -> float:
    """s by which the positions of a trial arrive late."""
    return float(value_of(rig, trial.latency))


def cut(trial: Trial, rig: Parameters, length: float = LENGTH, budget: Budget | None = None) -> Windows:
    """Windows of a trial, without overlap, for a rig as far as it is known; ``ValueError`` where the log has too many gaps.

    Those are left out in which, or ``SETTLED`` before which, openings or forces are unknown, and those with few measurements.
    """
    period, rows = trial.period, len(trial.times)
    k, margin = max(8, round(length / period)), round(0.1 / period)
    fresh = fresh_rows(trial.positions)
    lag = round(late(trial, rig) / period)
    starts = _measured(trial, np.arange(margin, rows - margin - k, k), k, lag, fresh)
    state = _guess(trial, rig, starts, fresh)
    return windows_at(trial, rig, starts, k, fresh, state, budget or Budget.of(trial))


def windows_at(
    trial: Trial,
    rig: Parameters,
    starts: NDArray[np.intp],
    length: int,
    fresh: NDArray[np.intp],
    state: Array,
    budget: Budget,
) -> Windows:
    """Windows of ``length`` rows of a trial that begin at rows ``starts`` (W,), in a ``state`` (S, W) or near it.

    ``fresh`` are the rows at which a sample of the position arrives.
    """
    lag = round(late(trial, rig) / trial.period)
    own = [fresh[(fresh >= start + lag) & (fresh < start + length + lag)] for start in starts]
    most = max(map(len, own))
    arrived, valid = np.zeros((len(starts), most), dtype=np.intp), np.zeros((len(starts), most), dtype=np.bool_)
    for w, (start, found) in enumerate(zip(starts, own, strict=True)):
        arrived[w, : len(found)], valid[w, : len(found)] = found - start, True
    pressures = np.stack([trial.pressures[:, s : s + length].T for s in starts])
    positions = np.nan_to_num(trial.positions.T[starts[:, None] + arrived])
    known = np.isfinite(pressures)  # of a rail nothing in the first two chambers
    return Windows(
        trial,
        length,
        starts,
        arrived,
        valid,
        np.where(known, pressures, 0.0),
        positions,
        state,
        known.astype(np.float64),
        valid.astype(np.float64),
        budget,
        free_rows(rig),
        rig.friction.bristle_stiffness,
    )


def has_options(rig: Parameters) -> bool:
    """Whether the state of a rig has further rows."""
    return bool(rig.chambers.tube_length or rig.air.supply_conductance or rig.friction.law == "gms")


def _further(state: Array, rig: Parameters) -> Array:
    """The further rows (1 + 4, W) of states (18, W): the rig's supply, and at both ends of a tube the same pressure."""
    supply = np.full((1, state.shape[1]), rig.air.supply_pressure)
    return np.concatenate([supply, state[list(at.PRESSURES)]])


def free_rows(rig: Parameters) -> tuple[int, ...]:
    """Rows of a rig's state that a window's start leaves free."""
    chambers, supply = rig.linkage.topology.chambers, (SUPPLY,) if rig.air.supply_conductance else ()
    idle = () if len(chambers) == 4 else OF_CYLINDER_1
    ends = tuple(ENDS[k] for k in chambers) if rig.chambers.tube_length else ()
    return (*(row for row in FREE if row not in idle), *supply, *ends)


def _measured(trial: Trial, starts: NDArray[np.intp], k: int, lag: int, fresh: NDArray[np.intp]) -> NDArray[np.intp]:
    """Those of ``starts`` whose windows of ``k`` rows can be predicted and have more than half of the measurements."""
    lost = _before(np.zeros(len(trial.times), dtype=np.bool_) if trial.unknown is None else trial.unknown)
    ends, settled = starts + k, np.maximum(starts - round(SETTLED / trial.period), 0)
    driven = lost[ends] == lost[settled]
    cells = _before(numbers(trial.pressures[list(trial.topology.chambers)]))
    told = cells[ends] - cells[starts] > ENOUGH * k
    count = np.searchsorted(fresh, ends + lag) - np.searchsorted(fresh, starts + lag)
    some = fresh[np.clip(np.searchsorted(fresh, starts)[:, None] + np.arange(-NEAREST, NEAREST), 0, len(fresh) - 1)]
    apart = np.sort(np.abs(some - starts[:, None]), axis=1)[:, NEAREST - 1]
    followed = (count > ENOUGH * np.median(count)) & (apart <= np.maximum(2 * np.median(apart), SMOOTHED / trial.period))
    kept: NDArray[np.intp] = starts[driven & told & followed]
    if not len(kept):
        words = f"in no stretch of {k * trial.period:.2g} s of it openings, pressures and positions are all measured"
        raise ValueError(f"the log has too many gaps: {words}; allowed: a log with such stretches, best without gaps")
    return kept


def _before(mask: NDArray[np.bool_]) -> NDArray[np.intp]:
    """How many of ``mask`` (T,) are True before each row (T + 1,)."""
    return np.concatenate([[0], np.cumsum(mask)]).astype(np.intp, copy=False)


def _guess(trial: Trial, rig: Parameters, starts: NDArray[np.intp], fresh: NDArray[np.intp]) -> Array:
    """Start states (S, W): local parabolas through positions and pressures, bristles of steady sliding, air as warm as the
    walls, the same pressure at both ends of a tube."""
    period, column = trial.period, parameter_column(rig)
    state = np.zeros((at.STATES, len(starts)))
    taken = trial.times[fresh] - late(trial, rig)
    motion = np.empty((4, len(starts)))
    for w, now in enumerate(trial.times[starts]):
        near = np.abs(taken - now) <= max(SMOOTHED, 4 * period)
        near[np.argsort(np.abs(taken - now))[:NEAREST]] = True
        for axis in range(2):
            motion[axis, w], motion[2 + axis, w] = _parabola(taken[near] - now, trial.positions[axis, fresh[near]])
    joints = np.empty((4, len(starts)))
    pistons_at(motion, Rig(column), joints)
    state[[at.Y1, at.Y2, at.V1, at.V2]] = joints
    state[[at.Y1, at.V1]] *= column[at.FREE]
    wide = 2 * round(0.005 / period) + 3
    smooth = savgol_filter(bridged(trial.pressures), wide, 2, axis=1)
    state[list(at.PRESSURES)] = column[at.ATMOSPHERE]
    measured = list(trial.topology.chambers)
    state[np.array(at.PRESSURES)[measured]] = smooth[measured][:, starts]
    state[[at.Z1, at.Z2]] = np.tanh(state[[at.V1, at.V2]] / 0.01) * coulomb_levels_of(state, column) / column[at.S0]
    state[list(at.TEMPERATURES)] = column[at.TEMPERATURE]
    return np.concatenate([state, _further(state, rig)]) if has_options(rig) else state


def coulomb_levels_of(state: Array, column: Array) -> Array:
    """Coulomb friction of both pistons (2, W), N, in states (18, W) of one rig, a ``column`` (PARAMETERS,)."""
    levels = np.empty((2, state.shape[1]))
    coulomb_levels(state, np.repeat(column[:, None], state.shape[1], axis=1), levels)
    return levels


def _parabola(times: Array, values: Array) -> tuple[float, float]:
    """Value and slope at time zero of the parabola nearest to values."""
    scale = max(np.abs(times).max(), 1e-9)
    basis = np.stack([np.ones_like(times), times / scale, (times / scale) ** 2], axis=1)
    found = np.linalg.lstsq(basis, values, rcond=None)[0]
    return float(found[0]), float(found[1] / scale)


def spools_at(openings: Array, period: float, starts: NDArray[np.intp], rate: float) -> Array:
    """Openings of the spools (4, W) at rows ``starts``: the integrator's answer to the openings (4, T) before, from rest, of
    spools of a ``rate``, 1/s."""
    steps = steps_in(period)
    h = period / steps * rate
    kept = (1.0 - h * (1.0 - h * (0.5 - h / 6.0))) ** steps
    before = np.concatenate([np.zeros((4, 1)), openings[:, :-1]], axis=1)
    return np.asarray(lfilter([1.0 - kept], [1.0, -kept], before, axis=1)[:, starts])


def admitted_openings(trial: Trial, column: Array) -> Array:
    """What the openings of a log (4, T) become behind play and limit of the valves; a play begins in its middle."""
    if are_perfect(column[:, None]):
        return trial.openings
    opening = np.empty_like(trial.openings)
    admit_rows(np.ascontiguousarray(trial.openings), column[:, None].copy(), opening)
    return opening
