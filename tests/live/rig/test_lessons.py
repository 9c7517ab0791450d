"""What the lessons say of friction is so."""

import numpy as np

from baselines import evaluate
from baselines.named import make_controller
from birthsim_env import Parameters
from birthsim_live.logs.recording import SLICES
from tests.live.rig.worker import run


def swing(told):
    """Peak to peak of the head along x in the last 2 s, mm."""
    return 1e3 * np.ptp(told.row[-2000:, SLICES["position"]][:, 0])


def test_the_head_shakes_and_more_so_on_pistons_that_slide_freely(page):
    cases = [[("set", {"friction": friction}), ("hold", {"position": [0.55, 0.0]}), ("advance", 4000)] for friction in (1, 0)]
    rubbed, free = (swing(told[-1]) for told in run(page, *cases))
    assert 1 < rubbed < 5  # by millimetres
    assert 8 < free < 20  # by a centimetre
    assert free > 3 * rubbed


def test_a_controller_that_expects_no_friction_holds_such_a_head_still():
    """So what shakes is the push against friction that is not there."""
    rig = Parameters()
    kinds = ("coulomb_friction", "pressure_friction", "viscous_friction")
    frictionless = rig.replace({f"cylinder{i}.{kind}": 0.0 for i in (1, 2) for kind in kinds})
    law = make_controller("backstepping", frictionless)
    found = evaluate("BirthSIM/Probe-v3", law, "backstepping", 1, 0, progress=False, parameters=frictionless)
    assert found.metrics["hunting_x"][0] < 0.1
    assert found.metrics["settled_rms"][0] < 0.5
