"""What environments of one kind of rig promise: actions, observations, reward, end, arguments, info."""

import inspect
import re
from typing import Any

import gymnasium

from _generate.tables import folded, table
from birthsim_env import observation, reward
from birthsim_env.assembly import DEFAULTS
from birthsim_env.env import BirthSIMEnv
from birthsim_env.info import FIELDS
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.rig.topology import RAIL, TWO_CYLINDERS
from birthsim_env.registry import entries

LINKAGES = {"plane": TWO_CYLINDERS, "rail": RAIL}
"""What the contract of its environments is called -> ``linkage.kind`` of their rigs."""

ALONG = "\n\nOn a rail the single error and speed along it take the place of the sums over x and y."


def contract(linkage: str) -> str:
    """What environments of one kind of rig promise: actions, observations, reward, end, arguments, info."""
    scenario = next(one.name for one in entries("scenario") if one.made.linkage == LINKAGES[linkage])
    name = environment_id(scenario)
    parts = [
        _actions(name, linkage),
        _observation(name),
        f"## Reward\n\n{_said('Reward')}{ALONG if linkage == 'rail' else ''}",
        f"## Start and end of an episode\n\n{_said('Start and end of an episode')}",
        f"## Arguments\n\n{folded('Every argument of `gym.make`, and its default', _arguments())}",
        f"## Info\n\n{_said('Info')}\n\n{folded('Every key of `info`', _info())}",
    ]
    return "\n\n".join(parts)


def _actions(name: str, linkage: str) -> str:
    env: Any = gymnasium.make(name)
    acted = [one.removeprefix("last action: ") for one in env.unwrapped.observation_names if one.startswith("last action")]
    env.close()
    rows = [[str(k), one.removesuffix(", 1")] for k, one in enumerate(acted)]
    held = "Each entry, from -1 to 1, is held for 10 ms: 1 fills the chamber from the supply, -1 empties it."
    if linkage == "rail":
        more = "[What is different on a rail](../rail.md#what-is-different-on-a-rail) has the other modes."
    else:
        more = folded("Other modes: one valve per cylinder, mass flows instead of openings", _said("Action space"))
    return f"## Action\n\n{held}\n\n{table(['index', 'entry'], rows)}\n\n{more}"


def _observation(name: str) -> str:
    env: Any = gymnasium.make(name)
    shown = observation.entries_of(env.unwrapped.simulation.parameters)
    scales = [f"{one.scale:g} {one.unit}".replace("1 half strokes", "half a stroke") for one in shown]
    rows = [[str(k), one.name, scale] for k, (one, scale) in enumerate(zip(shown, scales, strict=True))]
    more = len(env.unwrapped.observation_names) - len(rows)
    env.close()
    rows.append([f"{len(rows)} to {len(rows) + more - 1}", "last action", "1"])
    about = f"Each entry is what the [sensors](sensors.md) say, divided by its scale and clipped to ±{observation.LIMIT:g}."
    return f"## Observation\n\n{about}\n\n{table(['index', 'entry', 'value that maps to 1'], rows)}"


def _said(title: str) -> str:
    """A section of the environment's docstring."""
    text = inspect.getdoc(BirthSIMEnv) or ""
    return re.split(r"^## ", text.partition(f"## {title}\n")[2], maxsplit=1, flags=re.MULTILINE)[0].strip()


def _arguments() -> str:
    defaults = ", ".join(f"`{name}={value!r}`" for name, value in DEFAULTS.items())
    return f"{_said('Arguments')}\n\nDefaults: {defaults}."


def _info() -> str:
    rows = [[f"`{name}`", str(size), words] for name, (size, words) in FIELDS.items()]
    rows += [[f"`{name}`", "1", "term of the reward"] for name in reward.REWARD_TERMS]
    rows.append(["`is_success`", "1", "settled error below 1 mm so far, and not terminated"])
    return table(["key", "numbers", "unit and meaning"], rows)
