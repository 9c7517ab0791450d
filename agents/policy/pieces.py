"""A piece of a residual policy's evaluation: what it imports tells pieces apart, so that the code of policies counts."""

from typing import Any

from agents.policy.controller import ResidualController
from baselines.bench.pieces import piece_under
from baselines.work.tasks import Result
from birthsim_env.physics.rig.parameters import Parameters


def evaluate_learned(controller: str, source: str, rig: dict[str, Any], policy: str, files: list[str], **world: Any) -> Result:
    """One piece under the policy of a folder; ``source``, the hash of its weights, and ``files`` only tell pieces apart."""
    return piece_under(ResidualController(Parameters.from_dict(rig), policy), controller, rig, **world)
