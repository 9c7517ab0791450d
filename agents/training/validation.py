"""How good a residual is on worlds that training never sees: settled errors, stiffness, hunting and saturation per lane."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.training.configuration import TARGETS
from agents.training.declared import Declared
from baselines.bench.feasibility import required_strength_ratio
from baselines.bench.metrics import EpisodeMetrics
from baselines.bench.statistics import LOST_ERROR, penalize_lost, quantile
from birthsim_env.reward import SETTLED
from birthsim_env.splits import TRAIN, VALIDATION

VALIDATION_SEED = VALIDATION.first
"""First seed of the validation worlds."""

TRAINING_SEED = TRAIN.first
"""First seed of the training worlds, which neither validation nor evaluation should meet."""

SEED_SPACING = 10_000
"""Between the first lanes of neighbouring training seeds, so that they share no worlds."""

PUSHED = 5.0
"""N: a weaker hand says nothing about the stiffness that it feels."""

METRICS = (
    "pooled_mm",
    "tail_mm",
    "median_mm",
    "max_mm",
    "stiffness_error_percent",
    "hunting_mm",
    "saturation_percent",
    "infeasible",
    "lost",
)
"""What a validation says, of which the last two are counts."""

Lanes = NDArray[np.float64]


def training_seeds(seed: int, lanes: int) -> range:
    """Seeds of the worlds of a training with ``seed`` in so many lanes."""
    first = TRAINING_SEED + SEED_SPACING * seed
    return range(first, first + lanes)


@dataclass(frozen=True)
class Score:
    """Metrics per lane, (N,); NaN where an episode says nothing.

    - ``error``: settled RMS of sqrt(ex^2 + ey^2), mm, or RMS of the distance from the declared motion;
    - ``stiffness``: error of the rendered stiffness, %, the mean settled error along the push over the displacement asked for;
    - ``hunting``, mm; ``saturation``, time with a valve at its limit, %;
    - ``required_strength_ratio``: the fraction of the rig's strength that the world asks for.
    """

    error: Lanes
    stiffness: Lanes
    hunting: Lanes
    saturation: Lanes
    required_strength_ratio: Lanes
    lost: int

    @property
    def feasible(self) -> NDArray[np.bool_]:
        """Lanes (N,) whose world asks for no more than the cylinders can give."""
        return self.required_strength_ratio < 1.0

    @property
    def pooled(self) -> float:
        """RMS over the feasible lanes, mm."""
        own = self.error[self.feasible]
        return float(np.sqrt(np.mean(own**2))) if own.size else float("nan")

    @property
    def tail(self) -> float:
        """95 % quantile over the feasible lanes, mm."""
        return quantile(self.error[self.feasible], 0.95)

    def to_dict(self) -> dict[str, float]:
        """The metrics of a learning curve; medians where nothing else is said, NaN without a feasible lane."""

        def over_lanes(values: Lanes, fraction: float = 0.5) -> float:
            return quantile(values[self.feasible], fraction)

        return {
            "pooled_mm": self.pooled,
            "tail_mm": self.tail,
            "median_mm": over_lanes(self.error),
            "max_mm": over_lanes(self.error, 1.0),
            "stiffness_error_percent": over_lanes(self.stiffness),
            "hunting_mm": over_lanes(self.hunting),
            "saturation_percent": over_lanes(self.saturation),
            "infeasible": int(np.sum(~self.feasible)),
            "lost": self.lost,
        }


def merit(metrics: dict[str, float]) -> float:
    """What is to be small: pooled error and its tail together, since the tail is what a mean hides."""
    return metrics["pooled_mm"] + metrics["tail_mm"]


def joined(scores: Sequence[Score]) -> Score:
    """The score of all lanes of several environments."""

    def every(name: str) -> Lanes:
        return np.concatenate([getattr(one, name) for one in scores])

    return Score(
        every("error"),
        every("stiffness"),
        every("hunting"),
        every("saturation"),
        every("required_strength_ratio"),
        sum(one.lost for one in scores),
    )


def validate(
    env: Any, act: Callable[[NDArray[np.float32]], NDArray[Any]], seed: int = VALIDATION_SEED, target: str = TARGETS[0]
) -> Score:
    """Run one episode in every lane of a residual vector environment under ``act``: observations (N, D) -> actions (N, size).

    ``act`` stands at the beginning of an episode. Metrics are sampled once per policy step. Where the ``target`` is the
    declared motion, ``Score.error`` is the distance from it, from ``SETTLED`` s after the beginning on.
    """
    observation, info = env.reset(seed=seed)
    asked = required_strength_ratio(env)
    lanes = env.num_envs
    metrics = EpisodeMetrics(lanes, env.simulation.period * env.simulation.periods)
    alive: NDArray[np.bool_] = np.ones(lanes, dtype=np.bool_)
    rendered, counts, squares, instants = np.zeros((4, lanes))
    declared = Declared(env.simulation) if target != TARGETS[0] else None
    for step in range(env.steps):
        metrics.add(info, env.simulation.openings, alive)
        size = np.hypot(*info["user_force"].T)
        given = info["compliant_target"] - info["target"]
        along = np.abs((info["tracking_error"] * info["user_force"]).sum(axis=1)) / np.maximum(size, PUSHED)
        counted = alive & (info["since_jump"] >= SETTLED) & (size >= PUSHED)
        rendered += np.where(counted, along / np.maximum(np.hypot(*given.T), 1e-6), 0.0)
        counts += counted
        observation, _, terminated, _, info = env.step(act(observation))
        alive &= ~terminated
        # Where an episode has ended the next has begun.
        if declared is not None and step < env.steps - 1:
            counted = alive & (step * env.simulation.periods * env.simulation.period >= SETTLED)
            apart = env.simulation.motion[:2] - declared.follow()[:2]
            squares, instants = squares + np.where(counted, (apart**2).sum(axis=0), 0.0), instants + counted
    result = metrics.result()
    with np.errstate(invalid="ignore"):
        error = result["settled_rms"] if declared is None else 1e3 * np.sqrt(squares / instants)
        return Score(
            penalize_lost(error, ~alive, True, LOST_ERROR),
            100 * rendered / np.where(counts > 0, counts, np.nan),
            np.fmax(result["hunting_x"], result["hunting_y"]),
            result["saturation"],
            asked,
            int(np.sum(~alive)),
        )
