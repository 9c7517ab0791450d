"""The stiffest setpoint at which the backstepping laws rest: stiffer ones swing, whoever holds the rig.

The laws cancel the rig's dynamics but not the valves' lag tau nor what sensors are late. Both make the fast poles that a stiff
setpoint asks for unstable, and saturated valves then keep up a swing of 100 mm and more. Over masses of 1.5 to 6 kg, valves of
2 to 8 ms and latencies of 0, 4 and 12 ms the laws rest up to 13.3 to 39.6 1/s times m/(tau + latency/4), N/m, which
``birthsim study stiffest`` measures. ``RATE`` is below all of them.
"""

import math

import numpy as np

from baselines.staged import ControllerStage
from birthsim_env.loop.guard import require_good
from birthsim_env.loop.rows import Seen
from birthsim_env.loop.signals import Reference
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.records import Numbers, number
from birthsim_env.physics.rig.parameters import Parameters

RATE = 12.0
"""1/s; measured."""

PART = 0.25
"""Of the latency that counts as lag of a valve; measured."""


def stiffest(rig: Parameters, sampled: bool) -> float:
    """N/m; ``sampled`` where positions are samples, see ``Measurement``."""
    late = PART * rig.electronics.position_latency if sampled else 0.0
    return RATE * rig.mechanics.mass / (rig.valves.time_constant + late)


@helper
def stiffest_direction(kx: float, ky: float, kxy: float) -> float:
    """The larger eigenvalue of [[kx, kxy], [kxy, ky]]."""
    half = 0.5 * (kx - ky)
    return 0.5 * (kx + ky) + math.sqrt(half * half + kxy * kxy)


class Limit(Numbers):
    """Constants of the stage."""

    stiffest = number("N/m", "stiffest setpoint")


@kernel
def _stage(world: int, seen: Seen, memory: int, limit: Limit, tables: int, lane: int, n: int) -> int:
    """How many lanes ask for more than the limit."""
    beyond, asked = 0, seen.asked
    for i in range(n):
        stiffness = stiffest_direction(asked.stiffness[0, i], asked.stiffness[1, i], asked.stiffness_coupling[i])
        beyond += 1 if stiffness > limit.stiffest else 0
    return beyond


def stiffness_range(rig: Parameters, sampled: bool) -> ControllerStage:
    """The stage that refuses stiffer setpoints."""
    return ControllerStage(_stage, Limit.numbers(stiffest=stiffest(rig, sampled)), np.zeros(0))


def require_softer(reference: Reference, rig: Parameters, sampled: bool) -> None:
    """Raises ``ValueError`` for the first lane with a setpoint at which the law would swing."""
    require_good(reference)
    (kx, ky), kxy, most = reference.stiffness, reference.stiffness_coupling, stiffest(rig, sampled)
    largest = 0.5 * (kx + ky) + np.hypot(0.5 * (kx - ky), kxy)
    if (largest > most).any():
        lane = int(np.argmax(largest > most))
        kind = "sampled" if sampled else "exact"
        raise ValueError(
            f"reference.stiffness = ({kx[lane]:g}, {ky[lane]:g}) N/m in lane {lane}; allowed: at most {most:.0f} N/m in every "
            f"direction, with {rig.mechanics.mass:g} kg, valves of {1e3 * rig.valves.time_constant:g} ms and {kind} positions"
        )
