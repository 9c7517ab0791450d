"""A trained residual as a controller: what the environments do inside, from measurements alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from agents.policy_files import load_policy
from agents.residual_law import ResidualLaw
from birthsim_env import observation
from birthsim_env.assembly import policy_periods
from birthsim_env.lanes import Array, parameter_column
from birthsim_env.parameters import Parameters, load_parameters
from birthsim_env.signals import Mask, Measurement, Reference, one_lane


class ResidualController:
    """The law with a trained policy on top: the policy is asked every policy period, the law at every call.

    ``policy`` is a folder that ``birthsim-train`` wrote. Raises ``ValueError`` for a damaged or foreign one.
    """

    def __init__(self, parameters: Parameters | str | Path | None = None, policy: str | Path = "policy") -> None:
        rig = load_parameters(parameters)
        self._policy = load_policy(policy)
        expected = observation.SIZE + 2
        if self._policy.network.inputs != expected or self._policy.network.outputs != 2:
            shape = (self._policy.network.inputs, self._policy.network.outputs)
            raise ValueError(f"policy = {str(policy)!r} maps {shape[0]} to {shape[1]} numbers; allowed: {expected} to 2")
        self._nominal = parameter_column(rig)
        self._periods = policy_periods(self._policy.settings.policy_period, rig)
        self._law = ResidualLaw(rig, self._policy.settings)
        self.reset()

    def reset(self, lanes: Mask | None = None) -> None:
        """Forget the past of all lanes, or of those where ``lanes`` (N,) is True."""
        self._law.reset(lanes)
        if lanes is None:
            self._calls = 0
            self._action: Array = np.zeros((2, 0))
        elif self._action.shape[1]:
            self._action[:, lanes] = 0.0

    def command(self, measurement: Measurement, reference: Reference) -> Array:
        """Spool openings of one control period: (4, N) for signals over N lanes, (4,) for one rig without lanes."""
        if measurement.position.ndim == 1:
            return self.command(*one_lane(measurement, reference))[:, 0]
        lanes = measurement.position.shape[1]
        if self._action.shape[1] != lanes:
            self._action = np.zeros((2, lanes))
        if self._calls % self._periods == 0:
            seen = observation.observe(measurement, reference, self._action, self._nominal)
            self._action = np.ascontiguousarray(self._policy.network.actions(seen).T, dtype=np.float64)
            self._law.accept(self._action)
        self._calls += 1
        return self._law.command(measurement, reference)
