"""Residual policies as parts: the only place that needs what trained them (the extra ``agents``)."""

from __future__ import annotations

from agents.policy.controller import ResidualController
from birthsim_build.image import Part
from birthsim_env.loop.rows import ACTION, SHOWN, WORLD
from birthsim_env.physics.rig.parameters import Parameters


def residual_part(rig: Parameters, sampled: bool, policy: str) -> Part:
    """A policy, a folder or a shipped name, with the law that it sits on."""
    residual = ResidualController(rig, policy)
    residual.prepare(1, sampled)
    rows = (
        (WORLD + first + k, value)
        for array, first in ((residual.action, ACTION), (residual.shown, SHOWN))
        for k, value in enumerate(array[:, 0].tolist())
    )
    return Part(tuple(residual.stages()), dict(rows))
