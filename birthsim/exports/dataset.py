"""``--to minari``: episodes of a controller as a Minari dataset for offline learning, with its card."""

import errno
import os
import re
import shutil
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import gymnasium
import numpy as np
from cyclopts import Parameter
from numpy.typing import NDArray

from baselines.named import make_controller
from birthsim.command_line.settings import EPISODES, WORLD, Configured, Env, Seed, whole
from birthsim.command_line.worlds import check_environment, policy_of
from birthsim.exports import Form
from birthsim_env import __version__, normalized_return, reference_returns
from birthsim_env.files import make_folder, whole_folder, write_text
from birthsim_env.ids import rig_for
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.registry import register
from birthsim_env.scores import is_scored

PERIOD = 0.005
"""s: an action is held so long. The normalised return of `admittance` is 87 to 100 with it, and 53 to 88 with 10 ms."""

NOISE = 0.2
"""Standard deviation of what is added to the expert's openings at the medium level; assumed."""

LEVELS = {"expert": "admittance", "medium": "admittance", "paper": "backstepping", "random": None}
"""Level -> controller that acts at 200 Hz."""

SPARE, OVERHEAD = 2**20, 1.5
"""Bytes of a dataset without episodes, and bytes of it per byte of their arrays; both more than was ever seen."""

LANES = 64
"""Episodes that run side by side."""


@dataclass(kw_only=True)
class Settings(Configured):
    """Record episodes on randomised rigs as a Minari dataset, which is named birthsim/ENV/LEVEL-v0, and write its card.

    expert is the controller admittance, medium the same with noise on its actions, paper the paper's controller; random
    actions are uniform. An action is held for 5 ms. minari.load_dataset finds the dataset where MINARI_DATASETS_PATH names the
    folder.
    """

    to: Literal["minari"]
    """Form of the dataset."""
    env: Env = "BirthSIM/Circle-v2"
    level: Annotated[Literal["expert", "medium", "paper", "random"], Parameter(group=WORLD)] = "expert"
    """Who acts."""
    episodes: Annotated[int, whole(1, EPISODES)] = 100
    """Recorded; their seeds begin with --seed."""
    seed: Seed = 0
    """Of the first episode."""
    out: Path
    """Folder for datasets, each in a folder of its own."""


@dataclass(frozen=True)
class Recorded:
    """An episode: T actions and rewards, T + 1 observations; whether it ended before its time."""

    seed: int
    observations: NDArray[np.float32]
    actions: NDArray[np.float32]
    rewards: Array
    terminated: bool


def main(settings: Settings) -> None:
    """Record, and say what the dataset is worth."""
    try:
        import minari
        from minari.data_collector import EpisodeBuffer
    except ImportError as error:
        raise ValueError(f"{error}; a dataset needs pip install 'minari[hdf5]'") from error
    check_environment(settings.env)
    out, name = make_folder(settings.out).resolve(), f"birthsim/{policy_of(settings.env)}/{settings.level}-v0"
    if (out / name).exists():
        raise ValueError(f"--out {str(settings.out)!r} has {name} already; allowed: another folder")
    scores: dict[str, float] = {}
    if is_scored(settings.env):
        known = reference_returns(settings.env)
        scores = {"ref_min_score": known["shut valves"]["return"], "ref_max_score": known["best classical law"]["return"]}
    episodes = list(recorded(settings.env, settings.level, range(settings.seed, settings.seed + settings.episodes)))
    check_room(episodes, out)
    text = card(settings, name, episodes)
    buffers = [
        EpisodeBuffer(
            k, one.seed, None, one.observations, one.actions, list(one.rewards), *ends(one.terminated, len(one.rewards))
        )
        for k, one in enumerate(episodes)
    ]
    with whole_folder(out, name) as place, disk_errors(settings.out / name), warnings.catch_warnings():
        os.environ["MINARI_DATASETS_PATH"] = str(place)
        warnings.simplefilter("ignore", UserWarning)  # of an author without an address
        minari.create_dataset_from_buffers(
            name,
            buffers,
            made(settings.env, gymnasium.make),
            algorithm_name=LEVELS[settings.level] or "uniform actions",
            author="The BirthSIM developers",
            description=text,
            requirements=[f"birthsim=={__version__}"],
            **scores,
        )
        write_text(place / name / "README.md", text)
    print(text)
    print(f"written to {settings.out / name}/")


register(export="minari", about="episodes of a controller, for offline learning", order=12)(
    Form(Settings, main, "--level expert --out datasets")
)


def check_room(episodes: list[Recorded], folder: Path) -> None:
    """``OSError`` where a disk has no room for the episodes: HDF5 ends the process there, with a fault of memory."""
    arrays = (array for one in episodes for array in (one.observations, one.actions, one.rewards))
    if shutil.disk_usage(folder).free < SPARE + OVERHEAD * sum(array.nbytes for array in arrays):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(folder))


