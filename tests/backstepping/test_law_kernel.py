"""The compiled law by itself: how many lanes it could not serve, and how short a chamber counts."""

from __future__ import annotations

import numpy as np
import pytest

from baselines.backstepping import law
from birthsim_env.loop.signals import REFERENCES
from birthsim_env.physics.compiled.lanes import parameter_column
from birthsim_env.physics.rig.parameters import Parameters


@pytest.mark.parametrize("ratio", [0.0, 1.2])
def test_lanes_without_gains_are_counted_once_each(ratio: float) -> None:
    """Below the least stiffness of either cylinder or of both; the others have their gains."""
    stiffness = np.array([[2000.0, 20.0, 2000.0, 20.0, 3000.0], [2000.0, 2000.0, 1.0, 1.0, 3000.0]])
    lanes, options = stiffness.shape[1], np.zeros(law.OPTIONS)
    options[[law.PNEUMATIC_GAIN, law.SIGN_WIDTH, law.DAMPING_RATIO]] = 30.0, 0.01, ratio
    reference, openings = np.zeros((REFERENCES, lanes)), np.empty((4, lanes))
    reference[0], reference[8:10], reference[10], reference[11] = 0.5, stiffness, 4400.0, 2200.0
    at_rest, told = np.zeros((4, lanes)), np.zeros((law.TOLD, lanes))
    pressures = np.full((4, lanes), 3e5)
    served = parameter_column(Parameters())
    few = law.command(at_rest, pressures, reference, told, served, options, openings)
    alone = [
        law.command(*(one[:, [k]].copy() for one in (at_rest, pressures, reference, told)), served, options, openings[:, [k]])
        for k in range(lanes)
    ]
    assert alone == [0, 1, 1, 1, 0]
    assert few == 3


def test_no_chamber_counts_as_shorter_than_two_millimetres() -> None:
    assert law.chamber_lengths(0.03, 0.1) == pytest.approx((0.13, 0.07))
    assert law.chamber_lengths(0.0985, 0.1) == pytest.approx((0.1985, 0.002))
    assert law.chamber_lengths(-0.2, 0.1) == pytest.approx((0.002, 0.3))
