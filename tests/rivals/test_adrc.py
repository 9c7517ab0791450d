"""Active disturbance rejection: its loop against Han's equations solved anew, and rigs that its model does not describe."""

import numpy as np
import pytest

from baselines.bench.evaluation import evaluate
from baselines.rivals.adrc import ActiveDisturbanceRejection, fading_memory
from birthsim_env.physics.rig.parameters import Parameters
from tests.rivals.unseen_weight import BELIEVED, BESIDE, expected, pushed

W, ZETA, OBSERVER, B = 20.0, 0.8, 60.0, 60.0


def test_a_push_that_no_sensor_sees_is_cancelled_as_the_equations_say() -> None:
    """States e, de/dt, D/m_e, z1, z2, z3 and the constant push, with the observer in continuous time."""
    gains = {"bandwidth": W, "damping": ZETA, "observer_bandwidth": OBSERVER, "force_rate": B, "friction_fraction": 0.0}
    law = ActiveDisturbanceRejection(BELIEVED, **gains)
    found = pushed(law, 0.8)
    e, v, force, z1, z2, z3, push = np.eye(7)
    for i in range(2):
        drag = found.viscous[i]
        wanted = -(W**2) * z1 - 2 * ZETA * W * z2 - z3
        turned = -(W**2) * z2 - 2 * ZETA * W * (z3 + force)
        wrong = e - z1
        rates = np.array(
            [
                v,
                force - drag * v + push,
                turned + B * (wanted - force),
                z2 + 3 * OBSERVER * wrong,
                z3 + force + 3 * OBSERVER**2 * wrong,
                OBSERVER**3 * wrong,
                0 * e,
            ]
        )
        predicted = expected(rates, found.push[i] * push + BESIDE[i] * (e + z1), len(found.error))[:, 0]
        largest = np.abs(predicted).max()
        assert np.abs(found.error[:, i] - predicted).max() < 0.06 * largest
        assert abs(found.error[-1, i]) < 0.02 * largest


@pytest.mark.parametrize("pole", [0.1, 0.5, 0.9])
def test_the_observer_has_three_equal_poles(pole: float) -> None:
    """Eigenvalues of (1 - K C) A of a triple integrator over a period."""
    period = 1e-3
    step = np.array([[1.0, period, period**2 / 2], [0.0, 1.0, period], [0.0, 0.0, 1.0]])
    gains = np.array(fading_memory(pole, period))
    polynomial = np.poly((np.eye(3) - np.outer(gains, [1.0, 0.0, 0.0])) @ step)
    np.testing.assert_allclose(polynomial, np.poly([pole] * 3), rtol=1e-9)


def settled(**gains: float) -> float:
    law = ActiveDisturbanceRejection(Parameters(), **gains)
    found = evaluate("BirthSIM/Circle-v2", law, "adrc", 4, 0, progress=False, randomize=True, duration=3.0)
    assert not any(found.lost)
    return float(np.median(found.metrics["settled_rms"]))


def test_it_follows_where_its_observer_is_quick_and_less_well_where_it_is_slow() -> None:
    assert settled() < 0.3 * settled(observer_bandwidth=5.0)


@pytest.mark.parametrize("gain", ["bandwidth", "observer_bandwidth"])
def test_a_gain_without_a_sign_is_refused(gain: str) -> None:
    with pytest.raises(ValueError, match=f"{gain} = -1.*; allowed: a positive number"):
        ActiveDisturbanceRejection(**{gain: -1.0})
