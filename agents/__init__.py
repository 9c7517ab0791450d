"""Residual policies on top of the published control law.

Importing this package registers ``BirthSIM/CircleResidual-v0`` and its siblings for the other scenarios.
"""

from gymnasium.envs.registration import register, registry

from birthsim_env.scenarios import SCENARIOS

for _scenario in SCENARIOS:
    _id = f"BirthSIM/{_scenario.capitalize()}Residual-v0"
    if _id not in registry:
        register(
            _id,
            entry_point="agents.residual_env:ResidualEnv",
            vector_entry_point="agents.residual_env:ResidualVectorEnv",
            kwargs={"scenario": _scenario},
        )
