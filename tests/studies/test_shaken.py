"""What a hand that shakes rigs feels, of ports whose answer is known."""

import numpy as np
import pytest

from baselines.impedance import Impedance
from baselines.named import make_controller
from birthsim_env.physics.rig.parameters import Parameters
from lab.studies import shaken
from lab.studies.haptics.worlds import Condition

LANES = 2


class Spring:
    """A port without mass and damping, some times ``softer`` than what is asked for; it has given 3 mJ for a while."""

    lanes, period, now = LANES, 1e-3, 0.0
    impacts = np.array([0.0, 10.0])

    def __init__(self, softer):
        self.stiffness = shaken.STIFFNESS / softer
        self.offset, self.force = np.zeros((2, 2, LANES))

    @property
    def energy(self):
        return np.full(LANES, 3e-3 if 6.0 < self.now < 7.0 else 1e-3)

    def motion(self):
        return np.concatenate([self.offset, 0.0 * self.offset])

    def advance(self, hand):
        self.force = hand(self.now, self.offset, 0.0 * self.offset)
        self.now += self.period
        self.offset = self.force / self.stiffness


class Declares:
    """A controller that declares a spring 1.3 times softer than what is asked for."""

    def declared_impedance(self, reference):
        nothing, each = np.zeros((2, 2, LANES)), np.repeat(np.eye(2)[:, :, None], LANES, axis=2)
        return Impedance(nothing, nothing, shaken.STIFFNESS / 1.3 * each)


@pytest.mark.parametrize(
    ("softer", "law", "noticed"),
    [(1.0, object(), 0.0), (1.15, object(), 1.0), (1.3, Declares(), 0.0), (1.0, Declares(), 0.3 / 1.3 / 0.15)],
)
def test_differences_are_those_of_the_compliance_from_what_is_declared_or_asked_for(softer, law, noticed, monkeypatch):
    """15 % of compliance is one just noticeable difference."""
    monkeypatch.setattr(shaken, "RigPort", lambda *_, **__: Spring(softer))
    found = shaken.shaken(law, [Parameters()] * LANES, "ideal", 0)
    np.testing.assert_allclose(found["noticed"], noticed, atol=1e-9)
    np.testing.assert_array_equal(found["energy"], 3e-3)
    np.testing.assert_array_equal(found["lost"], [0, 1])


@pytest.mark.slow
def test_a_policy_from_scratch_that_renders_stiffness_does_so_when_it_is_shaken():
    """Policies that had met slow pushes alone were tens of just noticeable differences off, and gave joules."""
    rig = Parameters()
    rigs = Condition("residual", rig, "ideal", 86_000, 12, True).drawn()
    found = shaken.shaken(make_controller("residual", rig, policy="probe_apg"), rigs, "ideal", 0)
    assert np.median(found["noticed"]) < 1.0
    assert np.median(found["energy"]) < 1e-3
    assert found["lost"].sum() == 0
