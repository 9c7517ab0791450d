"""A trained residual as a controller: what the environments do inside, from measurements alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from agents.policy.files import load_policy
from agents.policy.seeds import best_policy
from agents.residual.law import ResidualLaw, observation_names
from agents.residual.settings import ResidualSettings
from baselines.impedance import Impedance
from birthsim_env import observation
from birthsim_env.assembly import policy_periods
from birthsim_env.loop.signals import Mask, Measurement, Reference, one_lane
from birthsim_env.physics.compiled.lanes import Array, parameter_column
from birthsim_env.physics.rig.parameters import Parameters, load_parameters

PolicyFunction = Callable[[NDArray[np.float32]], NDArray[np.floating]]
"""Actions (N, ``settings.size``) in [-1, 1] for observations (N, ``observation_size(settings)``). One that remembers also has
``reset(lanes)``, which forgets the past of all lanes (None) or of those where the mask (N,) is True."""


def observation_size(settings: ResidualSettings) -> int:
    """Length of what a policy with these settings sees."""
    return len(observation_names(settings))


class ResidualController:
    """The law with a policy on top: the policy is asked every policy period, the law at every call.

    ``policy`` is a folder that ``birthsim-train`` wrote, or the name of a policy that comes with the package. Of several
    training seeds the one that did best in validation runs. Raises ``ValueError`` for a damaged or foreign one. ``policy`` may
    also be any ``PolicyFunction``. Then ``settings`` say what it may do; a folder has its own settings.
    """

    def __init__(
        self,
        parameters: Parameters | str | Path | None = None,
        policy: str | Path | PolicyFunction = "circle",
        settings: ResidualSettings | None = None,
    ) -> None:
        rig = load_parameters(parameters)
        if callable(policy):
            self._policy, settings = policy, settings or ResidualSettings()
        elif settings is None:
            self._policy, settings = _stored(policy)
        else:
            raise ValueError(f"settings = {settings!r} beside policy = {str(policy)!r}; allowed: beside a function")
        self._nominal = parameter_column(rig)
        self._periods = policy_periods(settings.policy_period, rig)
        self._law, self._size = ResidualLaw(rig, settings), settings.size
        self._force_sensor = settings.force_sensor
        self.reset()

    def reset(self, lanes: Mask | None = None) -> None:
        """Forget the past of all lanes, or of those where ``lanes`` (N,) is True."""
        if hasattr(self._policy, "reset"):
            self._policy.reset(lanes)
        if lanes is None:
            self._calls = 0
            self._action: Array = np.zeros((self._size, 0))
        elif self._action.shape[1]:
            self._action[:, lanes] = 0.0
            self._law.reset(lanes)

    def declared_impedance(self, reference: Reference) -> Impedance | None:
        """What the law underneath means to render, over N lanes; None without a law."""
        return self._law.declared_impedance(reference)

    def command(self, measurement: Measurement, reference: Reference) -> Array:
        """Spool openings of one control period: (4, N) for signals over N lanes, (4,) for one rig without lanes."""
        if measurement.position.ndim == 1:
            return self.command(*one_lane(measurement, reference))[:, 0]
        if not self._force_sensor:
            measurement = replace(measurement, user_force=np.zeros_like(measurement.user_force))
        lanes = measurement.position.shape[1]
        if self._action.shape[1] != lanes:
            self._action = np.zeros((len(self._action), lanes))
            self._law.reset(np.ones(lanes, dtype=np.bool_))
        if self._calls % self._periods == 0:
            beside = np.concatenate([self._action, self._law.memory()])
            seen = observation.observe(measurement, reference, beside, self._nominal)
            actions = self._policy(seen)
            if np.shape(actions) != (lanes, self._size):
                raise ValueError(f"policy gives actions {np.shape(actions)}; allowed: {(lanes, self._size)}")
            self._action = np.ascontiguousarray(actions.T, dtype=np.float64)
            self._law.accept(self._action)
        self._calls += 1
        return self._law.command(measurement, reference)


def _stored(place: str | Path) -> tuple[PolicyFunction, ResidualSettings]:
    """The policy of a folder and its settings."""
    stored = load_policy(best_policy(place))
    network, seen, said = stored.network, observation_size(stored.settings), stored.settings.size
    if (network.inputs, network.outputs) != (seen, said):
        raise ValueError(
            f"policy = {str(place)!r} maps {network.inputs} to {network.outputs} numbers; allowed: {seen} to {said}"
        )
    return network.acting(), stored.settings
