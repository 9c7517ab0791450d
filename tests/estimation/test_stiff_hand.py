"""Whether a stiff hand is felt, from forces and positions whose hand is known."""

import numpy as np
import pytest
from scipy.signal import lsim, lti

from baselines.estimation import stiff_hand
from baselines.estimation.stiff_hand import StiffHand
from birthsim_env.loop.rows import Signals
from birthsim_env.physics.rig.parameters import Parameters

PERIOD, LATENCY, RATE, NOISE = 1e-3, 4e-3, 240.0, 1e-4
TIME = np.arange(0.0, 4.0, PERIOD)


def felt(force, position, noise=NOISE, seed=0):
    """How far a hand is answered over ``TIME``, (T,): ``force``, N, and ``position``, m, along y, (T,) each."""
    rng, lane = np.random.default_rng(seed), np.ones(1)
    hand, signals, found = StiffHand(np.zeros((StiffHand.size, 1))), Signals(np.zeros((Signals.size, 1))), []
    newest = -1.0
    for k, now in enumerate(TIME):
        stamp = max(0.0, np.floor((now - LATENCY) * RATE) / RATE)
        if stamp > newest:
            newest = stamp
            signals.position[1] = np.interp(stamp, TIME, position) + noise * rng.standard_normal()
            signals.position[0] = 0.4 + noise * rng.standard_normal()
        signals.time[:], signals.position_time[:] = now, newest
        felt_force = np.array([[0.1 * rng.standard_normal()], [force[k] + 0.1 * rng.standard_normal()]])
        stiff_hand.observe(hand, signals, felt_force, np.full(1, noise), PERIOD, lane)
        lane[:] = 0.0
        found.append(hand.felt[0])
    return np.array(found)


def swing(hertz, until=np.inf):
    """1 at most, dying within 50 ms from ``until`` on, s."""
    return np.sin(2 * np.pi * hertz * TIME) * np.where(until > TIME, 1.0, np.exp(-(np.maximum(TIME - until, 0.0)) / 0.05))


def rendered(force):
    """Where the declared impedance, 3 kg on 2 kN/m, goes under a force, by SciPy."""
    mass, spring = Parameters().mechanics.mass, 2000.0
    return lsim(lti([1.0], [mass, 1.8 * np.sqrt(mass * spring), spring]), force, TIME)[1]


@pytest.mark.parametrize("stiffness", [1e4, 2e4, 5e4])
@pytest.mark.parametrize("hertz", [9.0, 14.0])
def test_a_stiff_hand_in_which_the_head_swings_is_felt_within_half_a_second(stiffness, hertz):
    force = 8.0 * swing(hertz, 0.5)
    found = felt(force, -force / stiffness)
    assert found[round(0.6 / PERIOD)] > 0.5
    assert (found[round(0.8 / PERIOD) :] > 0.9).all()  # as long as nothing moves


NOT_STIFF = {
    "a push": 40.0 * (TIME > 0.5),
    "a push that grows": 40.0 * np.minimum(TIME, 1.0),
    "a sine of 3 Hz": 20.0 * swing(3.0),
    "noise": 8.0 * np.random.default_rng(3).standard_normal(len(TIME)),
    "many sines": 3.0 * sum(np.sin(2 * np.pi * f * TIME + f * f) for f in (0.4, 1.3, 3.1, 5.9, 8.3, 10.1, 13.7, 17.9)),
}


@pytest.mark.parametrize("name", NOT_STIFF)
def test_a_hand_that_pushes_by_itself_is_not_stiff(name):
    assert not felt(NOT_STIFF[name], rendered(NOT_STIFF[name])).any()


@pytest.mark.parametrize(
    ("force", "stiffness"),
    [(8.0, -5e4), (8.0, 3e3), (0.6, 2e4), (0.0, 2e4)],
    ids=["bristles that give way", "a soft hand", "a small swing", "noise"],
)
def test_what_swings_in_another_way_is_no_stiff_hand(force, stiffness):
    assert not felt(force * swing(11.0), -force * swing(11.0) / stiffness).any()


def test_a_swing_that_goes_on_in_spite_of_the_answer_is_the_hand_s_own():
    found = felt(8.0 * swing(11.0), -8.0 * swing(11.0) / 2e4)
    assert found.max() > 0.9
    assert (found > 0.0).sum() * PERIOD < stiff_hand.TRIAL + 8 * stiff_hand.RECOVERY
    assert not found[-1000:].any()


def test_the_answer_ends_once_the_head_moves_without_the_force_of_a_stiff_hand():
    calm = 8.0 * swing(11.0, 0.5)
    gone = 0.03 * np.clip(TIME - 2.0, 0.0, 1.0)
    found = felt(calm, -calm / 2e4 + gone)
    assert found[round(1.9 / PERIOD)] > 0.9
    assert found[round(2.9 / PERIOD)] < 0.1
    still_held = felt(calm - 2e4 * gone / 30.0, -calm / 2e4 + gone / 30.0)  # pressed by a millimetre
    assert still_held[-1] > 0.9
