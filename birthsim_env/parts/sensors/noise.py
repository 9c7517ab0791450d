"""Random numbers of a key and a counter, so that what a sensor shows does not depend on the order of lanes or calls."""

import math

import numpy as np

from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper


@helper
def uniform(key: np.uint64, counter: np.uint64) -> float:
    """A number in (0, 1) from a key and a counter: SplitMix64 (Steele et al. 2014) without a state to carry along."""
    x = key + counter * np.uint64(0x9E3779B97F4A7C15)
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    x = x ^ (x >> np.uint64(31))
    return ((x >> np.uint64(11)) + 0.5) / 9007199254740992.0


@helper
def normal(key: np.uint64, tick: int, channel: int) -> float:
    """A standard normal number for one of 16 channels at one tick (Box and Muller)."""
    counter = np.uint64(tick * 32 + 2 * channel)
    radius = math.sqrt(-2.0 * exact.log(uniform(key, counter)))
    return radius * exact.cosine(2.0 * math.pi * uniform(key, counter + np.uint64(1)))


@helper
def noise_of(key: np.uint64, tick: int, channel: int, size: float) -> float:
    """``normal`` with a standard deviation ``size``, of 0 where there is none."""
    return size * normal(key, tick, channel) if size > 0.0 else 0.0


@helper
def happens(key: np.uint64, tick: int, channel: int, probability: float) -> bool:
    """Whether what has a ``probability`` happens at one tick, for one of 16 channels."""
    return probability > 0.0 and uniform(key, np.uint64(tick * 32 + 2 * channel)) < probability
