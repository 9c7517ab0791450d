"""Short trials for the tests of this folder: the proposed experiment on a rig that is not its owner's."""

from functools import cache

import numpy as np

from baselines.identification.experiment import propose
from baselines.identification.laboratory import run_plan
from baselines.identification.log.trial import Trial
from baselines.named import make_controller
from birthsim_env.physics.rig.parameters import Parameters

OWNER = Parameters()
TRUE = OWNER.replace(
    {
        "mechanics.mass": 3.6,
        "cylinder1.coulomb_friction": 16.0,
        "cylinder2.viscous_friction": 22.0,
        "valves.sonic_conductance": 4.4e-9,
        "valves.time_constant": 0.0055,
        "chambers.dead_volume": 16e-6,
        "electronics.position_latency": 0.006,
    }
)


@cache
def trial(sensors: str = "lab", duration: float = 4.0) -> Trial:
    """The experiment on ``TRUE`` under a law that believes in ``OWNER``."""
    return run_plan(propose(OWNER, duration, 3), [TRUE], make_controller("backstepping", OWNER), sensors, 11)[0]


def part(whole: Trial, first: int, last: int) -> Trial:
    """Rows ``first`` to ``last`` of a trial."""
    values = (whole.openings, whole.pressures, whole.positions, whole.forces)
    return Trial(whole.times[first:last], *(np.ascontiguousarray(array[:, first:last]) for array in values))
