"""What goes on inside valves and chambers: spools from what was commanded, pressures from noisy cells.

A spool follows its command with the lag that is known. A pressure is carried on by the control model (6), with the flow that
the believed spool lets through and the dead volume, and corrected by what its cell says,
    P' = k (r T q - P S L')/V + w (P_measured - P),   V = V0 + S L,
so that noise is averaged over 1/w without the delay of a filter: only the model's error of P' lags, and by 1/w.
"""

from __future__ import annotations

import numpy as np

from baselines.valve_inverse import driving_flows
from birthsim_env.loop.signals import Mask
from birthsim_env.physics import control_model, valves
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array


@helper
def predicted_pressure(
    pressure: float, opening: float, area: float, length: float, length_rate: float, period: float, p: Array
) -> float:
    """Pressure of a chamber after one period of a valve's ``opening``, Pa, by (6); ``length`` is that of its air, m."""
    supply = valves.supply_conductance(opening, p[at.CONDUCTANCE], p[at.LEAKAGE])
    exhaust = valves.exhaust_conductance(opening, p[at.CONDUCTANCE], p[at.LEAKAGE])
    fill, drain = driving_flows(pressure, p)
    flow = supply * fill - exhaust * drain
    whole, gas_t = max(length, 0.0) + p[at.DEAD_VOLUME] / area, p[at.GAS] * p[at.TEMPERATURE]
    filled = period * control_model.polytropic_rate_p(pressure, flow, 0.0, area, whole, p[at.INDEX], gas_t)
    pressed = period * control_model.polytropic_rate_p(pressure, 0.0, length_rate, area, whole, p[at.INDEX], gas_t)
    # However long the period: no flow goes beyond the pressure that drives it, and no stroke empties a chamber.
    filled = max(min(p[at.ATMOSPHERE] - pressure, 0.0), min(max(p[at.SUPPLY] - pressure, 0.0), filled))
    expected: float = max(pressure + filled + pressed, 0.5 * pressure)
    return expected


@helper
def observe(
    spools: Array, pressures: Array, openings: Array, measured: Array, joints: Array, p: Array, period: float, fraction: float,
    fresh: Array,
) -> None:  # fmt: skip
    """Carries ``spools`` (4, N) and ``pressures`` (4, N) on by one period, in which ``openings`` (4, N) were commanded."""
    kept = exact.exp(-period / p[at.TAU])
    # Of the way that is left to the command, the mean over the period.
    mean = (1.0 - kept) * p[at.TAU] / period
    for chamber in range(4):
        cylinder, sign = chamber // 2, 1.0 - 2.0 * (chamber % 2)
        half = p[at.HALF_L1] if cylinder == 0 else p[at.HALF_L2]
        area_p, area_n = (p[at.AREA_P1], p[at.AREA_N1]) if cylinder == 0 else (p[at.AREA_P2], p[at.AREA_N2])
        area = area_p if chamber % 2 == 0 else area_n
        for i in range(spools.shape[1]):
            away = spools[chamber, i] - openings[chamber, i]
            expected = predicted_pressure(
                pressures[chamber, i], openings[chamber, i] + mean * away, area, half + sign * joints[cylinder, i],
                sign * joints[2 + cylinder, i], period, p,
            )  # fmt: skip
            new = fresh[i] > 0.0
            pressures[chamber, i] = (
                measured[chamber, i] if new else fraction * measured[chamber, i] + (1.0 - fraction) * expected
            )
            spools[chamber, i] = 0.0 if new else openings[chamber, i] + kept * away


class ChamberObserver:
    """Spools and chamber pressures of N lanes as they are believed to be, one control period at a time.

    Arguments: the control ``period``, s, the rig (PARAMETERS,), and ``bandwidth``, w in 1/s, infinite for exact cells.
    ``spools`` (4, N) start shut; ``openings`` (4, N), which the next ``update`` takes for commanded, are for the controller to
    fill.
    """

    def __init__(self, period: float, lane_parameters: Array, bandwidth: float) -> None:
        self._p, self._period, self._fraction = lane_parameters, period, 1.0 - exact.number("exp", -bandwidth * period)
        self.spools: Array = np.empty((4, 0))
        self.openings: Array = np.empty((4, 0))

    def reset(self, lanes: Mask | None = None) -> None:
        """Forget the past of all lanes, or of those where ``lanes`` (N,) is True."""
        if lanes is None:
            self.spools = np.empty((4, 0))
        elif self.spools.shape[1]:
            self._fresh[lanes] = 1.0

    def update(self, measured: Array, joints: Array) -> Array:
        """Pressures (4, N), Pa, after one more period, from those ``measured`` (4, N) at its end.

        ``joints`` (4, N): y1, y2 (m), v1, v2 (m/s) at its start.
        """
        lanes = measured.shape[1]
        if self.spools.shape[1] != lanes:
            self.spools, self.openings = np.zeros((4, lanes)), np.zeros((4, lanes))
            self._pressures, self._fresh = np.zeros((4, lanes)), np.ones(lanes)
        observe(
            self.spools, self._pressures, self.openings, measured, joints, self._p, self._period, self._fraction, self._fresh
        )  # fmt: skip
        self._fresh[:] = 0.0
        return self._pressures
