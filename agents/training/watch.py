"""What follows every update of a training: a validation where one is due, a checkpoint, and the end where it is asked for.

Between two updates a checkpoint can be written and changes nothing: a training that was killed goes on from the last one, and
ends as one that never was.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from tqdm import tqdm

from agents.training.algorithm import Learner
from agents.training.events import Events
from agents.training.reached import Reached
from agents.training.time_split import split
from birthsim_env.endings import later_signals

PERIOD = 30.0
"""s after which a checkpoint follows the next update: with an update and a validation besides, a kill costs less than a minute.

Assumed. A checkpoint took 0.01 CPU s of PPO, and 0.3 of SAC with a full memory, 84 MB, with the default lanes."""


class Watch:
    """Watches a ``learner``, whose policies ``reached`` validates and keeps, and whose ``past`` was in a checkpoint or is {}.

    ``asked`` says whether the training shall end before it has learned all. ``began``, s of ``time.perf_counter``, is before
    the law was validated, which is no part of the training.
    """

    def __init__(
        self,
        learner: Learner,
        reached: Reached,
        events: Events,
        past: dict[str, Any],
        asked: Callable[[], bool],
        bar: tqdm[Any],
        began: float,
    ) -> None:
        self.events, self._learner, self._reached, self._asked, self._bar = events, learner, reached, asked, bar
        self._before, self._began, self._written = past["seconds"] if past else 0.0, began, time.perf_counter()
        self._validating = self._written - began
        self.kept: int | None = learner.steps if past else None
        """Policy steps that a checkpoint has."""
        self.ended = False
        """Whether it has been asked for, and a checkpoint has all that was learned."""

    @property
    def over(self) -> bool:
        """Whether no update shall follow."""
        return self.ended or self._reached.over

    def updated(self) -> None:
        """Between two updates, before the first and after the last one; when a training goes on, also where it had stopped."""
        steps = self._learner.steps
        self._bar.update(min(steps, self._bar.total) - self._bar.n)
        if not (asked := self._asked()) and self._reached.is_due(steps):
            self._validate(steps)
            asked = self._asked()
        elif self.kept != steps and (asked or time.perf_counter() - self._written >= PERIOD):
            self._save(steps)
        self.ended = asked

    def _validate(self, steps: int) -> None:
        began, reached, network = time.perf_counter(), self._reached, self._learner.network()
        # A policy that has learned nothing says zero.
        metrics = reached.validate(network) if steps else dict(reached.metrics["law"])
        self._validating += time.perf_counter() - began
        simulation, stepping, stepped = self._learner.stepping()
        fraction = stepping / max(time.perf_counter() - self._began - self._validating, 1e-9)
        parts = split(simulation, stepping / stepped) if stepped else {}
        reached.add(
            network, metrics, {"steps": steps, "seconds": self._seconds(), "environment_fraction": fraction, "split": parts}
        )
        self.events.add(reached.events(metrics), steps)
        self._bar.set_postfix_str(reached.words(metrics))
        self._save(steps)

    def _save(self, steps: int) -> None:
        """A checkpoint, which holds the best policy too: that file may lack after a kill, and is then written anew."""
        past = {**self._reached.past(), "seconds": self._seconds(), "events": self.events.sizes()}
        with later_signals():
            self._learner.save(self._reached.describe(), past)
            self.kept = steps
            self._reached.keep()
        self._written = time.perf_counter()

    def _seconds(self) -> float:
        """Since the training began, without the time between a kill and the same command."""
        return float(self._before + time.perf_counter() - self._began)
