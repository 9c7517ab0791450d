"""The figures of design section 6, accumulated while lanes run: one call of ``add`` per control period."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.lanes import Array

SETTLED = 0.5
"""s after a jump of force or setpoint (or the start) from which an error counts as settled."""

QUIET = 1.0
"""s for which reference, force and setpoints must have been constant before motion counts as hunting."""

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
    "hunting_x": "mm",
    "hunting_y": "mm",
    "restarts": "1/s",
    "pneumatic_rms_1": "%",
    "pneumatic_rms_2": "%",
    "air": "l/min",
    "saturation": "%",
}
"""Metric -> unit. ``settled_rms`` is that of sqrt(ex^2 + ey^2); ``stiffness_error`` is rendered over asked-for stiffness
less one; ``cross_motion`` the displacement across the push; both only where the reference stands still all along."""


class EpisodeMetrics:
    """Metrics of one episode in each of N lanes, sampled every ``period`` s."""

    def __init__(self, num_lanes: int, period: float) -> None:
        self._period = period
        self._n = np.zeros(num_lanes)
        self._settled = np.zeros(num_lanes)
        self._sums: dict[str, Array] = {name: np.zeros((2, num_lanes)) for name in ("error", "settled", "pneumatic")}
        self._peaks: dict[str, Array] = {name: np.zeros((2, num_lanes)) for name in ("error", "settled")}
        self._air = np.zeros(num_lanes)
        self._saturated = np.zeros(num_lanes)
        self._quiet = np.zeros(num_lanes)
        self._quiet_time = np.zeros(num_lanes)
        self._low: Array = np.full((2, num_lanes), np.inf)
        self._high: Array = np.full((2, num_lanes), -np.inf)
        self._hunting: Array = np.full((2, num_lanes), np.nan)
        self._restarts = np.zeros(num_lanes)
        self._stuck = np.zeros(num_lanes, dtype=np.bool_)
        self._last: tuple[Array, ...] | None = None
        self._still = np.ones(num_lanes, dtype=np.bool_)
        self._rest: Array = np.zeros((2, num_lanes))
        self._pushed: Array = np.zeros((2, num_lanes))
        self._held: Array = np.zeros((2, 2, num_lanes))

    def add(self, info: dict[str, Any], command: Array, alive: NDArray[np.bool_]) -> None:
        """Take the ``info`` of a vector environment and the openings (4, N) commanded at the same instant.

        Lanes where ``alive`` (N,) is False are left as they are.
        """
        error = info["tracking_error"].T
        settled = alive & (info["since_jump"] >= SETTLED)
        self._n += alive
        self._settled += settled
        self._sums["error"] += alive * error**2
        self._sums["settled"] += settled * error**2
        relative = info["pneumatic_stiffness"].T / info["pneumatic_stiffness_setpoint"].T - 1
        self._sums["pneumatic"] += alive * relative**2
        np.maximum(self._peaks["error"], alive * np.abs(error), out=self._peaks["error"])
        np.maximum(self._peaks["settled"], settled * np.abs(error), out=self._peaks["settled"])
        self._air += alive * info["supply_flow"] * self._period
        self._saturated += alive * (np.abs(command).max(axis=0) >= 1.0)
        self._add_rest(info, alive)

    def _add_rest(self, info: dict[str, Any], alive: NDArray[np.bool_]) -> None:
        position, force = info["position"].T, info["user_force"].T
        asked = (info["target"].T, force, info["stiffness_setpoint"].T, info["pneumatic_stiffness_setpoint"].T)
        same = np.ones_like(alive)
        if self._last is not None:
            for now, before in zip(asked, self._last, strict=True):
                same &= (now == before).all(axis=0)
            self._still &= (asked[0] == self._last[0]).all(axis=0) & (asked[2] == self._last[2]).all(axis=0) | ~alive
        self._last = tuple(values.copy() for values in asked)
        self._quiet = np.where(alive, np.where(same, self._quiet + self._period, 0.0), self._quiet)
        counts = alive & (self._quiet >= QUIET)
        # A window that ends gives its span to the worst one seen; a new one starts from nothing.
        self._low = np.where(counts, np.minimum(self._low, position), np.inf)
        self._high = np.where(counts, np.maximum(self._high, position), -np.inf)
        self._hunting = np.where(counts, np.fmax(self._hunting, self._high - self._low), self._hunting)
        self._quiet_time += counts * self._period
        speed = np.hypot(*info["velocity"].T)
        self._restarts += counts & self._stuck & (speed > RUNNING)
        self._stuck = np.where(speed < STUCK, True, np.where(speed > RUNNING, False, self._stuck))
        unpushed = alive & (force == 0).all(axis=0)
        self._rest = np.where(unpushed, position, self._rest)
        # Half a second of averaging, from the displacement at the window's start, takes the hunting out.
        share = np.where(counts, self._period / 0.5, 1.0)
        self._pushed += alive * share * (position - self._rest - self._pushed)
        self._held = np.where(alive, np.stack([force, info["stiffness_setpoint"].T]), self._held)

    def result(self) -> dict[str, Array]:
        """Every metric of ``UNITS`` per lane, (N,); NaN where an episode says nothing about it."""
        with np.errstate(invalid="ignore", divide="ignore"):
            rms = 1e3 * np.sqrt(self._sums["error"] / self._n)
            settled = 1e3 * np.sqrt(self._sums["settled"] / self._settled)
            pneumatic = 100 * np.sqrt(self._sums["pneumatic"] / self._n)
            values = {
                "error_rms_x": rms[0],
                "error_rms_y": rms[1],
                "error_max_x": 1e3 * self._peaks["error"][0],
                "error_max_y": 1e3 * self._peaks["error"][1],
                "settled_rms_x": settled[0],
                "settled_rms_y": settled[1],
                "settled_rms": np.hypot(*settled),
                "settled_max_x": np.where(self._settled > 0, 1e3 * self._peaks["settled"][0], np.nan),
                "settled_max_y": np.where(self._settled > 0, 1e3 * self._peaks["settled"][1], np.nan),
                "hunting_x": 1e3 * self._hunting[0],
                "hunting_y": 1e3 * self._hunting[1],
                "restarts": np.where(self._quiet_time > 0, self._restarts / self._quiet_time, np.nan),
                "pneumatic_rms_1": pneumatic[0],
                "pneumatic_rms_2": pneumatic[1],
                "air": 60e3 * self._air / NORMAL_DENSITY / (self._n * self._period),
                "saturation": 100 * self._saturated / self._n,
            }
            values["stiffness_error"], values["cross_motion"] = self._rendered()
        return {name: values[name] for name in UNITS}

    def _rendered(self) -> tuple[Array, Array]:
        force, setpoint = self._held
        size = np.hypot(*force)
        direction = force / size
        along = np.einsum("in,in->n", self._pushed, direction)
        across = direction[0] * self._pushed[1] - direction[1] * self._pushed[0]
        # Compliance along the push of a spring with the stiffnesses asked for on x and y.
        asked = 1 / np.einsum("in,in->n", direction**2, 1 / setpoint)
        says = self._still & (size > 0) & (self._quiet >= QUIET + 1.0)
        return np.where(says, 100 * (size / along / asked - 1), np.nan), np.where(says, 1e3 * np.abs(across), np.nan)


def summarize(values: Array) -> dict[str, float]:
    """Median, mean, 95 % quantile and maximum over the lanes that say something; NaN where none does."""
    said = values[np.isfinite(values)]
    if said.size == 0:
        return dict.fromkeys(("median", "mean", "q95", "max"), float("nan"))
    size = np.abs(said)
    return {
        "median": float(np.median(said)),
        "mean": float(np.mean(said)),
        "q95": float(np.quantile(size, 0.95)),
        "max": float(size.max()),
    }
