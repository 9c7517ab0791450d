"""Single episodes that a controller drives, and what is recorded of them."""

from collections.abc import Callable, Sequence
from typing import Any

import gymnasium
import numpy as np
from tqdm import tqdm

from baselines.driving import NO_ACTION, driving
from baselines.named import make_controller
from birthsim.command_line.worlds import policy_of
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters

BAR = "{desc}: {percentage:3.0f}%|{bar}| {n:.1f}/{total:g} s [{elapsed}<{remaining}]"
"""Progress in seconds of the episode."""


def driven(environment: str, controller: str, rig: Parameters, **arguments: Any) -> Any:
    """An environment in which a controller by name acts at every control period; ``residual`` has the policy shipped for it."""
    own = {"policy": policy_of(environment)} if controller == "residual" else {}
    law = driving(make_controller(controller, rig, **own), controller)
    period = rig.electronics.control_period
    return gymnasium.make(environment, parameters=rig, policy_period=period, actuation=law, **arguments)


def record(
    env: Any, seed: int, fields: Sequence[str], title: str, look: Callable[[int], object] = lambda _: None
) -> dict[str, Array]:
    """The ``fields`` of ``info`` at every control period of an episode, a row each, SI units, and ``lost``: True in the last
    row of one that ended before its time. ``look`` is called with the number of rows after each step. Closes ``env``."""
    _, info = env.reset(seed=seed)
    rows: dict[str, list[Any]] = {**{name: [np.copy(info[name])] for name in fields}, "lost": [False]}
    ended = False
    with tqdm(total=env.get_wrapper_attr("duration"), desc=title, unit=" s", bar_format=BAR, leave=False) as bar:
        while not ended:
            _, _, lost, truncated, info = env.step(NO_ACTION)
            for name in fields:
                rows[name].append(np.copy(info[name]))
            rows["lost"].append(lost)
            ended = lost or truncated
            look(len(rows["lost"]))
            if len(rows["lost"]) % 500 == 0:
                bar.update(float(info["time"]) - bar.n)
    env.close()
    return {name: np.array(kept) for name, kept in rows.items()}
