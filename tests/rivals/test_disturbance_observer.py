"""Disturbance-observer based control: its loop against nominal inverse and filter as transfer functions, solved anew."""

import numpy as np
import pytest

from baselines.bench.evaluation import evaluate
from baselines.rivals.disturbance_observer import DisturbanceObserverControl
from birthsim_env.physics.rig.parameters import Parameters
from tests.rivals.unseen_weight import BELIEVED, BESIDE, expected, pushed

W, ZETA, Q, B = 20.0, 0.8, 60.0, 60.0


def test_a_push_that_no_sensor_sees_is_cancelled_as_the_equations_say() -> None:
    """The filter as it is written, applied to e and to D/m_e one by one: d^ = f'' + Fv/m_e f' - h, f = Q e and h = Q D/m_e."""
    gains = {"bandwidth": W, "damping": ZETA, "filter_bandwidth": Q, "force_rate": B, "friction_fraction": 0.0}
    found = pushed(DisturbanceObserverControl(BELIEVED, **gains), 0.8)
    e, v, force, f, f_rate, h, h_rate, push = np.eye(8)
    for i in range(2):
        drag = found.viscous[i]
        f_second = Q**2 * (e - f) - np.sqrt(2) * Q * f_rate
        disturbance = f_second + drag * f_rate - h
        acceleration = force - drag * v + disturbance
        wanted = -(W**2) * e - 2 * ZETA * W * v - disturbance + drag * v
        turned = -(W**2) * v + (drag - 2 * ZETA * W) * acceleration
        rates = [
            v,
            force - drag * v + push,
            turned + B * (wanted - force),
            f_rate,
            f_second,
            h_rate,
            Q**2 * (force - h) - np.sqrt(2) * Q * h_rate,
            0 * e,
        ]
        predicted = expected(np.array(rates), found.push[i] * push + BESIDE[i] * (e + f), len(found.error))[:, 0]
        largest = np.abs(predicted).max()
        assert np.abs(found.error[:, i] - predicted).max() < 0.06 * largest
        assert abs(found.error[-1, i]) < 0.02 * largest


def settled(**gains: float) -> float:
    law = DisturbanceObserverControl(Parameters(), **gains)
    found = evaluate("BirthSIM/Circle-v2", law, "law", 4, 0, progress=False, randomize=True, duration=3.0)
    assert not any(found.lost)
    return float(np.median(found.metrics["settled_rms"]))


def test_it_follows_where_its_filter_is_quick_and_less_well_where_it_is_slow() -> None:
    assert settled() < 0.4 * settled(filter_bandwidth=2.0)


@pytest.mark.parametrize("gain", ["bandwidth", "filter_bandwidth"])
def test_a_gain_without_a_sign_is_refused(gain: str) -> None:
    with pytest.raises(ValueError, match=f"{gain} = -1.*; allowed: a positive number"):
        DisturbanceObserverControl(**{gain: -1.0})
