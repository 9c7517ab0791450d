"""Analytic policy gradient."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from agents.training.algorithm import Algorithm, Learner
from birthsim_env.registry import register

if TYPE_CHECKING:
    from agents.training.configuration import TrainingSettings


@register(algorithm="apg", about="Gradients of the reward through the closed loop.", needs={"extra agents"}, order=50)
class AnalyticPolicyGradient(Algorithm):
    """``agents.training.policy_gradient``: ``rollout`` is its horizon."""

    takes, collects = frozenset({"target", "beside", "noise"}), True

    def learner(self, settings: TrainingSettings, envs: Sequence[Any], folder: Path) -> Learner:
        from agents.training.policy_gradient import PolicyGradient

        return PolicyGradient(settings, envs, folder)
