"""What an evaluation measures, accumulated while lanes run: tracking, stiffness, hunting, air."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.info import Info
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, part, row, rows
from birthsim_env.physics.rig.topology import RAIL, TOPOLOGIES, TWO_CYLINDERS, Topology
from birthsim_env.reward import SETTLED

QUIET = 1.0
"""s for which reference, force and setpoints must have been constant before motion counts as hunting."""

HELD = 2.0
"""s for which the push of a stiffness test must have been held when the episode ends."""

WINDOW = 0.5
"""s before the push and at the end of the hold over which positions are averaged: hunting enters neither mean."""

STUCK, RUNNING = 0.5e-3, 2e-3
"""m/s: below the first the end effector is stuck, above the second it has restarted."""

NORMAL_DENSITY = 1.293
"""kg/m3 of dry air at 0 C and 1.01325 bar: normal litres."""

UNITS = {
    "error_rms_x": "mm", "error_rms_y": "mm", "error_max_x": "mm", "error_max_y": "mm", "settled_rms_x": "mm",
    "settled_rms_y": "mm", "settled_rms": "mm", "settled_max_x": "mm", "settled_max_y": "mm", "stiffness_error": "%",
    "cross_motion": "mm", "unrest": "mm", "hunting_x": "mm", "hunting_y": "mm", "restarts": "1/s",
    "pneumatic_rms_1": "%", "pneumatic_rms_2": "%", "air": "l/min", "saturation": "%",
    "valve_turns": "1/s", "valve_travel": "1/s",
}  # fmt: skip
"""Metric -> unit. ``settled_rms`` is that of sqrt(ex^2 + ey^2). ``stiffness_error`` is rendered over asked-for stiffness
along the push, less one; ``cross_motion`` the displacement across the push beyond the one asked for; both from the compliant
target. ``unrest`` is the motion, peak to peak, in the ``WINDOW`` before the push. All three say something only where the
reference stands still all along and the episode ends in a held push. ``valve_turns`` says how often the command of a valve
turns back, ``valve_travel`` how many full openings it moves; both are means of the valves: their wear, and what is heard."""


class Asked(Rows):
    """What an instant asks for."""

    target = rows(2, "m", "x, y")
    stiffness = rows(2, "N/m", "setpoint of the closed-loop stiffness")
    compliant_target = rows(2, "m", "(19)")
    force = rows(2, "N", "of the hand")
    pneumatic_stiffness = rows(2, "N/m", "setpoint of the cylinders")


VECTORS = tuple(
    one.first
    for one in (Info.position, Info.velocity, Info.target, Info.compliant_target, Info.tracking_error, Info.user_force)
)
"""Rows of an ``Info`` at which a vector of the plane begins."""

NOT_OF_A_RAIL = (*(name for name in UNITS if name.endswith(("_y", "_1"))), "cross_motion")
"""Metrics of which an episode on a rail says nothing. Those of x are along the rail there, those of valves of its own two."""


class Tally(Rows):
    """What is carried from sample to sample."""

    count = row("1", "samples")
    settled_count = row("1", "those that are settled")
    squares = rows(2, "m2", "sum of squared errors")
    settled_squares = rows(2, "m2", "the same, settled")
    stiffness_squares = rows(2, "1", "sum of squared relative errors of the pneumatic stiffness")
    peak = rows(2, "m", "largest error")
    settled_peak = rows(2, "m", "the same, settled")
    supplied = row("kg", "air")
    saturated = row("1", "samples with a valve at its limit")
    opening = rows(4, "1", "at the last sample")
    way = rows(4, "1", "in which each opening last changed")
    turned = row("1", "changes of these ways")
    travelled = row("1", "sizes of all changes of openings")
    quiet_now = row("s", "for which all that is asked for has been constant")
    quiet_time = row("s", "of quiet that counted")
    low = rows(2, "m", "least position of this quiet window")
    high = rows(2, "m", "greatest position of it")
    hunting = rows(2, "m", "greatest span of a window so far")
    restarts = row("1", "from rest, in quiet windows")
    is_stuck = row("1", "1 where the end effector is stuck")
    is_still = row("1", "1 where target and setpoints have never changed")
    kept = row("1", "samples since anything asked for changed")
    sum = rows(2, "m", "of the positions of the last ``WINDOW`` s of them")
    rest = rows(2, "m", "mean position before the push")
    span = rows(2, "m", "peak to peak in that time")
    is_held = row("1", "1 where a push has been held for ``HELD`` s")
    moved = rows(2, "m", "mean position of the last ``WINDOW`` s")
    wanted = rows(2, "m", "displacement asked for")
    before = part(Asked, "at the last sample")
    alive = row("1", "1 in lanes that are measured")


@helper
def _add_errors(now: Info, command: Array, period: float, tally: Tally, i: int) -> None:
    settled = 1.0 if now.since_jump[i] >= SETTLED else 0.0
    tally.count[i] += 1.0
    tally.settled_count[i] += settled
    for k in range(2):
        size = abs(now.tracking_error[k, i])
        tally.squares[k, i] += size * size
        tally.settled_squares[k, i] += settled * size * size
        tally.peak[k, i] = max(tally.peak[k, i], size)
        tally.settled_peak[k, i] = max(tally.settled_peak[k, i], settled * size)
        tally.stiffness_squares[k, i] += (now.pneumatic_stiffness[k, i] / now.pneumatic_stiffness_setpoint[k, i] - 1.0) ** 2
    tally.supplied[i] += now.supply_flow[i] * period
    largest = 0.0
    for k in range(4):
        largest = max(largest, abs(command[k, i]))
        change = command[k, i] - tally.opening[k, i] if tally.count[i] > 1.0 else 0.0
        tally.turned[i] += 1.0 if change * tally.way[k, i] < 0.0 else 0.0
        tally.way[k, i] = change if change != 0.0 else tally.way[k, i]
        tally.travelled[i] += abs(change)
        tally.opening[k, i] = command[k, i]
    tally.saturated[i] += 1.0 if largest >= 1.0 else 0.0


@helper
def _hunt(now: Info, period: float, tally: Tally, i: int) -> None:
    """Spans and restarts of one lane where its setpoints have been constant for long enough."""
    counts = tally.quiet_now[i] >= QUIET
    speed = math.sqrt(now.velocity[0, i] ** 2 + now.velocity[1, i] ** 2)
    for k in range(2):
        # A window that ends gives its span to the worst one seen; a new one starts from nothing.
        tally.low[k, i] = min(tally.low[k, i], now.position[k, i]) if counts else math.inf
        tally.high[k, i] = max(tally.high[k, i], now.position[k, i]) if counts else -math.inf
        tally.hunting[k, i] = max(tally.hunting[k, i], tally.high[k, i] - tally.low[k, i])
    if counts:
        tally.quiet_time[i] += period
        tally.restarts[i] += 1.0 if tally.is_stuck[i] > 0.0 and speed > RUNNING else 0.0
    tally.is_stuck[i] = 1.0 if speed < STUCK else (0.0 if speed > RUNNING else tally.is_stuck[i])


@helper
def _add_rest(now: Info, period: float, tally: Tally, kept: Array, i: int) -> None:
    width, same, still, before = kept.shape[0], True, True, tally.before
    for k in range(2):
        still = still and now.target[k, i] == before.target[k, i] and now.stiffness_setpoint[k, i] == before.stiffness[k, i]
        same = same and now.compliant_target[k, i] == before.compliant_target[k, i]
        same = same and now.user_force[k, i] == before.force[k, i]
        same = same and now.pneumatic_stiffness_setpoint[k, i] == before.pneumatic_stiffness[k, i]
    if not ((same and still) or tally.count[i] <= 1.0):
        if before.force[0, i] == 0.0 and before.force[1, i] == 0.0:
            size = min(tally.kept[i], float(width))
            for k in range(2):
                low, high = math.inf, -math.inf
                for j in range(int(size)):
                    low, high = min(low, kept[j, k, i]), max(high, kept[j, k, i])
                tally.rest[k, i], tally.span[k, i] = tally.sum[k, i] / size, high - low
        tally.quiet_now[i], tally.kept[i], tally.sum[0, i], tally.sum[1, i] = 0.0, 0.0, 0.0, 0.0
        if not still:
            tally.is_still[i] = 0.0
    else:
        tally.quiet_now[i] += period
    slot = int(tally.kept[i]) % width
    for k in range(2):
        old = kept[slot, k, i] if tally.kept[i] >= width else 0.0
        tally.sum[k, i] += now.position[k, i] - old
        kept[slot, k, i] = now.position[k, i]
    tally.kept[i] += 1.0
    _hunt(now, period, tally, i)
    pushed = now.user_force[0, i] != 0.0 or now.user_force[1, i] != 0.0
    tally.is_held[i] = 1.0 if pushed and tally.quiet_now[i] >= HELD else 0.0
    for k in range(2):
        tally.moved[k, i] = tally.sum[k, i] / min(tally.kept[i], float(width))
        tally.wanted[k, i] = now.compliant_target[k, i] - now.target[k, i]
        before.target[k, i], before.compliant_target[k, i] = now.target[k, i], now.compliant_target[k, i]
        before.stiffness[k, i], before.force[k, i] = now.stiffness_setpoint[k, i], now.user_force[k, i]
        before.pneumatic_stiffness[k, i] = now.pneumatic_stiffness_setpoint[k, i]


@helper
def turn(now: Info, command: Array, p: Array, n: int) -> None:
    """Of lanes on a rail, turns vectors so that x is along it, and leaves out ``command`` (4, n) of idle valves."""
    for i in range(n):
        if p[at.FREE, i] == 0.0:
            cosine, sine = p[at.SIN_GAMMA3, i], -p[at.COS_GAMMA3, i]  # of the inclination
            for row in VECTORS:
                x, y = now.rows[row, i], now.rows[row + 1, i]
                now.rows[row, i], now.rows[row + 1, i] = cosine * x + sine * y, cosine * y - sine * x
            command[0, i], command[1, i] = 0.0, 0.0


@helper
def sample(now: Info, command: Array, period: float, tally: Tally, kept: Array, n: int) -> None:
    """Take one instant of n lanes: ``now``, and ``command`` (4, N), the openings.

    ``kept`` (W, 2, N): the positions of the last W samples since anything asked for changed. A lane that is not alive is left
    as it is.
    """
    for i in range(n):
        if tally.alive[i] > 0.0:
            _add_errors(now, command, period, tally, i)
            _add_rest(now, period, tally, kept, i)


@kernel
def _sample(now: Info, command: Array, period: float, tally: Tally, kept: Array) -> None:
    sample(now, command, period, tally, kept, command.shape[1])


def fresh_tally(lanes: int, more: int = 0) -> Array:
    """The rows of a ``Tally``, and ``more`` behind them, of episodes that begin."""
    rows: Array = np.zeros((Tally.size + more, lanes))
    tally = Tally(rows[: Tally.size])
    # No window has been quiet yet, none has been at rest before a push.
    tally.hunting[:], tally.rest[:], tally.is_still[:], tally.alive[:] = -np.inf, np.nan, 1.0, 1.0
    return rows


def window(lanes: int, period: float) -> Array:
    """Room for the positions of the last ``WINDOW`` s, (W, 2, N)."""
    return np.zeros((max(1, round(WINDOW / period)), 2, lanes))


class EpisodeMetrics:
    """Metrics of one episode in each of N lanes, sampled every ``period`` s by ``add``."""

    def __init__(self, num_lanes: int, period: float) -> None:
        self._period, self._tally, self._kept = period, Tally(fresh_tally(num_lanes)), window(num_lanes, period)
        self._now = Info(np.zeros((Info.size, num_lanes)))

    def add(self, info: dict[str, Any], command: Array, alive: NDArray[np.bool_]) -> None:
        """Take the ``info`` of a vector environment and the openings (4, N) commanded at the same instant.

        Lanes where ``alive`` (N,) is False are left as they are; a lane that was left once is not taken up again.
        """
        for name, group in Info.groups.items():
            if name in info:
                self._now.rows[group.first if group.single else group.place] = info[name].T
        self._tally.alive[:] = alive
        _sample(self._now, np.ascontiguousarray(command, dtype=np.float64), self._period, self._tally, self._kept)

    def result(self) -> dict[str, Array]:
        """Every metric of ``UNITS`` per lane, (N,); NaN where an episode says nothing about it."""
        return metrics_of(self._tally, self._period)


def metrics_of(tally: Tally, period: float, topology: Topology = TOPOLOGIES[TWO_CYLINDERS]) -> dict[str, Array]:
    """Every metric of ``UNITS`` per lane, (N,), of a tally sampled every ``period`` s."""
    valves = 1.0 / len(topology.chambers)
    count, settled_count, quiet = tally.count, tally.settled_count, tally.quiet_time
    with np.errstate(invalid="ignore", divide="ignore"):
        rms = 1e3 * np.sqrt(tally.squares / count)
        settled = 1e3 * np.sqrt(tally.settled_squares / settled_count)
        pneumatic = 100 * np.sqrt(tally.stiffness_squares / count)
        peaks = np.where(settled_count > 0, 1e3 * tally.settled_peak, np.nan)
        hunting = np.where(quiet > 0, 1e3 * tally.hunting, np.nan)
        values = {
            "error_rms_x": rms[0],
            "error_rms_y": rms[1],
            "error_max_x": 1e3 * tally.peak[0],
            "error_max_y": 1e3 * tally.peak[1],
            "settled_rms_x": settled[0],
            "settled_rms_y": settled[1],
            "settled_rms": np.hypot(*settled),
            "settled_max_x": peaks[0],
            "settled_max_y": peaks[1],
            "hunting_x": hunting[0],
            "hunting_y": hunting[1],
            "restarts": np.where(quiet > 0, tally.restarts / quiet, np.nan),
            "pneumatic_rms_1": pneumatic[0],
            "pneumatic_rms_2": pneumatic[1],
            "air": 60e3 * tally.supplied / NORMAL_DENSITY / (count * period),
            "saturation": 100 * tally.saturated / count,
            "valve_turns": valves * tally.turned / (count * period),
            "valve_travel": valves * tally.travelled / (count * period),
        }
        values["stiffness_error"], values["cross_motion"], values["unrest"] = _rendered(tally)
    if topology == TOPOLOGIES[RAIL]:
        values["settled_rms"] = values["settled_rms_x"]
        values |= {name: np.full_like(values[name], np.nan) for name in NOT_OF_A_RAIL}
    return {name: values[name] for name in UNITS}


def _rendered(tally: Tally) -> tuple[Array, Array, Array]:
    push, asked, moved = tally.before.force, tally.wanted, tally.moved - tally.rest
    direction = push / np.hypot(*push)
    along, wanted = (np.einsum("in,in->n", way, direction) for way in (moved, asked))
    across = direction[0] * (moved - asked)[1] - direction[1] * (moved - asked)[0]
    says = (tally.is_still > 0) & (tally.is_held > 0)
    found = 100 * (wanted / along - 1), 1e3 * np.abs(across), 1e3 * np.hypot(*tally.span)
    stiffness, cross, unrest = (np.where(says, values, np.nan) for values in found)
    return stiffness, cross, unrest
