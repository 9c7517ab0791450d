"""Up to which setpoint a controller rests after a push, on one rig."""

from typing import cast

import numpy as np

from baselines.named import make_controller
from baselines.staged import StagedController
from baselines.work.tasks import Result
from birthsim_env.physics.rig.parameters import Parameters
from lab.studies.stability.maps import Cases, judge

ASKED = np.array([1000.0 * 1.2**step for step in range(24)])

SWING = 0.02
"""m, peak to peak."""


def stiffest(controller: str, mass: float, valve: float, latency: float) -> Result:
    """``limit`` of a controller on a rig, N/m, infinite where it swings nowhere."""
    rig = {"mechanics.mass": mass, "valves.time_constant": valve, "electronics.position_latency": latency}
    return {"limit": rests_up_to(controller, Parameters().replace(rig), "lab" if latency else "ideal")}


def rests_up_to(name: str, rig: Parameters, sensors: str) -> float:
    """N/m: the last of ``ASKED`` before the first at which the law swings, without its own bound; infinite where none does."""
    law, still = cast(StagedController, make_controller(name, rig)), np.zeros(len(ASKED))
    stages = law.controller_stages
    law.controller_stages = lambda sampled: stages(sampled)[1:]  # type: ignore[method-assign]
    verdict = judge(Cases([rig] * len(ASKED), still, ASKED, still, still), law, sensors, 0, None)
    swings = verdict.lost | (verdict.motion > SWING)
    return float(ASKED[max(int(np.argmax(swings)) - 1, 0)]) if swings.any() else np.inf
