"""A policy of an environment as a controller: it sees the environment's observations and opens the valves.

Every policy period it is asked once, about all lanes; its action is held until the next. What it observes, and when, is what
the environment shows it, so that both have the same trajectories, to the last bit.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from birthsim_env.assembly import policy_periods
from birthsim_env.loop.signals import Mask, Measurement, Reference
from birthsim_env.observation import observe, size_of
from birthsim_env.physics.compiled.lanes import Array, parameter_column
from birthsim_env.physics.rig.arrays import floats_of
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import problem, shown

Act = Callable[[NDArray[np.float32]], NDArray[np.floating]]
"""Actions (N, n) in [-1, 1] for observations (N, 20 + n), as environments with the default action mode and valves have
them. One that remembers also has ``reset(lanes)``, which forgets the past of all lanes (None) or of those where the mask (N,)
is True."""

ROUNDING = 1e-6
"""By how much an action may exceed 1 in size: onnxruntime's tanh does so by the last bit of single precision."""


def spaces_of(rig: Parameters) -> tuple[int, int]:
    """Lengths of an observation and of an action in the environments of a rig."""
    actions = len(rig.linkage.topology.chambers)
    return size_of(parameter_column(rig)) + actions, actions


class ActingController:
    """The policy ``act`` of an environment as a controller of its rig, which it observes through what ``parameters`` say.

    ``name`` is for errors. Raises ``ValueError`` where a policy does not give actions.
    """

    def __init__(self, act: Act, parameters: Parameters, policy_period: float = 0.01, name: str = "policy") -> None:
        self._act, self._name = act, name
        self._nominal = parameter_column(parameters)
        self._chambers = np.array(parameters.linkage.topology.chambers)
        self.held_periods, self._calls = policy_periods(policy_period, parameters), 0
        self._action: Array = np.zeros((len(self._chambers), 0))
        self._openings: Array = np.zeros((4, 0))

    def reset(self, lanes: Mask | None = None) -> None:
        """Forget the past, of all lanes or of those where the mask (N,) is True."""
        if lanes is None:
            self._calls = 0
            self._action = self._action[:, :0]
        else:
            self._action[:, lanes] = 0.0
        forget = getattr(self._act, "reset", None)
        if forget is not None:
            forget(lanes)

    def command(self, measurement: Measurement, reference: Reference) -> Array:
        """Openings (4, N), those of the last action; every policy period there is a new one."""
        if self._calls % self.held_periods == 0:
            self._openings = self.decide(measurement, reference)
        self._calls += 1
        return self._openings

    def decide(self, measurement: Measurement, reference: Reference) -> Array:
        """Ask the policy, and return the openings (4, N) that hold for ``held_periods``."""
        lanes = measurement.position.shape[1]
        if self._action.shape[1] != lanes:
            self._action = np.zeros((len(self._chambers), lanes))
        self._action = self._asked(observe(measurement, reference, self._action, self._nominal))
        openings: Array = np.zeros((4, lanes))
        openings[self._chambers] = self._action
        return openings

    def _asked(self, observation: NDArray[np.float32]) -> Array:
        expected = len(observation), len(self._chambers)
        allowed = f"allowed: numbers in [-1, 1], {expected} for observations {observation.shape}"
        try:
            given = floats_of(self._act(observation))
        except Exception as error:
            raise ValueError(f"policy {self._name} fails ({problem(error)}); {allowed}") from error
        if given.shape != expected:
            raise ValueError(f"policy {self._name} gives actions {given.shape}; {allowed}")
        wrong = given[~(np.abs(given) <= 1.0 + ROUNDING)]
        if wrong.size:
            raise ValueError(f"policy {self._name} gives the action {shown(float(wrong[0]))}; {allowed}")
        # As single precision has them, which actions of an environment have.
        return np.ascontiguousarray(np.clip(given, -1.0, 1.0).astype(np.float32).T, dtype=np.float64)
