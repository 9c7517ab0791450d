"""The scenarios with the law inside: a policy adds a residual."""

from __future__ import annotations

from typing import Any

from agents.residual_law import ResidualActuation, ResidualSettings
from birthsim_env.env import BirthSIMEnv
from birthsim_env.parameters import load_parameters
from birthsim_env.vector_env import BirthSIMVectorEnv


class _LawInside:
    """Puts the law between the policy and the valves of the environment that it is mixed into."""

    def __init__(
        self,
        scenario: str,
        authority: float = ResidualSettings.authority,
        smoothing: float = ResidualSettings.smoothing,
        weight_compensation: bool = False,
        **arguments: Any,
    ) -> None:
        for name in ("action_mode", "valves", "actuation"):
            if name in arguments:
                raise ValueError(f"{name} = {arguments[name]!r}; allowed: not given, the law drives one valve per chamber")
        rig = load_parameters(arguments.pop("parameters", None))
        period = arguments.get("policy_period", ResidualSettings.policy_period)
        settings = ResidualSettings(authority, smoothing, period, weight_compensation)
        law = ResidualActuation(rig, settings)
        super().__init__(scenario, parameters=rig, actuation=law, **arguments)  # type: ignore[call-arg]


class ResidualEnv(_LawInside, BirthSIMEnv):
    """A scenario of ``BirthSIMEnv`` with the paper's backstepping law running inside at 1 kHz.

    ## Action space
    `Box(-1, 1, (2,), float32)`, held for one policy period: a force along cylinders 1 and 2, in units of `authority` (100 N),
    that is added to what the law believes acts on the piston, after a low-pass (`smoothing` = 0.3 per step, about 28 ms).
    A zero action is exactly the law.

    ## Observation space, reward, start, end and info
    Those of `BirthSIMEnv`; the observation's last two entries are the last action.

    ## Arguments
    Those of `BirthSIMEnv` without `action_mode` and `valves`, and `authority` (N), `smoothing` (0 to 1] and
    `weight_compensation`, which puts (14) back into the law.

    ## Version history
    - v0: first version.
    """


class ResidualVectorEnv(_LawInside, BirthSIMVectorEnv):
    """``ResidualEnv`` over N lanes in one kernel call per control period; see ``BirthSIMVectorEnv``."""
