"""Signals of the last control periods, at the time at which a late position was taken."""

from __future__ import annotations

import math

import numpy as np

from birthsim_env.loop.signals import Mask
from birthsim_env.physics.compiled.lanes import Array

LONGEST_DELAY = 0.06
"""s: the oldest position whose force is still known; the longest latency that ``Electronics`` allows is 0.05 s."""


class Past:
    """``rows`` signals of N lanes; ``at`` is called once per control period of ``period`` s."""

    def __init__(self, period: float, rows: int, lanes: int) -> None:
        self._period = period
        self._kept: Array = np.full((math.ceil(LONGEST_DELAY / period) + 2, rows, lanes), np.nan)

    def reset(self, lanes: Mask) -> None:
        """Forget the past of the lanes of a mask (N,): their next signals count as those of all times before."""
        self._kept[:, :, lanes] = np.nan

    def at(self, late: Array, signals: Array) -> Array:
        """Takes the ``signals`` (rows, N) of now; returns those of ``late`` (N,) s ago, (rows, N)."""
        self._kept = np.roll(self._kept, 1, axis=0)
        self._kept = np.where(np.isnan(self._kept[1]), signals, self._kept)
        self._kept[0] = signals
        place = np.clip(late / self._period, 0.0, len(self._kept) - 1.001)
        whole = place.astype(np.intp)
        part, lane = place - whole, np.arange(len(late))
        newer, older = self._kept[whole, :, lane].T, self._kept[whole + 1, :, lane].T
        return np.asarray(newer + part * (older - newer))
