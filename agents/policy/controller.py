"""A trained residual as a controller: what the environments do inside, from measurements alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from agents.policy.files import load_policy
from agents.policy.seeds import best_policy
from agents.residual.law import ResidualLaw, observation_names
from agents.residual.settings import ResidualSettings
from birthsim_env import observation
from birthsim_env.assembly import policy_periods
from birthsim_env.parts.signals import Mask, Measurement, Reference, one_lane
from birthsim_env.physics.lanes import Array, parameter_column
from birthsim_env.physics.parameters import Parameters, load_parameters


def observation_size(settings: ResidualSettings) -> int:
    """Length of what a policy with these settings sees."""
    return len(observation_names(settings))


class ResidualController:
    """The law with a trained policy on top: the policy is asked every policy period, the law at every call.

    ``policy`` is a folder that ``birthsim-train`` wrote, or the name of a policy that comes with the package; of several
    training seeds the one that did best in validation runs. Raises ``ValueError`` for a damaged or foreign one.
    """

    def __init__(self, parameters: Parameters | str | Path | None = None, policy: str | Path = "circle") -> None:
        rig = load_parameters(parameters)
        self._policy = load_policy(best_policy(policy))
        settings, network = self._policy.settings, self._policy.network
        expected = observation_size(settings)
        if network.inputs != expected or network.outputs != settings.size:
            raise ValueError(
                f"policy = {str(policy)!r} maps {network.inputs} to {network.outputs} numbers; "
                f"allowed: {expected} to {settings.size}"
            )
        self._nominal = parameter_column(rig)
        self._periods = policy_periods(settings.policy_period, rig)
        self._law = ResidualLaw(rig, settings)
        self.reset()

    def reset(self, lanes: Mask | None = None) -> None:
        """Forget the past of all lanes, or of those where ``lanes`` (N,) is True."""
        if lanes is None:
            self._calls = 0
            self._action: Array = np.zeros((self._policy.settings.size, 0))
        elif self._action.shape[1]:
            self._action[:, lanes] = 0.0
            self._law.reset(lanes)

    def command(self, measurement: Measurement, reference: Reference) -> Array:
        """Spool openings of one control period: (4, N) for signals over N lanes, (4,) for one rig without lanes."""
        if measurement.position.ndim == 1:
            return self.command(*one_lane(measurement, reference))[:, 0]
        lanes = measurement.position.shape[1]
        if self._action.shape[1] != lanes:
            self._action = np.zeros((len(self._action), lanes))
            self._law.reset(np.ones(lanes, dtype=np.bool_))
        if self._calls % self._periods == 0:
            beside = np.concatenate([self._action, self._law.memory()])
            seen = observation.observe(measurement, reference, beside, self._nominal)
            self._action = np.ascontiguousarray(self._policy.network.actions(seen).T, dtype=np.float64)
            self._law.accept(self._action)
        self._calls += 1
        return self._law.command(measurement, reference)
