"""What an environment is in a table, and the code of what it is made of."""

import inspect

import gymnasium

import agents  # noqa: F401  registers the ids with a controller inside
from _generate.tables import folded, table
from birthsim_env.assembly import DEFAULTS
from birthsim_env.parts.scenarios import Scenario, environment_id, find_scenario


def environment(scenario: str) -> str:
    """What an environment is in a table, and what it is made of."""
    name, made = environment_id(scenario), find_scenario(scenario)
    inside = environment_id(scenario, "Residual")
    facts = [
        ["id", f"`{name}`; `{inside}` has a controller inside, which the action corrects"],
        ["experiment", made.experiment],
        ["duration", f"{made.duration:g} s, {round(made.duration / DEFAULTS['policy_period'])} steps of 10 ms"],
        ["action", _space(name, "action_space")],
        ["action, controller inside", _space(inside, "action_space")],
        ["observation", _space(name, "observation_space")],
        ["observation, controller inside", _space(inside, "observation_space")],
    ]
    return f"{table(['what', 'value'], facts)}\n\n{_source(made)}"


def _source(made: Scenario) -> str:
    said = "In SI units, as it stands (`nominal`) and as `randomize` draws it (`varied`, pairs are ranges):"
    return folded("What it is made of", f"{said}\n\n```py\n{inspect.getsource(type(made)).rstrip()}\n```")


def _space(name: str, space: str) -> str:
    env = gymnasium.make(name)
    shown = f"`{getattr(env, space)}`"
    env.close()
    return shown
