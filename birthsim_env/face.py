"""What the single and the vector environment say of themselves alike."""

import copy
from typing import TYPE_CHECKING, Any

from gymnasium.envs.registration import EnvSpec

from birthsim_env.assembly import RENDER_MODES
from birthsim_env.episodes import Episodes
from birthsim_env.physics.rig.parameters import Parameters

if TYPE_CHECKING:
    from birthsim_env.gradients import Recorder


class Face:
    """Comes before Gymnasium's class among the bases of an environment."""

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 100}  # noqa: RUF012  Gymnasium declares it so
    steps: int
    """Policy steps of an episode that nothing ends early."""

    _episodes: Episodes
    _spec: EnvSpec | None = None

    def _show(self, episodes: Episodes, **more: Any) -> None:
        """Take what the episodes are made of; ``metadata`` has ``more``."""
        setup, self._episodes = episodes.setup, episodes
        # A recorder takes a frame per step.
        self.metadata = {**self.metadata, "render_fps": setup.frames_per_second, **more}
        self.observation_names, self.simulation, self.steps = setup.observation_names, setup.simulation, setup.steps

    @property
    def parameters(self) -> Parameters:
        """The rig as described; ``simulation.plant.lane_parameters`` has what an episode has drawn."""
        return self._episodes.setup.simulation.parameters

    @property
    def dt(self) -> float:
        """s of a policy step."""
        return self._episodes.setup.policy_period

    def record(self) -> "Recorder":
        """What keeps every policy step from now on, for gradients (``birthsim_env.gradients``); on a device, there."""
        return self._episodes.record()

    @property
    def spec(self) -> EnvSpec | None:
        """Gymnasium's, with the steps of an episode as ``max_episode_steps``; the environment itself truncates.

        An environment made again from it with another ``policy_period`` or ``duration`` needs ``max_episode_steps=-1``.
        """
        return self._spec

    @spec.setter
    def spec(self, spec: EnvSpec | None) -> None:
        self._spec = copy.copy(spec)
        if self._spec is not None:
            self._spec.max_episode_steps = self.steps
