"""The passive rig: where it rests, and that its air does not depend on how it moves."""

import numpy as np
import pytest

from baselines.limiter import air_spring
from birthsim_env import Parameters
from birthsim_env.loop.signals import InPlane, Joints
from birthsim_env.physics.compiled.lanes import Rig, parameter_column
from birthsim_env.physics.linkage.inverse_kinematics import pistons_at
from lab.studies.haptics.worlds import resting
from lab.studies.stability.rig_port import RigPort
from tests.limiter.test_port_limiter import signals_of

RIG = Parameters()
PLACE = (0.5, 0.0)


class AirSpring:
    def __init__(self, rig, lanes, rate):
        self.p, self.forces, self.rate = parameter_column(rig), np.full((4, lanes), np.nan), rate

    def openings(self, measurement, reference):
        opening, joints = np.empty_like(self.forces), []
        for place in (measurement.position, reference.position):
            joints.append(Joints(np.empty((Joints.size, place.shape[1]))))
            pistons_at(np.concatenate([place, np.zeros_like(place)]), Rig(self.p), joints[-1].rows)
        seen = signals_of(measurement, reference)
        for lane in range(opening.shape[1]):
            hand = InPlane(seen.user_force.copy())
            air_spring.passive_openings(self.forces, self.rate, seen.pressure, hand, *joints, seen, Rig(self.p), opening, lane)
        return opening


class Passive:
    """A law that is nothing but the air spring; ``kick``: openings in the first 30 ms after half a second."""

    def __init__(self, kick):
        self.kick = kick
        self.reset()

    def reset(self, lanes=None):
        self.air = None

    def command(self, measurement, reference):
        self.air = self.air or AirSpring(RIG, measurement.position.shape[1], 0.001 / air_spring.MEMORY)
        openings = self.air.openings(measurement, reference)
        kicked = (measurement.time >= 0.5) & (measurement.time < 0.53)
        return np.where(kicked, np.reshape(self.kick, (4, 1)), openings)


def pushed(law, stiffness, force=0.0, seconds=3.0):
    """Motion from the target at the end, m, and the most energy given, J; hands of a stiffness push with a constant force."""
    lanes = len(stiffness)
    port, most = RigPort([RIG] * lanes, resting([PLACE] * lanes, [2000.0] * lanes), law), np.zeros(lanes)
    held = np.transpose([PLACE])
    for _ in range(round(seconds / port.period)):
        port.advance(lambda now, x, v: np.array([[force], [force]]) * (now > 0.1) - stiffness * (x - held))
        most = np.maximum(most, port.energy)
    return port.motion()[:2] - held, most


def test_a_rig_in_balance_stays():
    """No valve moves but for leaks: what is left is far below what friction holds, 12 N at a spring of 1000 N/m."""
    motion, most = pushed(Passive(np.zeros(4)), np.array([0.0, 2000.0]))
    assert np.abs(motion).max() < 1e-4
    assert most.max() < 1e-6


def test_a_law_that_kicked_gives_a_hand_less_than_shut_valves_would():
    """30 ms of openings of 0.3 against each other."""
    kick = 0.3 * np.array([1.0, -1.0, 1.0, -1.0])
    hands = np.array([300.0, 1000.0, 3000.0])
    _, passive = pushed(Passive(kick), hands)

    class Shut(Passive):
        def command(self, measurement, reference):
            return super().command(measurement, reference) * ((measurement.time >= 0.5) & (measurement.time < 0.53))

    _, shut = pushed(Shut(kick), hands)
    assert (passive < 0.5 * shut).all()


@pytest.mark.parametrize("force", [30.0, -30.0])
def test_it_is_a_spring_against_a_hand(force):
    """A hand that is a spring of 1000 N/m moves it by F/k at most, and is given nothing: the rig only takes."""
    motion, most = pushed(Passive(np.zeros(4)), np.full(1, 1000.0), force)
    assert (np.sign(force) * motion > 0.0).all()
    assert (np.abs(motion) < abs(force) / 1000.0).all()
    assert most.max() < 1e-3
