"""PPO of a policy with a memory."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from agents.training.sb3.on_policy import OnPolicy
from birthsim_env.physics.rig.values import shown
from birthsim_env.registry import register

if TYPE_CHECKING:
    from agents.training.configuration import TrainingSettings
    from agents.training.sb3.networks import Parts


@register(algorithm="recurrent-ppo", about="PPO of a policy with a memory.", needs={"extra agents"}, order=20)
class RecurrentPPO(OnPolicy):
    """RecurrentPPO of sb3-contrib, with gated recurrent units of ``memory`` cells in policy and value.

    Gradients go back ``rollout`` steps, to the beginning of what was collected, and not beyond the beginning of an episode.
    """

    hyperparameters = MappingProxyType({"rollout": 32, "hidden": (64,), "memory": 32})
    """Assumed; a batch is then 64 sequences."""

    takes = OnPolicy.takes | {"memory"}

    def complaint(self, settings: TrainingSettings) -> str:
        return "" if settings.memory else f"memory = {shown(settings.memory)} with algorithm = 'recurrent-ppo'; allowed: >= 1"

    def make(self, settings: TrainingSettings, env: Any, shared: dict[str, Any]) -> Any:
        from sb3_contrib import RecurrentPPO as Contributed

        from agents.training.sb3.memory import MemoryPolicy
        from agents.training.sb3.networks import activation

        policy = {**activation(settings), "hidden": settings.hidden, "lstm_hidden_size": settings.memory}
        return Contributed(MemoryPolicy, env, policy_kwargs=policy, **self.collecting(settings), **shared)

    def parts(self, policy: Any) -> Parts:
        from agents.training.sb3.networks import Parts

        return Parts(policy.pi_features_extractor.layers, policy.action_net, memory=policy.lstm_actor.unit)

    def carried(self, model: Any) -> Any:
        """What the memories hold, and those of the value, after the last step."""
        return [list(states) for states in model._last_lstm_states]

    def carry(self, model: Any, carried: Any) -> None:
        from sb3_contrib.common.recurrent.type_aliases import RNNStates

        from agents.training.checkpoint import require_array, tensors

        for own, states in zip(model._last_lstm_states, carried, strict=True):
            for one, state in zip(own, states, strict=True):
                require_array("what a memory holds", state, tuple(one.shape))
        model._last_lstm_states = RNNStates(*(tuple(tensors(states)) for states in carried))
