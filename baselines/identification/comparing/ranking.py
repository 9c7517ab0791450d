"""Which of several rigs is nearest to a log, with an interval by a bootstrap over its windows.

A rig's error is the root of the mean square of its scores (``signals.scores_of``) over the windows that all rigs share. The
windows are drawn anew, the same ones for both rigs of a pair (Efron 1979), so that how hard a window is does not count.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from birthsim_env.physics.compiled.lanes import Array

LEVEL, RESAMPLES = 0.95, 2000


@dataclass(frozen=True)
class Place:
    """The rig ``name`` with its ``error``, over the noise, and how much more that is than the first rig's, ``more``, with the
    95 % interval ``low`` to ``high``; all three are 0 of the first."""

    name: str
    error: float
    more: float
    low: float
    high: float

    @property
    def is_worse(self) -> bool:
        """Whether the log tells that the first rig is nearer."""
        return self.low > 0


def ranked(scores: Mapping[str, Array]) -> tuple[Place, ...]:
    """Rigs by their scores (W,), the nearest first; the same at every call."""
    every = np.array(list(scores.values()))
    count = every.shape[1]
    drawn = np.random.default_rng(count).multinomial(count, np.full(count, 1.0 / count), RESAMPLES) / count
    errors, samples = np.sqrt(every.mean(axis=1)), np.sqrt(drawn @ every.T)
    order = np.argsort(errors, kind="stable")
    places, names, tail = [], list(scores), (1.0 - LEVEL) / 2.0
    for k in order:
        more = samples[:, k] - samples[:, order[0]]
        low, high = np.quantile(more, (tail, 1.0 - tail))
        places.append(Place(names[k], float(errors[k]), float(errors[k] - errors[order[0]]), float(low), float(high)))
    return tuple(places)
