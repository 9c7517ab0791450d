"""A trained residual as a controller: what the environments do inside, from measurements alone."""

from collections.abc import Callable
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from agents.policy.files import read_policy
from agents.policy.seeds import best_policy
from agents.policy.stage import policy_stage
from agents.residual.corrected import CorrectedController, action_names, memory_names, observation_names
from agents.residual.settings import ResidualSettings
from baselines.network import PolicyNetwork
from birthsim_env.assembly import policy_periods
from birthsim_env.loop.signals import Mask
from birthsim_env.loop.stage import Part, Stage
from birthsim_env.loop.world import no_force_stage
from birthsim_env.observation import observe
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.physics.rig.values import shown

PolicyFunction = Callable[[NDArray[np.float32]], NDArray[np.floating]]
"""Actions (N, ``settings.size``) in [-1, 1] for observations (N, D), which ``observation_names(settings)`` describes.
One that remembers also has ``reset(lanes)``, which forgets the past of all lanes (None) or of those where the mask (N,) is
True."""


class ResidualController(CorrectedController):
    """The law with a policy on top: the policy is asked every policy period, the law at every call.

    ``policy`` is a folder that ``birthsim train`` wrote, or the name of a policy that comes with the package. Of several
    training seeds the one that did best in validation runs. Raises ``ValueError`` for a damaged or foreign one. ``policy`` may
    also be any ``PolicyFunction``. Then ``settings`` say what it may do; a folder has its own settings.
    """

    COMMAND_OPTIONS: ClassVar[tuple[str, ...]] = ()

    def __init__(
        self,
        parameters: Parameters | str | Path | None = None,
        policy: str | Path | PolicyFunction = "circle",
        settings: ResidualSettings | None = None,
    ) -> None:
        rig = load_parameters(parameters)
        self._function: PolicyFunction | None = None
        self._network: PolicyNetwork | None = None
        if callable(policy):
            self._function, settings = policy, settings or ResidualSettings()
        elif settings is None:
            self._network, settings = _stored(policy, rig)
        else:
            raise ValueError(f"settings = {shown(settings)} beside policy = {shown(policy)}; allowed: beside a function")
        super().__init__(rig, settings)
        self._periods = policy_periods(settings.policy_period, rig)
        self._calls = 0
        self._before: list[Part] = []

    def is_compiled(self) -> bool:
        """Whether the policy is a network, which runs in the loop, and no function."""
        return self._function is None

    def reset(self, lanes: Mask | None = None) -> None:
        super().reset(lanes)
        if lanes is None:
            self._calls = 0
        else:
            for one in self._before:
                if isinstance(one, Stage) and one.memory is not None:
                    one.memory[1:, lanes] = 0.0
        forget = getattr(self._function, "reset", None)
        if forget is not None:
            forget(lanes)

    def prepare(self, lanes: int, sampled: bool) -> None:
        if (lanes, sampled) != (self._lanes, self._sampled):
            self._before = [] if self.settings.force_sensor else [no_force_stage()]
            if self._network is not None:
                shown = len(memory_names(self.settings, self.parameters))
                own = policy_stage(self._network, self._periods, self.size, shown, self._p, lanes)
                self._before = [*self._before, own]
            else:
                self._before = [*self._before, self._ask]
        super().prepare(lanes, sampled)

    def policy_stages(self) -> list[Part]:
        """The policy, and before it what it must not see."""
        return self._before

    def _ask(self, period: int) -> None:
        """A function is asked once a policy period."""
        assert self._function is not None
        if self._calls % self._periods == 0:
            measurement, reference = self.good_signals()
            seen = observe(measurement, reference, np.concatenate([self.action, self.shown]), self._p)
            actions, expected = self._function(seen), (self.action.shape[1], self.size)
            if np.shape(actions) != expected:
                raise ValueError(f"policy gives actions {np.shape(actions)}; allowed: {expected}")
            array = np.asarray(actions, dtype=np.float64)
            if not np.isfinite(array).all():
                raise ValueError(f"policy gives the action {array[~np.isfinite(array)][0]:g}; allowed: finite numbers")
            self.accept(array.T)
        self._calls += 1


def _stored(place: str | Path, rig: Parameters) -> tuple[PolicyNetwork, ResidualSettings]:
    """The network of a folder and its settings."""
    stored = read_policy(best_policy(place))
    names = observation_names(stored.settings, rig), action_names(stored.settings, rig)
    network, (seen, said) = stored.network, map(len, names)
    if (network.inputs, network.outputs) != (seen, said):
        raise ValueError(
            f"policy = {str(place)!r} maps {network.inputs} to {network.outputs} numbers; allowed: {seen} to {said}"
        )
    return network, stored.settings
