"""Stable-Baselines3's ``VecEnv`` over a native vector environment with same-step autoreset."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv

from agents.training.sb3.lane_info import TRUNCATED, LaneInfo, lane_values
from birthsim_env.face import measurement_of
from birthsim_env.loop.signals import Reference
from birthsim_env.restored import FLOATS, Kept
from birthsim_env.state import State

KEPT = {"returns": FLOATS, "lengths": Kept(0, whole=True)}
"""What a state has of the episodes so far."""


SET_RANGES = "set_ranges"
"""What Stable-Baselines3 may call, of all lanes together."""

LANE_ATTRIBUTES: dict[str, Callable[[Any, int], Any]] = {
    "action_space": lambda env, _: env.single_action_space,
    "observation_space": lambda env, _: env.single_observation_space,
    "measurement": lambda env, lane: measurement_of(env.unwrapped.measurement, lane),
    "reference": lambda env, lane: Reference(env.unwrapped.reference.rows[:, lane]),
    "scene": lambda env, lane: env.unwrapped.scene_of(lane),
}
"""What differs from lane to lane, or is another thing of one lane than of all."""


def _shared(info: dict[str, Any]) -> dict[str, Any]:
    """What is told of all lanes at this instant, without masks and what episodes ended with."""
    return {name: values for name, values in info.items() if name[0] != "_" and name not in ("final_info", "final_obs")}


class SB3VecEnv(VecEnv):
    """Makes ``gymnasium.make_vec(id, num_envs=N, autoreset_mode="SameStep")`` usable by Stable-Baselines3, also in wrappers
    of Gymnasium that work with that mode (docs/how-to/wrappers.md).

    ``infos[i]`` has what a single environment tells, such as ``cost``. When the episode of lane i ends, ``infos[i]["episode"]``
    has its return and length besides, and ``infos[i]["terminal_observation"]`` its last observation, as with
    Stable-Baselines3's own wrappers. ``seconds`` is the time
    spent in ``steps`` of the environment. ``staggered`` spreads the lanes over the episode, as ``BirthSIMVectorEnv.reset``
    says. An on-policy algorithm with rollouts shorter than an episode needs that.
    """

    def __init__(self, env: Any, staggered: bool = False) -> None:
        if env.metadata.get("autoreset_mode") is not AutoresetMode.SAME_STEP:
            raise ValueError(f"env = {env!r}; allowed: of gymnasium.make_vec, one made with autoreset_mode='SameStep'")
        self.env = env
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)
        self.seconds, self.steps = 0.0, 0
        self._staggered = staggered
        self._returns = np.zeros(env.num_envs)
        self._lengths = np.zeros(env.num_envs, dtype=np.int64)
        self._actions: NDArray[Any] = np.zeros((env.num_envs, *env.single_action_space.shape))

    def reset(self) -> NDArray[np.float32]:
        """Start all lanes; seeds given by ``seed`` count once."""
        seeds = list(self._seeds) if any(seed is not None for seed in self._seeds) else None
        observation, info = self.env.reset(seed=seeds, options={"staggered": True} if self._staggered else None)
        shared = _shared(info)
        self.reset_infos = [LaneInfo(shared, lane) for lane in range(self.num_envs)]
        self._reset_seeds()
        self._reset_options()
        self._returns[:] = 0
        self._lengths[:] = 0
        return np.asarray(observation)

    def step_async(self, actions: NDArray[Any]) -> None:
        self._actions = actions

    def step_wait(self) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """One step of all lanes."""
        started = time.perf_counter()
        observation, rewards, terminated, truncated, info = self.env.step(self._actions)
        self.seconds += time.perf_counter() - started
        self.steps += 1
        self._returns += rewards
        self._lengths += 1
        shared, ended = _shared(info), terminated | truncated
        infos: list[dict[str, Any]] = [LaneInfo(shared, lane) for lane in range(self.num_envs)]
        for lane in np.flatnonzero(ended).tolist():
            self.reset_infos[lane] = infos[lane]
            infos[lane] = {
                **lane_values(_shared(info["final_info"]), lane),
                "terminal_observation": info["final_obs"][lane],
                TRUNCATED: bool(truncated[lane]),
                "episode": {"r": float(self._returns[lane]), "l": int(self._lengths[lane])},
            }
        self._returns[ended] = 0
        self._lengths[ended] = 0
        return observation, rewards.astype(np.float32), ended, infos

    def get_state(self) -> State:
        """``get_state()`` of the environment, which knows of no wrapper, and the returns and lengths of the episodes so far."""
        return {**self.env.unwrapped.get_state(), "returns": self._returns.copy(), "lengths": self._lengths.copy()}

    def set_state(self, state: State) -> None:
        """Go on from what ``get_state`` returned; ``ValueError`` for the state of another environment."""
        own = {"returns": self._returns, "lengths": self._lengths}
        for name, array in own.items():
            if complaint := KEPT[name].complaint(array, state.get(name), np.inf):
                raise ValueError(f"state: {name!r} {complaint}")
        self.env.unwrapped.set_state({name: value for name, value in state.items() if name not in own})
        for name, array in own.items():
            array[:] = state[name]

    def close(self) -> None:
        self.env.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """One value for each lane asked for, as a single environment has it; else one that all lanes share.

        Raises ``AttributeError`` for what neither has."""
        lanes = list(self._get_indices(indices))
        if attr_name in LANE_ATTRIBUTES:
            return [LANE_ATTRIBUTES[attr_name](self.env, lane) for lane in lanes]
        return [getattr(self.env if hasattr(self.env, attr_name) else self.env.unwrapped, attr_name)] * len(lanes)

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        raise NotImplementedError(
            f"set_attr({attr_name!r}): the lanes share one environment; make it with other arguments, or call "
            f"env_method({SET_RANGES!r}, ...)"
        )

    def env_method(self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any) -> list[Any]:
        """``env_method("set_ranges", randomize)``: what all lanes draw from their next episodes on.

        Raises ``NotImplementedError`` for other methods and for some of the lanes.
        """
        lanes = list(self._get_indices(indices))
        if method_name != SET_RANGES or len({*lanes}) < self.num_envs:
            raise NotImplementedError(
                f"env_method({method_name!r}) of {len(lanes)} lanes: the lanes share one environment; allowed: "
                f"{SET_RANGES!r} of all {self.num_envs}; call others on .env"
            )
        self.env.unwrapped.set_ranges(*method_args, **method_kwargs)
        return [None] * len(lanes)

    def env_is_wrapped(self, wrapper_class: type[gymnasium.Wrapper[Any, Any, Any, Any]], indices: Any = None) -> list[bool]:
        return [False] * len(list(self._get_indices(indices)))

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """Frames of all lanes, in render mode ``rgb_array``."""
        frames = self.env.render()
        return list(frames) if frames is not None else [None] * self.num_envs
