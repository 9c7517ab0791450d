"""The order of a control period, as an environment prints it."""

from typing import Any

import gymnasium

from baselines import make_controller
from baselines.driving import driving


def pipeline() -> str:
    """What ``print(env.unwrapped.pipeline)`` says of a circle with realistic sensors under the paper's controller."""
    actuation = driving(make_controller("backstepping"), None)
    env: Any = gymnasium.make("BirthSIM/Circle-v2", sensors="honest", actuation=actuation)
    return f"```text\n{env.unwrapped.pipeline}\n```"
