"""Truncated quantile critics (Kuznetsov et al., arXiv 2005.04269)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from agents.training.sb3.off_policy import OffPolicy
from birthsim_env.registry import register

if TYPE_CHECKING:
    from agents.training.configuration import TrainingSettings


@register(algorithm="tqc", about="SAC with truncated quantile critics.", needs={"extra agents"}, order=40)
class TruncatedQuantileCritics(OffPolicy):
    """TQC of sb3-contrib."""

    def make(self, settings: TrainingSettings, env: Any, shared: dict[str, Any]) -> Any:
        from sb3_contrib import TQC

        return TQC("MlpPolicy", env, **self.remembering(settings), **shared)
