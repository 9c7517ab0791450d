"""Analytic policy gradient."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from agents.training.algorithm import Algorithm, Learner
from birthsim_env.parts.drawn.frictions import OPTIONAL
from birthsim_env.registry import entries, register

if TYPE_CHECKING:
    from agents.training.configuration import TrainingSettings


@register(algorithm="apg", about="Gradients of the reward through the closed loop.", needs={"extra agents"}, order=50)
class AnalyticPolicyGradient(Algorithm):
    """``agents.training.by_gradients.policy_gradient``."""

    takes = frozenset({"target", "beside", "noise", "memory", "privileged", "horizon", "most_cost"})
    collects = True

    def complaint(self, settings: TrainingSettings) -> str:
        if settings.horizon and settings.rollout % settings.horizon:
            return f"rollout = {settings.rollout} with horizon = {settings.horizon}; allowed: a multiple of the horizon"
        laws = {one.name: one.made.laws for one in entries("friction")}
        if OPTIONAL not in laws.get(settings.friction, ()):
            return ""
        others = ", ".join(repr(name) for name in laws if OPTIONAL not in laws[name])
        return f"friction = {settings.friction!r} with algorithm = 'apg', though {OPTIONAL} has no gradients; allowed: {others}"

    def learner(self, settings: TrainingSettings, envs: Sequence[Any], folder: Path) -> Learner:
        from agents.training.by_gradients.policy_gradient import PolicyGradient

        return PolicyGradient(settings, envs, folder)
