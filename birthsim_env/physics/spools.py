"""What lies between a commanded opening and the one that a spool goes to: hysteresis, deadband, and the end of its stroke.

Hysteresis is the play operator of Krejci and Prandtl: the command drags an inner one along that may lag behind by half the
width. Within the deadband nothing opens; beyond it the characteristic is straight again, up to full opening. All act on the
command, before the lag of the spool, and all are off by default.
"""

import math

import numpy as np

from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array


@helper
def dragged(command: float, last: float, width: float) -> float:
    """The inner command of a play of ``width`` that was at ``last``."""
    return max(command - 0.5 * width, min(command + 0.5 * width, last))


@helper
def admitted(command: float, deadband: float, limit: float) -> float:
    """The opening that a command gives, in [-``limit``, ``limit``]."""
    return math.copysign(min(max(abs(command) - deadband, 0.0) / (1.0 - deadband), limit), command)


@helper
def admit(command: Array, p: Array, last: Array, opening: Array, n: int) -> None:
    """Fill ``opening`` (4, n) from ``command`` (4, n); ``last`` (4, n), the inner commands, moves along."""
    for valve in range(4):
        for i in range(n):
            last[valve, i] = dragged(command[valve, i], last[valve, i], p[at.PLAY, i])
            opening[valve, i] = admitted(last[valve, i], p[at.DEADBAND, i], p[at.OPENING_LIMIT, i])


@kernel
def admit_lanes(command: Array, parameters: Array, last: Array, opening: Array) -> None:
    """``admit`` for all lanes, (4, N)."""
    admit(command, parameters, last, opening, command.shape[1])


def are_perfect(parameters: Array) -> bool:
    """Whether no lane's valves have any of it, (PARAMETERS, N)."""
    off = not parameters[at.DEADBAND].any() and not parameters[at.PLAY].any()
    return off and bool(np.all(parameters[at.OPENING_LIMIT] == 1.0))
