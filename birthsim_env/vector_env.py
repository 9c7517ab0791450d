"""The native vector environment: N lanes of one scenario in one kernel call."""

from typing import Any, Unpack

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from birthsim_env.assembly import RENDER_MODES, Arguments, one_of, spelled_out
from birthsim_env.episodes import Episodes
from birthsim_env.face import Face
from birthsim_env.info import vector_info
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.plant import MOST_LANES
from birthsim_env.physics.rig.arrays import shape_of
from birthsim_env.physics.rig.values import checked_count, shown, whole_of
from birthsim_env.registry import entry
from birthsim_env.reward import REWARD_TERMS

Observations = NDArray[np.float32]


class BirthSIMVectorEnv(Face, VectorEnv[Observations, NDArray[Any], NDArray[Any]]):
    """``num_envs`` lanes of a scenario, made by ``gymnasium.make_vec(id, num_envs=N)``.

    A lane is one rig. Actions, observations, rewards, arguments and episode ends are those of ``BirthSIMEnv``, per lane; arrays
    carry the lane first. ``reset(seed=s)`` seeds lane i with s + i; a list gives every lane its own seed. A lane gives the same
    numbers, to the last bit, as a single environment with its seed. ``max_episode_steps`` shortens episodes.

    With ``device="cuda"`` the lanes live on an NVIDIA GPU, with the same bits, and so do all arrays that are returned. They are
    CuPy's, which PyTorch and JAX take by DLPack without a copy. Actions may be NumPy's, or be there. New episodes are drawn
    there too, so that a part of a user's own may not draw in Python. ``device="host"`` runs a GPU's code on this processor.

    ``autoreset_mode`` says what happens to a lane that ends, as in Gymnasium (``AutoresetMode`` or its value):
    - ``NEXT_STEP`` (default): the next step ignores its action and returns the first observation of its new episode, reward 0;
    - ``SAME_STEP``: it starts anew within the same step; ``infos["final_obs"]`` and ``infos["final_info"]`` hold what it ended
      with;
    - ``DISABLED``: it waits for ``reset(options={"reset_mask": mask})`` with a mask (num_envs,) of bool.
    """

    @spelled_out()
    def __init__(
        self,
        scenario: str,
        num_envs: int = 1,
        render_mode: str | None = None,
        max_episode_steps: int | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        device: str = "cpu",
        **arguments: Unpack[Arguments],
    ) -> None:
        num_envs = checked_count("num_envs", num_envs, 1, MOST_LANES)
        most_steps = whole_of(-1 if max_episode_steps is None else max_episode_steps)
        if most_steps is None or (most_steps < 1 and most_steps != -1):
            given = shown(max_episode_steps)
            raise ValueError(f"max_episode_steps = {given}; allowed: None, -1 (no limit) or a whole number >= 1")
        self.render_mode = one_of("render_mode", render_mode, (None, *RENDER_MODES))
        try:
            self.autoreset_mode = AutoresetMode(autoreset_mode)
        except (ValueError, TypeError, RecursionError):  # the last from a list in a list in a list ...
            allowed = ", ".join(repr(mode.value) for mode in AutoresetMode)
            raise ValueError(f"autoreset_mode = {shown(autoreset_mode)}; allowed: {allowed}") from None
        made = entry("device", device).made
        if device != "cpu":
            one_of(f"render_mode, with device = {device!r},", render_mode, (None,))
        episodes: Episodes = made(num_envs, scenario, arguments)
        setup = episodes.setup
        self._show(episodes, autoreset_mode=self.autoreset_mode)
        self.num_envs = num_envs
        self.single_observation_space, self.single_action_space = setup.single_observation_space, setup.single_action_space
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.steps = min(setup.steps, most_steps if most_steps > 0 else setup.steps)
        self._ended: NDArray[np.bool_] = self._episodes.arrays.zeros(self.num_envs, dtype=np.bool_)

    @property
    def measurement(self) -> Measurement:
        """What the sensors say now, over the lanes: the input of a controller."""
        return self._episodes.measurement

    @property
    def reference(self) -> Reference:
        """What is asked for now, over the lanes: the other input of a controller."""
        return self._episodes.reference

    @property
    def plant_state(self) -> Array:
        """State of the plant, (18, num_envs), with the rows of ``STATE_NAMES``, SI units."""
        return self._episodes.plant_state

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Start new episodes in all lanes. ``options["position"]`` (x, y), m, starts the end effector there, at rest.

        Where ``options["staggered"]`` is true, lane i's first episode is truncated i/N of its steps early. From then on the
        lanes are at different moments of their episodes. A learner that sees all lanes at the same moment forgets the others.
        """
        super().reset(seed=whole_of(seed))
        options = dict(options or {})
        lanes = self._mask(options.pop("reset_mask", None))
        staggered = options.pop("staggered", False)
        if not isinstance(staggered, bool):
            raise ValueError(f"options['staggered'] = {shown(staggered)}; allowed: True or False")
        self._episodes.seed(seed, self.np_random)
        self._episodes.begin(lanes, options)
        arrays = self._episodes.arrays
        self._ended = self._ended & ~arrays.asarray(lanes)
        if staggered:
            self._episodes.elapsed[:] = arrays.arange(self.num_envs) * self.steps // self.num_envs
        terms = {name: arrays.zeros(self.num_envs) for name in REWARD_TERMS}
        success = self._episodes.success
        return self._episodes.observation(), {**vector_info(self._episodes.describe()), **terms, "is_success": success}

    def _mask(self, mask: Any) -> NDArray[np.bool_]:
        """The lanes to reset: all, or those of ``options["reset_mask"]``."""
        if mask is None:
            return np.ones(self.num_envs, dtype=np.bool_)
        listed = isinstance(mask, (np.ndarray, list, tuple)) and shape_of(mask) == (self.num_envs,)
        lanes = np.asarray(mask if listed else None)
        if lanes.dtype != np.bool_ or not lanes.any():
            raise ValueError(f"options['reset_mask'] = {shown(mask)}; allowed: ({self.num_envs},) of bool, at least one True")
        return lanes

    def step(self, actions: NDArray[Any]) -> tuple[Observations, Array, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """One policy step of all lanes; raises ``ValueError`` for actions that are not (num_envs, size) numbers in [-1, 1]."""
        episodes = self._episodes
        if self.autoreset_mode is AutoresetMode.DISABLED and self._ended.any():
            raise ValueError(
                f"lanes {np.flatnonzero(self._ended).tolist()} have ended; allowed: reset(options={{'reset_mask': ...}})"
            )
        reward_terms, terminated = episodes.step(episodes.columns(actions))
        if self._ended.any():
            # They have begun when they ended, so that nothing that is lost is integrated further; their first step is undone.
            episodes.begin(self._ended, again=True)
            reward_terms[:, self._ended] = 0.0
            terminated = terminated & ~self._ended
        rewards, terms = reward_terms[-1], dict(zip(REWARD_TERMS, reward_terms, strict=False))
        truncated = (episodes.elapsed >= self.steps) & ~terminated
        observation = episodes.observation()
        infos: dict[str, Any] = {**vector_info(episodes.describe()), **terms, "is_success": episodes.success}
        ended = terminated | truncated
        self._ended = ended if self.autoreset_mode is not AutoresetMode.SAME_STEP else self._ended
        if self.autoreset_mode is AutoresetMode.NEXT_STEP and ended.any():
            episodes.begin(ended)
        if self.autoreset_mode is AutoresetMode.SAME_STEP and ended.any():
            last, final = observation, infos
            episodes.begin(ended)
            observation = episodes.observation()
            # The signals of this instant are those of the new episodes; the reward still belongs to the ended step.
            infos = {**vector_info(episodes.describe()), **terms, "is_success": episodes.success}
            infos["final_info"] = {**final, **{f"_{name}": ended for name in final}}
            infos["final_obs"] = np.full(self.num_envs, None, dtype=object)
            for lane in np.flatnonzero(episodes.local(ended)):
                infos["final_obs"][lane] = last[lane]
            infos["_final_obs"] = infos["_final_info"] = ended
        return observation, rewards, terminated, truncated, infos

    def render(self) -> tuple[Any, ...] | None:
        """A frame of every lane (``rgb_array``), or lane 0 in a window (``human``)."""
        if self.render_mode is None:
            return None
        return self._episodes.render(self.render_mode, self.num_envs if self.render_mode == "rgb_array" else 1)

    def close_extras(self, **kwargs: Any) -> None:
        """Close the window, if there is one."""
        self._episodes.close()
