"""The best controller in the grip of a stiff hand, and what it does for other hands."""

import numpy as np
import pytest

from baselines.admittance.controller import AdmittanceController
from baselines.admittance.rows import Constants, Memory
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from lab.studies.haptics.worlds import POSES
from lab.studies.held import hold
from lab.studies.shaken import STIFFNESS, at_rest
from lab.studies.stability.rig_port import RigPort

SOFT = {"friction.bristle_stiffness": 2e3}
"""Soft bristles, with which the head trembled by 40 N and more."""


class Unfeeling(AdmittanceController):
    """The adaptive law without an answer to a stiff hand."""

    def controller_stages(self, sampled):
        stages = super().controller_stages(sampled)
        stages[-1].constants[Constants.feels_stiff_hand.first] = 0.0
        return stages


def port(answers, mass=3.0):
    """Rigs at ``POSES`` with an adaptive law that answers a stiff hand or does not; the reference, and the law."""
    lanes = len(POSES)
    law, reference = (AdmittanceController if answers else Unfeeling)(), at_rest(lanes, POSES, STIFFNESS)
    rig = Parameters().replace({**SOFT, "mechanics.mass": mass})
    return RigPort([rig] * lanes, reference, law, "honest", 5), reference, law


def clamped_by_acceleration(answers, mass):
    """Newtons, (N,), peak to peak, that a stiff hand feels of rigs without a force sensor, whose law is told them."""
    lanes = len(POSES)
    rig = load_parameters("examples/acceleration_sensor_rig.toml").replace({"mechanics.mass": mass})
    law, reference = (AdmittanceController if answers else Unfeeling)(rig, force_sensor=False), at_rest(lanes, POSES, STIFFNESS)
    return hold(RigPort([rig] * lanes, reference, law, "honest", 6, force_sensor=False), reference)["force"]


@pytest.mark.parametrize("mass", [4.5, 5.5])
def test_a_stiff_hand_is_shaken_by_a_quarter_of_what_a_loop_does_that_does_not_feel_it(mass):
    shaken, calm = (hold(*port(answers, mass)[:2])["force"] for answers in (False, True))
    # There must be something to calm: several times the 5 N that a calm hand may feel.
    assert shaken.max() > 15.0
    assert calm.max() < 5.0
    assert (calm < 0.25 * shaken.max()).all()


@pytest.mark.parametrize("mass", [4.0, 4.5])
def test_a_stiff_hand_is_felt_by_an_acceleration_sensor_too(mass):
    shaken, calm = (clamped_by_acceleration(answers, mass) for answers in (False, True))
    assert shaken.max() > 10.0
    # Friction is told from the hand less well than by a force sensor.
    assert (calm < 0.5 * shaken.max()).all()


def push(answers, newtons):
    """Openings (T, 4, N) while a hand pushes along x for a second and lets go; and how far it was answered."""
    held, _, law = port(answers)
    openings, most = [], 0.0
    for _ in range(2000):
        held.advance(lambda now, position, _: np.array([[newtons * (0.3 < now < 1.3)], [0.0]]) + np.zeros_like(position))
        openings.append(held.openings.copy())
        most = max(most, float(Memory(law._memories[-1]).stiff_hand.felt.max()))
    return np.array(openings), most


@pytest.mark.parametrize("newtons", [5.0, 40.0])
def test_openings_have_the_same_bits_where_no_stiff_hand_is_felt(newtons):
    (found, most), (without, _) = push(True, newtons), push(False, newtons)
    assert most == 0.0
    np.testing.assert_array_equal(found, without)
