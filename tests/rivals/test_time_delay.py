"""Time-delay control: its loop against the difference equations of its papers, written anew, and its delays."""

import numpy as np
import pytest
from scipy.linalg import expm

from baselines.bench.evaluation import evaluate
from baselines.rivals.time_delay import LONGEST, TimeDelayControl
from birthsim_env.physics.rig.parameters import Parameters
from tests.rivals.test_rival_laws import PERIOD
from tests.rivals.unseen_weight import BELIEVED, BESIDE, pushed

W, ZETA, B, DELAY = 20.0, 0.8, 60.0, 12


@pytest.mark.parametrize("g", [0.0, 8.0])
def test_a_push_that_no_sensor_sees_is_cancelled_as_the_equations_say(g: float) -> None:
    """Period by period: e, de/dt and D/m_e under a held force rate, exactly; what the model lacked from the last 12 periods."""
    gains = {"bandwidth": W, "damping": ZETA, "delay": DELAY * PERIOD, "ideal_velocity_rate": g, "force_rate": B}
    law = TimeDelayControl(BELIEVED, **gains, friction_fraction=0.0, dead_zone=0.0)
    found = pushed(law, 0.8)
    for i in range(2):
        drag = found.viscous[i]
        # Of e, v, D/m_e and, held, the push and the rate of D/m_e.
        step = expm(np.array([[0, 1, 0, 0, 0], [0, -drag, 1, 1, 0], [0, 0, 0, 0, 1], *np.zeros((2, 5))]) * PERIOD)
        state = np.array([BESIDE[i], 0.0, 0.0, found.push[i], 0.0])
        summed, path = -2 * ZETA / W * BESIDE[i], list[float]()
        speeds, forces = [0.0] * DELAY, [0.0] * DELAY
        for _ in found.error:
            e, v, force = state[:3]
            path.append(e)
            lacked = (v - speeds[-DELAY]) / (DELAY * PERIOD) - np.mean(forces[-DELAY:])
            ideal = -2 * ZETA * W * e - W**2 * summed
            acceleration = force + lacked
            wanted = -(W**2) * e - 2 * ZETA * W * v - lacked + g * (ideal - v)
            turned = -(W**2) * v - 2 * ZETA * W * acceleration + g * (-2 * ZETA * W * v - W**2 * e - acceleration)
            speeds.append(v)
            forces.append(force)
            summed += PERIOD * e
            state[4] = turned + B * (wanted - force)
            state = step @ state
        largest = np.abs(path).max()
        assert np.abs(found.error[:, i] - path).max() < 0.04 * largest
        assert abs(found.error[-1, i]) < 0.05 * largest


def settled(**gains: float) -> float:
    law = TimeDelayControl(Parameters(), **gains)
    found = evaluate("BirthSIM/Circle-v2", law, "law", 4, 0, progress=False, randomize=True, duration=3.0)
    assert not any(found.lost)
    return float(np.median(found.metrics["settled_rms"]))


def test_it_follows_better_with_a_short_delay() -> None:
    assert settled(ideal_velocity_rate=0.0) < 0.6 * settled(ideal_velocity_rate=0.0, delay=0.06)


def test_a_delay_is_whole_periods_and_one_beyond_what_it_remembers_is_refused() -> None:
    assert TimeDelayControl(delay=3.4e-3)._designs[0]["periods"] == 3
    assert TimeDelayControl(delay=1e-5)._designs[0]["periods"] == 1
    with pytest.raises(ValueError, match=f"delay = 0.07; allowed: up to {LONGEST * PERIOD:g} s"):
        TimeDelayControl(delay=0.07)
