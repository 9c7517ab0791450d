"""The worst world that can be found: from the worst of many drawn ones on, rigs are moved within their ranges.

A world is a seed, of which scenario, hand and noise are drawn, and where the rig's figures stand in their ranges. In each
generation some of the worst worlds so far are moved at random, less and less far (an evolution strategy with truncation).
Gradients of the closed loop find less in the same time (``notes.md``).
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.parts.drawn.randomization import Ranges, draw_columns, draw_figures
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters

Seeds = NDArray[np.int64]

GENERATIONS, PARENTS = 8, 16
"""Assumed."""

SPREAD, SHRINKS = 0.3, 0.6
"""Assumed: standard deviation of the first generation's moves, of a range, and what is left of it in the next one."""


def drawn_places(seeds: Seeds, ranges: Ranges) -> Array:
    """Where in their ranges, 0 to 1, the figures of worlds stand that are drawn with ``seeds`` (N,): (F, N), names sorted."""
    return np.array([[streams.random() for _ in ranges] for streams in (stream(int(s), 0, "parameters") for s in seeds)]).T


class Placed:
    """``Streams`` that draw what stands at ``places`` (F, ...), one after the other."""

    def __init__(self, places: Array) -> None:
        self._places = iter(places)

    def uniform(self, low: float = 0.0, high: float = 1.0) -> Array:
        """``Streams.uniform``."""
        place: Array = next(self._places)
        return low + (high - low) * place


def parameters_at(places: Array, ranges: Ranges) -> dict[str, Array]:
    """The figures, SI units, at ``places`` (F, ...) of their ranges, which are equal ratios where a range is logarithmic."""
    return draw_figures(ranges, Placed(places))


def rigs_at(places: Array, ranges: Ranges, rig: Parameters) -> Array:
    """The rows of rigs (PARAMETERS, N) whose figures stand at ``places`` (F, N)."""
    streams: Any = Placed(places)
    return draw_columns(rig, ranges, streams, places.shape[1])


def hardest(
    judge: Callable[[Seeds, Array], Array], seeds: Seeds, places: Array, sizes: Array, episodes: int, seed: int
) -> tuple[int, Array]:
    """Seed and places (F,) of the world with the largest size after some ``episodes``.

    ``judge(seeds, places)`` gives sizes (N,); ``seeds`` (N,), ``places`` (F, N) and ``sizes`` are worlds to begin with.
    """
    rng, spread = np.random.default_rng(seed), SPREAD
    for _ in range(GENERATIONS):
        best = np.argsort(-sizes, kind="stable")[:PARENTS]
        seeds, places, sizes = seeds[best], places[:, best], sizes[best]
        parent = rng.integers(0, len(best), -(-episodes // GENERATIONS))
        tried = np.clip(places[:, parent] + spread * rng.standard_normal((len(places), len(parent))), 0.0, 1.0)
        found = judge(seeds[parent], tried)
        seeds, places = np.concatenate([seeds, seeds[parent]]), np.concatenate([places, tried], axis=1)
        sizes, spread = np.concatenate([sizes, found]), SHRINKS * spread
    worst = int(np.argmax(sizes))
    return int(seeds[worst]), places[:, worst]
