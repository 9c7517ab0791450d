"""A law that is told another rig in each lane, against the laws alone."""

import numpy as np
import pytest

from baselines.bench.resting import RestingRigs
from baselines.named import make_controller
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from lab.studies.sensorless.privileged import Privileged
from lab.studies.sensorless.study import RIGS
from lab.studies.shaken import at_rest
from tests.console import ROOT

OTHER = {"mechanics.mass": 3.4, "cylinder1.coulomb_friction": 14.0, "electronics.position_latency": 0.009}


@pytest.mark.parametrize(("controller", "file"), list(RIGS.values()))
def test_each_lane_is_that_of_the_law_that_is_told_its_rig(controller, file):
    """Bit for bit, also where one law remembers more samples than the other."""
    rig = load_parameters(ROOT / file if file else None)
    laws = [make_controller(controller, told) for told in (rig, rig.replace(OTHER))]

    def path(law):
        loop = RestingRigs([rig] * 2, at_rest(2), law, "honest", 7)
        loop.pushed[:] = 15.0
        loop.close([])
        return loop.path(300)

    found = path(Privileged(laws))
    alone = [path(law) for law in laws]
    assert (alone[0][:, :, 1] != alone[1][:, :, 1]).any()
    for lane in range(2):
        np.testing.assert_array_equal(found[:, :, lane], alone[lane][:, :, lane])


def test_it_declares_what_each_law_declares():
    laws = [make_controller("admittance", Parameters().replace({"mechanics.mass": mass})) for mass in (2.0, 4.5)]
    told, reference = Privileged(laws), at_rest(2)
    np.testing.assert_array_equal(told.declared_impedance(reference).mass[0, 0], [2.0, 4.5])
    np.testing.assert_array_equal(
        told.declared_impedance(reference).damping[..., 1], laws[1].declared_impedance(reference).damping[..., 1]
    )


def test_a_law_that_cannot_serve_its_lane_is_the_one_that_says_so():
    light = {"mechanics.mass": 2.0, "valves.time_constant": 0.008}
    told = Privileged([make_controller("backstepping", rig) for rig in (Parameters(), Parameters().replace(light))])
    loop = RestingRigs([Parameters()] * 2, at_rest(2, stiffness=4000.0), told)
    loop.close([])
    with pytest.raises(
        ValueError, match=r"rig 1: reference.stiffness = \(4000, 4000\) N/m in lane 0; allowed: at most 3\d\d\d N/m"
    ):
        loop.run(5)
