"""A stiff hand that holds the head where it starts, at ``lab.studies.haptics.worlds.POSES``."""

import numpy as np

from baselines.bench.metrics import NORMAL_DENSITY
from birthsim_env.loop.signals import Reference
from birthsim_env.physics.compiled.lanes import Array
from lab.studies.stability.rig_port import RigPort

CLAMP, DAMPING = 20000.0, 60.0
"""N/m and N s/m of a hand that holds the head where it starts; assumed, the stiffest hand of
``lab.studies.haptics.coupled``."""

HELD, JUDGED = 5.0, 2.0
"""s that it holds, and of these the last that are judged."""


def hold(port: RigPort, reference: Reference, stiffness: float = CLAMP, damping: float = DAMPING) -> dict[str, Array]:
    """What a hand of ``stiffness``, N/m, and ``damping``, N s/m, feels that holds the N lanes of ``port``, (N,) each.

    ``motion``, m, and ``force``, N, are peak to peak along the axis where they are larger, ``press``, N, is the mean force,
    ``air``, l/min, what the supply gives, and ``turns``, 1/s, how often the command of a valve turns.
    """

    def hand(now: float, position: Array, velocity: Array) -> Array:
        return np.asarray(-stiffness * (position - reference.position) - damping * velocity)

    turned, direction, before = np.zeros((3, 4, port.lanes))
    motion, force = [], []
    for k in range(round(HELD / port.period)):
        port.advance(hand)
        step = np.sign(port.openings - before)
        if k * port.period >= HELD - JUDGED:
            turned += step * direction < 0
            motion.append(port.motion()[:2].copy())
            force.append(port.force.copy())
        direction, before = np.where(step == 0, direction, step), port.openings.copy()
    return {
        "motion": np.ptp(motion, axis=0).max(axis=0), "force": np.ptp(force, axis=0).max(axis=0),
        "press": np.abs(np.mean(force, axis=0)).max(axis=0), "air": 60e3 * port.air / NORMAL_DENSITY / HELD,
        "turns": turned.mean(axis=0) / JUDGED,
    }  # fmt: skip
