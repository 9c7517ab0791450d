"""What lies between a commanded opening and the one that a spool goes to: hysteresis, and the end of its stroke.

Hysteresis is the play operator of Krejci and Prandtl: the command drags an inner one along that may lag behind by half the
width. Both act on the command, before the lag of the spool, and both are off by default. Where a spool opens nothing yet is
its ``characteristic``.
"""

import numpy as np

from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array


@helper
def dragged(command: float, last: float, width: float) -> float:
    """The inner command of a play of ``width`` that was at ``last``."""
    return max(command - 0.5 * width, min(command + 0.5 * width, last))


@helper
def admitted(command: float, limit: float) -> float:
    """The opening that a command gives, in [-``limit``, ``limit``]."""
    return max(-limit, min(limit, command))


@helper
def admit(command: Array, p: Array, last: Array, opening: Array, n: int) -> None:
    """Fill ``opening`` (4, n) from ``command`` (4, n); ``last`` (4, n), the inner commands, moves along."""
    for valve in range(4):
        for i in range(n):
            last[valve, i] = dragged(command[valve, i], last[valve, i], p[at.PLAY, i])
            opening[valve, i] = admitted(last[valve, i], p[at.OPENING_LIMIT, i])


@kernel
def admit_lanes(command: Array, parameters: Array, last: Array, opening: Array) -> None:
    """``admit`` for all lanes, (4, N)."""
    admit(command, parameters, last, opening, command.shape[1])


def are_perfect(parameters: Array) -> bool:
    """Whether no lane's valves have any of it, (PARAMETERS, N)."""
    return not parameters[at.PLAY].any() and bool(np.all(parameters[at.OPENING_LIMIT] == 1.0))