@contextmanager
def disk_errors(dataset: Path) -> Iterator[None]:
    """What HDF5 says of a full or broken disk, over several lines and as a ``RuntimeError``, becomes the system's own error."""
    try:
        yield
    except (OSError, RuntimeError) as error:
        found = re.search(r"errno = (\d+)", str(error))
        number = int(found[1]) if found else getattr(error, "errno", None)
        if number is None:
            raise
        raise OSError(number, os.strerror(number), str(dataset)) from error


def made(environment: str, make: Any, **arguments: Any) -> Any:
    """The environment of the datasets."""
    return make(environment, randomize=True, policy_period=PERIOD, **arguments)


def ends(terminated: bool, steps: int) -> tuple[list[bool], list[bool]]:
    """Per step whether the episode terminated, and whether it was truncated."""
    last = [*[False] * (steps - 1), True]
    return (last, [False] * steps) if terminated else ([False] * steps, last)


def recorded(environment: str, level: str, seeds: range) -> Iterator[Recorded]:
    """The episodes of these seeds."""
    for first in range(0, len(seeds), LANES):
        yield from _batch(environment, level, list(seeds[first : first + LANES]))


def _batch(environment: str, level: str, seeds: list[int]) -> Iterator[Recorded]:
    env = made(environment, gymnasium.make_vec, num_envs=len(seeds))
    name, generators = LEVELS[level], [np.random.default_rng([seed, 1]) for seed in seeds]
    rig = rig_for(environment, None)
    driven = list(rig.linkage.topology.chambers)
    law = name and make_controller(name, rig.replace({"electronics.control_period": PERIOD}))
    seen: list[Any] = [env.reset(seed=seeds)[0]]
    acted, rewards, terminated, over = list[Any](), list[Any](), list[Any](), list[Any]()
    for _ in range(env.steps):
        if law:
            action = np.array(law.command(env.measurement, env.reference))[driven].T
            if level == "medium":
                action += NOISE * np.array([generator.standard_normal(action.shape[1]) for generator in generators])
        else:
            action = np.array([generator.uniform(-1.0, 1.0, env.single_action_space.shape) for generator in generators])
        acted.append(np.clip(action, -1.0, 1.0).astype(np.float32))
        observation, reward, terminated_now, cut, _ = env.step(acted[-1])
        for kept, one in ((seen, observation), (rewards, reward), (terminated, terminated_now), (over, terminated_now | cut)):
            kept.append(one)
        if law and terminated_now.any():
            law.reset(terminated_now)
    env.close()
    # A lane that has ended goes on with another episode, which nobody asked for.
    for lane, (seed, steps) in enumerate(zip(seeds, np.argmax(over, axis=0) + 1, strict=True)):
        yield Recorded(
            seed,
            np.array(seen)[: steps + 1, lane],
            np.array(acted)[:steps, lane],
            np.array(rewards)[:steps, lane],
            bool(terminated[steps - 1][lane]),
        )


def card(settings: Settings, name: str, episodes: list[Recorded]) -> str:
    """The dataset's card, in the format of the Hugging Face Hub."""
    returns = np.array([one.rewards.sum() for one in episodes])
    row = worth = ""
    if is_scored(settings.env):
        paid = np.asarray(normalized_return(settings.env, returns))
        low, high = np.quantile(paid, [0.05, 0.95])
        row = f"\n| normalised return, mean; 5th and 95th percentile | {paid.mean():.1f}; {low:.1f}, {high:.1f} |"
        best = "that of the best controller at 1 kHz (`ref_max_score`)"
        worth = f"A normalised return of 0 is that of shut valves (`ref_min_score`), 100 {best}.\n"
    who = {"expert": "The controller `admittance`", "paper": "The paper's controller", "random": "Uniform actions"}
    medium = f"The controller `admittance`, with Gaussian noise of {NOISE:g} on its actions,"
    return f"""---
license: mit
tags: [offline-rl, reinforcement-learning, gymnasium, minari, birthsim]
pretty_name: {name}
---

# {name}

{who.get(settings.level, medium)} in `{settings.env}` of BirthSIM {__version__}, on randomised rigs.
Actions open valves, and are held for {1e3 * PERIOD:g} ms.

| what | value |
|---|---|
| episodes; of them terminated | {len(episodes)}; {sum(one.terminated for one in episodes)} |
| steps | {sum(len(one.rewards) for one in episodes)} |
| return, mean | {returns.mean():.1f} |{row}

{worth}The data are simulated. They say nothing of a real rig or of a birth.

The seed of an episode starts it again in `gymnasium.make("{settings.env}", randomize=True, policy_period={PERIOD:g})`.

    birthsim export --to minari --env {settings.env} --level {settings.level} \\
      --episodes {len(episodes)} --seed {settings.seed} --out DIR
"""
