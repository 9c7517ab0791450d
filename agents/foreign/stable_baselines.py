"""Models of Stable-Baselines3 as policies: deterministic actions, with the statistics of ``VecNormalize`` and with a memory.

An archive is read by Stable-Baselines3's own loader, which unpickles parts of it. **An archive, and a file of ``VecNormalize``,
may therefore run code of whoever made it.** Nothing else of it is run here.
"""

import os
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from birthsim_env.extras import installation
from birthsim_env.loop.signals import Mask
from birthsim_env.physics.rig.json_reading import parse_json
from birthsim_env.physics.rig.reading import named
from birthsim_env.physics.rig.values import problem, shown

SUFFIX = ".zip"

ALLOWED = "allowed: an archive that save() of PPO, SAC, TQC or RecurrentPPO wrote"

MOST = 2**26
"""Bytes of settings that are read: those of 64 lanes have some 10^4."""

_ROLLOUT, _BUFFER = {"n_steps": 2, "batch_size": 2}, {"buffer_size": 1}
SMALL = {"PPO": _ROLLOUT, "RecurrentPPO": _ROLLOUT, "SAC": _BUFFER, "TQC": _BUFFER}
"""What is set instead of what an archive says, so that no room is made for data of training."""

UNUSED = ("lr_schedule", "clip_range", "clip_range_vf", "action_noise", "ep_info_buffer", "ep_success_buffer", "_last_obs")
"""What of an archive is not unpickled: a policy that acts needs none of it."""


class ModelPolicy:
    """Observations (N, D) -> deterministic actions (N, n) of a ``model``, which sees what a ``VecNormalize`` with its
    ``statistics`` makes of them; None where it sees them as they are."""

    def __init__(self, model: Any, statistics: Any = None) -> None:
        self.model, self.statistics = model, statistics
        self._state: Any = None
        self._begins: NDArray[np.bool_] = np.ones(0, dtype=np.bool_)

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[Any]:
        lanes = len(observation)
        if len(self._begins) != lanes:
            self._state, self._begins = None, np.ones(lanes, dtype=np.bool_)
        seen = observation if self.statistics is None else self.statistics.normalize_obs(observation)
        actions, self._state = self.model.predict(seen, state=self._state, episode_start=self._begins, deterministic=True)
        self._begins = np.zeros(lanes, dtype=np.bool_)
        return np.asarray(actions)

    def reset(self, lanes: Mask | None = None) -> None:
        """Forget the past of all lanes, or of those where the mask (N,) is True."""
        if lanes is None:
            self._begins = self._begins[:0]
        else:
            self._begins = self._begins | lanes


def is_model(policy: Any) -> bool:
    """Whether an object looks like a model of Stable-Baselines3."""
    return all(hasattr(policy, name) for name in ("predict", "observation_space", "action_space", "get_vec_normalize_env"))


def policy_of_model(model: Any, name: str, spaces: tuple[int, int]) -> ModelPolicy:
    """A model as a policy, with the statistics of its ``VecNormalize`` where it was trained in one; ``ValueError`` where its
    ``spaces``, lengths of observation and action, are others."""
    check_spaces(model, name, spaces)
    statistics = model.get_vec_normalize_env()
    return ModelPolicy(model, None if statistics is None or not statistics.norm_obs else statistics)


def read_archive(path: Path, spaces: tuple[int, int] | None = None, statistics: Path | None = None) -> ModelPolicy:
    """The policy of an archive, with the ``statistics`` that ``VecNormalize.save`` wrote; ``ValueError`` for what is none, for
    other ``spaces`` than those given, and where Stable-Baselines3 is missing."""
    kind = algorithm_in(path)
    try:
        algorithm = _algorithms()[kind]
    except ImportError as error:
        raise ValueError(f"{error}; policy = {named(path)} needs {installation('agents')}") from error
    instead = dict.fromkeys(UNUSED) | {"lr_schedule": _zero, "clip_range": _zero, "tensorboard_log": None} | SMALL[kind]
    try:
        model = algorithm.load(path, device="cpu", custom_objects=instead)
    except Exception as error:  # whatever stands in it
        raise ValueError(f"policy = {named(path)} cannot be loaded ({problem(error)}); {ALLOWED}") from error
    if spaces is not None:
        check_spaces(model, named(path), spaces)
    return ModelPolicy(model, None if statistics is None else _statistics(statistics, model.observation_space.shape))


def settings_in(path: Path) -> dict[str, Any]:
    """Settings of an archive, of which nothing is unpickled; ``ValueError`` for what is none."""
    if not os.path.isfile(path):
        raise ValueError(f"policy = {named(path)} does not exist; {ALLOWED}")
    try:
        with zipfile.ZipFile(path) as archive, archive.open("data") as data:
            settings: dict[str, Any] = parse_json("data", data.read(MOST), dict, finite=False)
    except Exception as error:  # of zipfile, zlib and the reader of JSON
        raise ValueError(f"policy = {named(path)} is no archive of Stable-Baselines3 ({problem(error)}); {ALLOWED}") from error
    return settings


def algorithm_in(path: Path) -> str:
    """Which algorithm made an archive, by the names of its settings; ``ValueError`` for another."""
    settings = settings_in(path)
    if "clip_range" in settings:
        kinds = [settings.get(name) for name in ("policy_class", "rollout_buffer_class")]
        recurrent = any("recurrent" in str(one.get("__module__", "")) for one in kinds if isinstance(one, Mapping))
        return "RecurrentPPO" if recurrent else "PPO"
    if "target_entropy" in settings:
        return "TQC" if "top_quantiles_to_drop_per_net" in settings else "SAC"
    raise ValueError(f"policy = {named(path)} is of another algorithm; {ALLOWED}")


def check_spaces(model: Any, name: str, spaces: tuple[int, int]) -> None:
    """``ValueError`` where a model observes or gives other numbers than an environment has."""
    has = tuple(getattr(space, "shape", None) for space in (model.observation_space, model.action_space))
    wanted = tuple((length,) for length in spaces)
    if has != wanted:
        allowed = f"allowed: {wanted[0]} and {wanted[1]}, as the environment has"
        raise ValueError(f"policy = {name} observes {has[0]} and gives {has[1]}; {allowed}")


@contextmanager
def one_thread() -> Iterator[None]:
    """Within it PyTorch has one thread: more take longer for small networks."""
    try:
        import torch
    except ImportError:
        yield
        return
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def _algorithms() -> dict[str, Any]:
    from sb3_contrib import TQC, RecurrentPPO
    from stable_baselines3 import PPO, SAC

    return {"PPO": PPO, "SAC": SAC, "TQC": TQC, "RecurrentPPO": RecurrentPPO}


def _zero(_: float) -> float:
    return 0.0


def _statistics(path: Path, shape: tuple[int, ...]) -> Any:
    """What ``VecNormalize.save`` wrote, of observations of a ``shape``."""
    allowed = "allowed: a file that save() of VecNormalize wrote"
    from stable_baselines3.common.save_util import load_from_pkl  # late: it takes seconds

    try:
        statistics: Any = load_from_pkl(path)
        has = np.shape(statistics.obs_rms.mean)
        statistics.normalize_obs(np.zeros(has, dtype=np.float32))
    except OSError as error:
        raise ValueError(f"normalize = {named(path)} cannot be read ({error.strerror}); {allowed}") from error
    except Exception as error:  # whatever stands in it
        raise ValueError(f"normalize = {named(path)} cannot be loaded ({problem(error)}); {allowed}") from error
    if has != shape:
        raise ValueError(f"normalize = {named(path)} has statistics of {shown(has)} numbers; allowed: {shape}")
    return statistics
