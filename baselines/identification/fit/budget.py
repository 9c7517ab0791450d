"""An end for every identification, whatever its log says: a budget of what is predicted."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from math import inf

from baselines.identification.log.trial import Trial

TIMES, AT_LEAST = 7_000.0, 35_000.0
"""How often the duration of a log is predicted at most, and s that are predicted at most of a short one; good logs take some
2,000 times their duration. A second takes 1 ms of a processor."""


@dataclass
class Budget:
    """Seconds that may still be predicted, ``left``; where they are ``over`` what was found so far is still evaluated."""

    left: float
    over: bool = False

    @staticmethod
    def of(trial: Trial) -> "Budget":
        """The budget of a trial."""
        return Budget(max(TIMES * float(trial.times[-1] - trial.times[0]), AT_LEAST))

    @staticmethod
    def endless() -> "Budget":
        """One without an end, for what is predicted once."""
        return Budget(inf)

    @contextmanager
    def part(self, share: float) -> Iterator[None]:
        """Keep all but a ``share`` of what is left for what comes later, also where that share is used up."""
        kept = (1.0 - share) * self.left
        self.left -= kept
        try:
            yield
        finally:
            self.left, self.over = self.left + kept, False

    def spend(self, seconds: float) -> None:
        """Take ``seconds``; ``UnsettledError`` where that is more than what is left."""
        self.left -= seconds
        if self.left < 0 and not self.over:
            raise UnsettledError


class UnsettledError(Exception):
    """A search does not come to its end within its budget."""
