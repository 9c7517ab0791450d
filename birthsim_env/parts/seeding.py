"""Random streams: every random part of a lane has a child seed of its own, so two controllers meet the same world.

Episode ``e`` of a lane seeded ``s`` depends on s and e alone, never on what happened in earlier episodes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

STREAMS = ("parameters", "reference", "user_force", "stiffness", "sensors")


def stream(lane_seed: int, episode: int, name: str) -> np.random.Generator:
    """Generator of one random part (one of ``STREAMS``) for one episode of one lane."""
    return np.random.default_rng(np.random.SeedSequence(lane_seed, spawn_key=(episode, STREAMS.index(name))))


def lane_seeds(seed: int | list[int | None] | None, num_envs: int, generator: np.random.Generator) -> list[int]:
    """One seed per lane: ``seed + i`` for an integer, the given ones for a list; missing ones come from ``generator``."""
    if isinstance(seed, (int, np.integer)):
        return [int(seed) + i for i in range(num_envs)]
    if seed is not None and (isinstance(seed, str) or not isinstance(seed, (Sequence, np.ndarray))):
        raise ValueError(f"seed = {seed!r}; allowed: None, an integer, or one entry for each of {num_envs} lanes")
    given: list[int | None] = [None] * num_envs if seed is None else list(seed)
    if len(given) != num_envs:
        raise ValueError(f"seed has {len(given)} entries; allowed: None, an integer, or one entry for each of {num_envs} lanes")
    for lane, s in enumerate(given):
        if not (s is None or (isinstance(s, (int, np.integer)) and s >= 0)):
            raise ValueError(f"seed[{lane}] = {s!r}; allowed: None or an integer >= 0")
    return [int(generator.integers(2**63)) if s is None else int(s) for s in given]


Range = float | tuple[float, float]
"""A fixed number, or (low, high): drawn uniformly at the start of every episode."""


def draw(value: Range, rng: np.random.Generator) -> float:
    """The number itself, or one drawn from its range."""
    if isinstance(value, tuple):
        try:
            low, high = (float(bound) for bound in value)
        except (TypeError, ValueError):
            low, high = math.nan, math.nan
        if not -math.inf < low <= high < math.inf:
            raise ValueError(f"range {value!r}; allowed: a number or (low, high), finite and ordered")
        return float(rng.uniform(low, high))
    return float(value)
