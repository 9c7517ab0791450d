"""The compiled law by itself: how many lanes it could not serve, and how short a chamber counts."""

from __future__ import annotations

import numpy as np
import pytest

from baselines.backstepping import law
from baselines.valve_inverse import air_at
from birthsim_env.loop.rows import Seen
from birthsim_env.loop.signals import Joints
from birthsim_env.physics.compiled.lanes import Rig, parameter_column
from birthsim_env.physics.rig.parameters import Parameters


@pytest.mark.parametrize("ratio", [0.0, 1.2])
def test_lanes_without_gains_are_counted_once_each(ratio: float) -> None:
    """Below the least stiffness of either cylinder or of both; the others have their gains."""
    stiffness = np.array([[2000.0, 20.0, 2000.0, 20.0, 3000.0], [2000.0, 2000.0, 1.0, 1.0, 3000.0]])
    lanes = stiffness.shape[1]
    options = law.Options(law.Options.lane(pneumatic_gain=30.0, sign_width=0.01, damping_ratio=ratio))
    seen, at_rest = Seen(np.zeros((Seen.size, lanes))), Joints(np.zeros((Joints.size, lanes)))
    seen.asked.position[0], seen.asked.stiffness[:], seen.pressure[:] = 0.5, stiffness, 3e5
    seen.asked.pneumatic_stiffness[0], seen.asked.pneumatic_stiffness[1] = 4400.0, 2200.0
    served = Rig(parameter_column(Parameters()))
    few = law.command(seen, at_rest, served, options, lanes)
    alone = [
        law.command(Seen(seen.rows[:, [k]].copy()), Joints(at_rest.rows[:, [k]].copy()), served, options, 1)
        for k in range(lanes)
    ]
    assert alone == [0, 1, 1, 1, 0]
    assert few == 3


def test_no_chamber_counts_as_shorter_than_two_millimetres() -> None:
    p = Rig(parameter_column(Parameters()))
    for k, half in enumerate((p.half_l1, p.half_l2)):
        beyond = ((0.03, half + 0.03, half - 0.03), (half - 0.0015, 2 * half - 0.0015, 0.002), (-2 * half, 0.002, 3 * half))
        for y, length_p, length_n in beyond:
            air = air_at(k, 3e5, 3e5, y, 0.0, p)
            assert (air.length_p, air.length_n) == pytest.approx((length_p, length_n))
