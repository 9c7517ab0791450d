"""Proximal policy optimization (Schulman et al., arXiv 1707.06347)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from agents.training.sb3.on_policy import OnPolicy
from birthsim_env.registry import register

if TYPE_CHECKING:
    from agents.training.configuration import TrainingSettings
    from agents.training.sb3.networks import Parts


@register(algorithm="ppo", about="Proximal policy optimization.", needs={"extra agents"}, order=10)
class ProximalPolicyOptimization(OnPolicy):
    """PPO of Stable-Baselines3, whose policy and value have a network of ``hidden`` layers each."""

    def make(self, settings: TrainingSettings, env: Any, shared: dict[str, Any]) -> Any:
        from stable_baselines3 import PPO

        from agents.training.sb3.networks import activation

        hidden = list(settings.hidden)
        policy = {**activation(settings), "net_arch": {"pi": hidden, "vf": hidden}}
        return PPO("MlpPolicy", env, policy_kwargs=policy, **self.collecting(settings), **shared)

    def parts(self, policy: Any) -> Parts:
        from agents.training.sb3.networks import Parts

        return Parts(policy.mlp_extractor.policy_net, policy.action_net)
