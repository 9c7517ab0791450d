"""Between a training by Stable-Baselines3 and what watches it: averages the policies, and says when an update is over."""

from __future__ import annotations

from stable_baselines3.common.callbacks import BaseCallback

from agents.training.watch import Watch


class Monitor(BaseCallback):
    """Tells ``watch`` of every update, once its policy is in the average. In that of a checkpoint, which ``goes_on``, it is."""

    def __init__(self, watch: Watch, goes_on: bool) -> None:
        super().__init__()
        self._watch, self._goes_on = watch, goes_on

    def _on_rollout_start(self) -> None:
        # After an update and not inside a rollout: every validated policy is one that the algorithm has finished with.
        self._updated()

    def _on_step(self) -> bool:
        return not self._watch.over

    def _on_training_end(self) -> None:
        if not self._watch.over:
            self._updated()

    def _updated(self) -> None:
        if not self._goes_on:
            self.model.average.update_parameters(self.model.policy)  # type: ignore[attr-defined]
        self._goes_on = False
        self._watch.updated()
