"""What an evaluation measures, accumulated while lanes run (docs/controllers.md): tracking, stiffness, hunting, air."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.info import ROWS, SLICES
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.success import SETTLED

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
    "error_rms_x": "mm",
    "error_rms_y": "mm",
    "error_max_x": "mm",
    "error_max_y": "mm",
    "settled_rms_x": "mm",
    "settled_rms_y": "mm",
    "settled_rms": "mm",
    "settled_max_x": "mm",
    "settled_max_y": "mm",
    "stiffness_error": "%",
    "cross_motion": "mm",
    "unrest": "mm",
    "hunting_x": "mm",
    "hunting_y": "mm",
    "restarts": "1/s",
    "pneumatic_rms_1": "%",
    "pneumatic_rms_2": "%",
    "air": "l/min",
    "saturation": "%",
}
"""Metric -> unit. ``settled_rms`` is that of sqrt(ex^2 + ey^2). ``stiffness_error`` is rendered over asked-for stiffness
along the push, less one; ``cross_motion`` the displacement across the push beyond the one asked for; both from the compliant
target. ``unrest`` is the motion, peak to peak, in the ``WINDOW`` before the push. All three say something only where the
reference stands still all along and the episode ends in a held push."""

(
    COUNT, SETTLED_COUNT, EX, EY, SX, SY, K1, K2, PEAK_EX, PEAK_EY, PEAK_SX, PEAK_SY, SUPPLIED, SATURATED,
    QUIET_NOW, QUIET_TIME, LOW_X, LOW_Y, HIGH_X, HIGH_Y, HUNTING_X, HUNTING_Y, RESTARTS, IS_STUCK,
    IS_STILL, KEPT, SUM_X, SUM_Y, REST_X, REST_Y, SPAN_X, SPAN_Y, IS_HELD, MOVED_X, MOVED_Y, ASKED_X, ASKED_Y, PUSH_X, PUSH_Y,
    ALIVE, BEFORE,
) = range(41)  # fmt: skip
"""Rows of the tally: samples, and settled ones; sums of squares of errors (m2), settled errors and relative errors of the
pneumatic stiffness; their peaks; kg of air; samples with a valve at its limit; s of constant setpoints now, and those that
counted; extremes of this window and the worst span; restarts; flags; the window's samples and their sum; means at rest,
spans of the same window, means held; displacement asked for; force held; 1 in lanes that are measured; what was asked for at
the last sample."""

SINCE, FLOW, ERROR, POSITION, VELOCITY, STIFFNESS, TARGET, COMPLIANT, FORCE, PNEUMATIC = (
    SLICES[name].start
    for name in (
        *("since_jump", "supply_flow", "tracking_error", "position", "velocity", "pneumatic_stiffness"),
        *("target", "compliant_target", "user_force", "pneumatic_stiffness_setpoint"),
    )
)
"""First rows, in ``info``, of what is measured."""

STILL = (TARGET, TARGET + 1, SLICES["stiffness_setpoint"].start, SLICES["stiffness_setpoint"].start + 1)
ASKED = (*STILL, COMPLIANT, COMPLIANT + 1, FORCE, FORCE + 1, PNEUMATIC, PNEUMATIC + 1)
"""Rows of what is asked for, those first that a stiffness test leaves alone."""

TALLY, PUSHED_BEFORE = BEFORE + len(ASKED), BEFORE + ASKED.index(FORCE)
"""Rows of the tally, and where the force of the last sample stands in it."""


@helper
def _add_errors(now: Array, command: Array, period: float, tally: Array, i: int) -> None:
    settled = 1.0 if now[SINCE, i] >= SETTLED else 0.0
    tally[COUNT, i] += 1.0
    tally[SETTLED_COUNT, i] += settled
    for k in range(2):
        size = abs(now[ERROR + k, i])
        tally[EX + k, i] += size * size
        tally[SX + k, i] += settled * size * size
        tally[PEAK_EX + k, i] = max(tally[PEAK_EX + k, i], size)
        tally[PEAK_SX + k, i] = max(tally[PEAK_SX + k, i], settled * size)
        tally[K1 + k, i] += (now[STIFFNESS + k, i] / now[PNEUMATIC + k, i] - 1.0) ** 2
    tally[SUPPLIED, i] += now[FLOW, i] * period
    largest = 0.0
    for k in range(4):
        largest = max(largest, abs(command[k, i]))
    tally[SATURATED, i] += 1.0 if largest >= 1.0 else 0.0


@helper
def _hunt(now: Array, period: float, tally: Array, i: int) -> None:
    """Spans and restarts of one lane where its setpoints have been constant for long enough."""
    counts = tally[QUIET_NOW, i] >= QUIET
    speed = math.sqrt(now[VELOCITY, i] ** 2 + now[VELOCITY + 1, i] ** 2)
    for k in range(2):
        # A window that ends gives its span to the worst one seen; a new one starts from nothing.
        tally[LOW_X + k, i] = min(tally[LOW_X + k, i], now[POSITION + k, i]) if counts else math.inf
        tally[HIGH_X + k, i] = max(tally[HIGH_X + k, i], now[POSITION + k, i]) if counts else -math.inf
        tally[HUNTING_X + k, i] = max(tally[HUNTING_X + k, i], tally[HIGH_X + k, i] - tally[LOW_X + k, i])
    if counts:
        tally[QUIET_TIME, i] += period
        tally[RESTARTS, i] += 1.0 if tally[IS_STUCK, i] > 0.0 and speed > RUNNING else 0.0
    tally[IS_STUCK, i] = 1.0 if speed < STUCK else (0.0 if speed > RUNNING else tally[IS_STUCK, i])


@helper
def _add_rest(now: Array, period: float, tally: Array, kept: Array, i: int) -> None:
    width, same, still = kept.shape[0], True, True
    for k in range(len(ASKED)):
        changed = now[ASKED[k], i] != tally[BEFORE + k, i]
        same, still = same and not changed, still and not (changed and k < len(STILL))
    if not (same or tally[COUNT, i] <= 1.0):
        if tally[PUSHED_BEFORE, i] == 0.0 and tally[PUSHED_BEFORE + 1, i] == 0.0:
            size = min(tally[KEPT, i], float(width))
            tally[REST_X, i], tally[REST_Y, i] = tally[SUM_X, i] / size, tally[SUM_Y, i] / size
            for k in range(2):
                low, high = math.inf, -math.inf
                for j in range(int(size)):
                    low, high = min(low, kept[j, k, i]), max(high, kept[j, k, i])
                tally[SPAN_X + k, i] = high - low
        tally[QUIET_NOW, i] = 0.0
        tally[KEPT, i] = tally[SUM_X, i] = tally[SUM_Y, i] = 0.0
        if not still:
            tally[IS_STILL, i] = 0.0
    else:
        tally[QUIET_NOW, i] += period
    slot = int(tally[KEPT, i]) % width
    for k in range(2):
        old = kept[slot, k, i] if tally[KEPT, i] >= width else 0.0
        tally[SUM_X + k, i] += now[POSITION + k, i] - old
        kept[slot, k, i] = now[POSITION + k, i]
    tally[KEPT, i] += 1.0
    _hunt(now, period, tally, i)
    pushed = now[FORCE, i] != 0.0 or now[FORCE + 1, i] != 0.0
    tally[IS_HELD, i] = 1.0 if pushed and tally[QUIET_NOW, i] >= HELD else 0.0
    for k in range(2):
        tally[MOVED_X + k, i] = tally[SUM_X + k, i] / min(tally[KEPT, i], float(width))
        tally[ASKED_X + k, i] = now[COMPLIANT + k, i] - now[TARGET + k, i]
        tally[PUSH_X + k, i] = now[FORCE + k, i]
    for k in range(len(ASKED)):
        tally[BEFORE + k, i] = now[ASKED[k], i]


@helper
def sample(now: Array, command: Array, period: float, tally: Array, kept: Array) -> None:
    """Take one instant: ``now`` (info.ROWS, N) as ``info`` has it, ``command`` (4, N) the openings.

    ``kept`` (W, 2, N): the positions of the last W samples since anything asked for changed. A lane whose row ``ALIVE`` is 0 is
    left as it is.
    """
    for i in range(now.shape[1]):
        if tally[ALIVE, i] > 0.0:
            _add_errors(now, command, period, tally, i)
            _add_rest(now, period, tally, kept, i)


@kernel
def _sample(now: Array, command: Array, period: float, tally: Array, kept: Array) -> None:
    sample(now, command, period, tally, kept)


def fresh_tally(lanes: int, rows: int = TALLY) -> Array:
    """The tally, (``rows``, N), of episodes that begin."""
    tally: Array = np.zeros((rows, lanes))
    # No window has been quiet yet, none has been at rest before a push.
    tally[[HUNTING_X, HUNTING_Y]] = -np.inf
    tally[[REST_X, REST_Y]] = np.nan
    tally[[IS_STILL, ALIVE]] = 1.0
    return tally


def window(lanes: int, period: float) -> Array:
    """Room for the positions of the last ``WINDOW`` s, (W, 2, N)."""
    return np.zeros((max(1, round(WINDOW / period)), 2, lanes))


class EpisodeMetrics:
    """Metrics of one episode in each of N lanes, sampled every ``period`` s by ``add``."""

    def __init__(self, num_lanes: int, period: float) -> None:
        self._period, self._tally, self._kept = period, fresh_tally(num_lanes), window(num_lanes, period)
        self._now: Array = np.zeros((ROWS, num_lanes))

    def add(self, info: dict[str, Any], command: Array, alive: NDArray[np.bool_]) -> None:
        """Take the ``info`` of a vector environment and the openings (4, N) commanded at the same instant.

        Lanes where ``alive`` (N,) is False are left as they are; a lane that was left once is not taken up again.
        """
        for name, rows in SLICES.items():
            if name in info:
                self._now[rows] = info[name].T
        self._tally[ALIVE] = alive
        _sample(self._now, np.ascontiguousarray(command, dtype=np.float64), self._period, self._tally, self._kept)

    def result(self) -> dict[str, Array]:
        """Every metric of ``UNITS`` per lane, (N,); NaN where an episode says nothing about it."""
        return figures_of(self._tally, self._period)


def figures_of(t: Array, period: float) -> dict[str, Array]:
    """Every metric of ``UNITS`` per lane, (N,), of a tally sampled every ``period`` s."""
    with np.errstate(invalid="ignore", divide="ignore"):
        rms = 1e3 * np.sqrt(t[EX : EY + 1] / t[COUNT])
        settled = 1e3 * np.sqrt(t[SX : SY + 1] / t[SETTLED_COUNT])
        pneumatic = 100 * np.sqrt(t[K1 : K2 + 1] / t[COUNT])
        peaks = np.where(t[SETTLED_COUNT] > 0, 1e3 * t[PEAK_SX : PEAK_SY + 1], np.nan)
        hunting = np.where(t[QUIET_TIME] > 0, 1e3 * t[HUNTING_X : HUNTING_Y + 1], np.nan)
        values = {
            "error_rms_x": rms[0],
            "error_rms_y": rms[1],
            "error_max_x": 1e3 * t[PEAK_EX],
            "error_max_y": 1e3 * t[PEAK_EY],
            "settled_rms_x": settled[0],
            "settled_rms_y": settled[1],
            "settled_rms": np.hypot(*settled),
            "settled_max_x": peaks[0],
            "settled_max_y": peaks[1],
            "hunting_x": hunting[0],
            "hunting_y": hunting[1],
            "restarts": np.where(t[QUIET_TIME] > 0, t[RESTARTS] / t[QUIET_TIME], np.nan),
            "pneumatic_rms_1": pneumatic[0],
            "pneumatic_rms_2": pneumatic[1],
            "air": 60e3 * t[SUPPLIED] / NORMAL_DENSITY / (t[COUNT] * period),
            "saturation": 100 * t[SATURATED] / t[COUNT],
        }
        values["stiffness_error"], values["cross_motion"], values["unrest"] = _rendered(t)
    return {name: values[name] for name in UNITS}


def _rendered(t: Array) -> tuple[Array, Array, Array]:
    push, asked = t[PUSH_X : PUSH_Y + 1], t[ASKED_X : ASKED_Y + 1]
    moved = t[MOVED_X : MOVED_Y + 1] - t[REST_X : REST_Y + 1]
    direction = push / np.hypot(*push)
    along, wanted = (np.einsum("in,in->n", way, direction) for way in (moved, asked))
    across = direction[0] * (moved - asked)[1] - direction[1] * (moved - asked)[0]
    says = (t[IS_STILL] > 0) & (t[IS_HELD] > 0)
    found = 100 * (wanted / along - 1), 1e3 * np.abs(across), 1e3 * np.hypot(*t[SPAN_X : SPAN_Y + 1])
    stiffness, cross, unrest = (np.where(says, values, np.nan) for values in found)
    return stiffness, cross, unrest
