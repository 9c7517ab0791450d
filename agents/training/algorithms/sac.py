"""Soft actor-critic (Haarnoja et al., arXiv 1812.05905)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from agents.training.sb3.off_policy import OffPolicy
from birthsim_env.registry import register

if TYPE_CHECKING:
    from agents.training.configuration import TrainingSettings


@register(algorithm="sac", about="Soft actor-critic, from a memory of past steps.", needs={"extra agents"}, order=30)
class SoftActorCritic(OffPolicy):
    """SAC of Stable-Baselines3."""

    def make(self, settings: TrainingSettings, env: Any, shared: dict[str, Any]) -> Any:
        from stable_baselines3 import SAC

        return SAC("MlpPolicy", env, **self.remembering(settings), **shared)
