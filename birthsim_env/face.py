"""What the single and the vector environment say of themselves alike."""

import copy
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from gymnasium.envs.registration import EnvSpec
from numpy.typing import NDArray

from birthsim_env.assembly import RENDER_MODES, Randomize
from birthsim_env.drawing.scene import Scene
from birthsim_env.episodes import Episodes
from birthsim_env.loop.pipeline import Pipeline
from birthsim_env.loop.signals import Measurement
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.state import State

if TYPE_CHECKING:
    from birthsim_env.gradients.recorder import Recorder


def measurement_of(measurement: Measurement, lane: int) -> Measurement:
    """What the sensors of one lane say, in arrays without a lane axis."""
    own = {name: rows.T[lane] for name, rows in vars(measurement).items() if isinstance(rows, np.ndarray)}
    return replace(measurement, **own)


class Face:
    """Comes before Gymnasium's class among the bases of an environment."""

    metadata: dict[str, Any] = {"render_modes": list(RENDER_MODES), "render_fps": 100}  # noqa: RUF012  Gymnasium declares it so
    steps: int
    """Policy steps of an episode that nothing ends early."""

    _episodes: Episodes
    _ended: NDArray[np.bool_]
    """Of several lanes: which have ended, (N,)."""

    _np_random: np.random.Generator | None
    _np_random_seed: int | None
    np_random: np.random.Generator
    reset: Callable[..., Any]
    """Gymnasium's."""

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

    @property
    def pipeline(self) -> Pipeline:
        """What a control period runs: one tuple of named steps, which can be printed and edited by name.

        ``env.unwrapped.pipeline = env.unwrapped.pipeline.replace("sensors", my_stage)`` changes it from the next step on, also
        for later episodes; ``before``, ``after`` and ``without`` too (``birthsim_env.loop.pipeline.Pipeline``).
        """
        return self._episodes.pipeline

    @pipeline.setter
    def pipeline(self, pipeline: Pipeline) -> None:
        self._episodes.pipeline = pipeline

    def get_state(self) -> State:
        """All that the future of the lanes depends on, as arrays by name: ``np.savez(file, **env.get_state())`` keeps it.

        Another environment with the same arguments takes it with ``set_state`` and goes on with the same bits, in this process
        or another one. It leaves out what a user's part keeps outside of its attributes. Raises ``RuntimeError`` before the
        first ``reset``. Raises ``ValueError`` for a user's part with an attribute that is no number, text, array, generator, or
        list, tuple, dict or object of these.
        """
        return self._episodes.get_state(self.np_random, getattr(self, "_ended", None))

    def set_state(self, state: State) -> None:
        """Go on from what ``get_state`` returned.

        Raises ``ValueError`` for the state of another environment, and for names, shapes, types and numbers that ``get_state``
        of this one does not return; then nothing has changed.
        """
        before = None if self._episodes.begun else (self._np_random, self._np_random_seed)
        if before is not None:
            self.reset(seed=0)  # makes room for what parts remember
        try:
            self._episodes.set_state(state, self.np_random, getattr(self, "_ended", None))
        except ValueError:
            if before is not None:
                self._np_random, self._np_random_seed = before
                self._episodes.end()
            raise

    def set_ranges(self, randomize: Randomize) -> None:
        """From the next episode of each lane on draw worlds as if the environment had been made with this ``randomize``.

        A curriculum needs no new environment: episodes that are under way go on to their end in the world that they have. After
        ``reset(seed=s)`` all is bit-identical to a new environment with ``randomize`` and that seed. The ranges are a part of
        ``get_state()``, and ``set_state`` brings back those of then.

        Parameters
        ----------
        randomize : bool, str or mapping
            As the argument of ``gymnasium.make``: a word, or dotted names of parameters with (low, high), SI units.

        Raises
        ------
        ValueError
            Names what cannot be drawn, and what is allowed, as ``gymnasium.make`` does; then nothing has changed.
        NotImplementedError
            Of lanes on a device.

        Notes
        -----
        All lanes must be reset before the next step where something else changes with the ranges: the room for the largest
        latency of ``honest`` sensors, or a scenario of a user's own. Until then ``step`` raises ``RuntimeError``.

        Examples
        --------
        >>> import gymnasium as gym, birthsim_env
        >>> worlds = gym.make_vec("BirthSIM/Circle-v2", num_envs=2, randomize={"mechanics.mass": (3.0, 3.0)})
        >>> observations, infos = worlds.reset(seed=0)
        >>> worlds.set_ranges({"mechanics.mass": (2.0, 5.0)})
        >>> observations, infos = worlds.reset(seed=0)
        """
        self._episodes.set_ranges(randomize)

    @property
    def duration(self) -> float:
        """How long an episode is that nothing ends early, s."""
        return self._episodes.duration

    def scene_of(self, lane: int) -> Scene:
        """What a frame of a lane shows now, in any render mode; see ``birthsim_env.drawing.scene.Scene``."""
        return self._episodes.scene(lane)

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
