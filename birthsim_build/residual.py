"""Residual policies as parts: the only place that needs what trained them (the extra ``agents``)."""

from __future__ import annotations

from agents.policy.files import load_policy
from agents.policy.seeds import best_policy
from agents.policy.stage import policy_stage
from agents.residual.law import ResidualLaw
from birthsim_build.image import Part
from birthsim_env.assembly import policy_periods
from birthsim_env.loop.rows import ACTION, SHOWN, WORLD
from birthsim_env.loop.world import no_force_stage
from birthsim_env.physics.compiled.lanes import parameter_column
from birthsim_env.physics.rig.parameters import Parameters


def residual_part(rig: Parameters, sampled: bool, policy: str) -> Part:
    """A policy, a folder or a shipped name, with the law that it sits on."""
    told, law = residual_parts(rig, sampled, policy)
    return Part((*told.stages, *law.stages), told.rows)


def residual_parts(rig: Parameters, sampled: bool, policy: str) -> tuple[Part, Part]:
    """A policy, and the law that it sits on."""
    stored = load_policy(best_policy(policy))
    settings = stored.settings
    residual = ResidualLaw(rig, settings)
    residual.prepare(1, sampled)
    shown, periods = residual.shown.shape[0], policy_periods(settings.policy_period, rig)
    told = policy_stage(stored.network, periods, settings.size, shown, parameter_column(rig), 1)
    hidden = () if settings.force_sensor else (no_force_stage(),)
    first = {
        **{WORLD + ACTION + k: 0.0 for k in range(settings.size)},
        **{WORLD + SHOWN + k: float(settings.size <= k < settings.size + 2) for k in range(shown)},
    }
    return Part((*hidden, told), first), Part(tuple(residual.stages()), {})
