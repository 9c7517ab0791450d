"""How good a residual is on worlds that training never sees: settled tracking error per lane."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

SETTLED = 0.5
"""s after a jump from which an error counts, as in the evaluation."""

VALIDATION_SEED = 1_000_000
"""First seed of the validation worlds; evaluation seeds stay below it."""

TRAINING_SEED = 2_000_000
"""First seed of the training worlds, which neither validation nor evaluation should meet."""

SEED_SPACING = 10_000
"""Between the first lanes of neighbouring training seeds, so that they share no worlds."""


@dataclass(frozen=True)
class Score:
    """Settled RMS of sqrt(ex^2 + ey^2) per lane, mm; a lost lane counts as 100 mm."""

    lanes: NDArray[np.float64]
    lost: int

    @property
    def pooled(self) -> float:
        """RMS over the lanes, mm."""
        return float(np.sqrt(np.mean(self.lanes**2)))

    @property
    def tail(self) -> float:
        """95 % quantile over the lanes, mm."""
        return float(np.quantile(self.lanes, 0.95))


def validate(env: Any, act: Callable[[NDArray[np.float32]], NDArray[Any]], seed: int = VALIDATION_SEED) -> Score:
    """Run one episode in every lane of a vector environment under ``act``: observations (N, D) -> actions (N, size)."""
    observation, info = env.reset(seed=seed)
    squares, counts = np.zeros(env.num_envs), np.zeros(env.num_envs)
    alive = np.ones(env.num_envs, dtype=np.bool_)
    for _ in range(env.steps):
        settled = alive & (info["since_jump"] >= SETTLED)
        squares += settled * (info["tracking_error"] ** 2).sum(axis=1)
        counts += settled
        observation, _, terminated, _, info = env.step(act(observation))
        alive &= ~terminated
    rms = 1e3 * np.sqrt(squares / np.maximum(counts, 1))
    return Score(np.where(alive, rms, 100.0), int(np.sum(~alive)))
