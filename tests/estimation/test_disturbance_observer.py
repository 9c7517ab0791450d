"""The disturbance observer from measured speeds: its double pole, and unknown forces on the model of points."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from birthsim_env.loop.signals import Measurement
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import rigid_body
from tests.oracles.observed import Measured

PERIOD = 1e-3
RIG = Parameters().replace({"geometry.gamma3": 1.45})


def measured(piston: Array, speed: Array, pressures: Array, rig: Parameters, user: Array) -> Measurement:
    """Exact sensors; pistons (2, N), pressures (4, N)."""
    return rigid_body.seen(rigid_body.Instant(piston, speed, pressures, pressures[:2]), rig, user)


@pytest.mark.parametrize("bandwidth", [30.0, 120.0])
@pytest.mark.parametrize("period", [2.5e-4, 1e-3, 4e-3])
def test_an_unknown_force_is_found_with_a_double_pole(bandwidth: float, period: float) -> None:
    """Cylinder 2 alone, weightless: d follows F/m (1 - (1 + w t) e^(-w t)), in steps with the pole 1 - w T twice."""
    changes = {"mechanics.gravity": 0.0, "cylinder2.viscous_friction": 0.0, "electronics.control_period": period}
    rig = RIG.replace(changes)
    estimator, unknown, errors = Measured(rig, bandwidth, 1), 6.0, []
    a = unknown / rig.mechanics.mass
    pressures = np.full((4, 1), rig.air.atmospheric_pressure)
    times = period * np.arange(round(8 / bandwidth / period))
    for time in times:
        piston, speed = np.array([[0.01], [-0.1 + 0.5 * a * time**2]]), np.array([[0.0], [a * time]])
        estimator.update(measured(piston, speed, pressures, rig, np.zeros((2, 1))), np.zeros((2, 1)), np.zeros((2, 1)))
        errors.append(estimator.pistons.disturbance[:, 0] - [0.0, a])
    error = np.array(errors)
    assert np.abs(error[:, 0]).max() < 1e-9, "cylinder 1 feels nothing"
    kept = 1 - bandwidth * period
    left = error[2:, 1] - 2 * kept * error[1:-1, 1] + kept**2 * error[:-2, 1]
    np.testing.assert_allclose(left[1:], 0, rtol=0, atol=1e-9 * a)
    expected = -a * (1 + bandwidth * times) * np.exp(-bandwidth * times)
    np.testing.assert_allclose(error[:, 1], expected, rtol=0, atol=1.2 * bandwidth * period * a)


def swinging(unknown: Array, known: Callable[[float], Array], user: Array, seconds: float) -> tuple[Array, Array, Array]:
    """Pistons and speeds (T, 2) of the rig of points under forces along them, and its constant pressures (4, 1)."""
    now = rigid_body.near_balance(RIG, 1, seed=5, speed=0.1, push=3.0)
    force = rigid_body.forces(now.pressures, RIG)

    def slope(time: float, state: Array) -> Array:
        piston, speed = state[:2, None], state[2:, None]
        constant = unknown[:, None] + known(time)[:, None]
        wanted = rigid_body.acceleration(piston, speed, force, RIG, constant, user[:, None])
        return np.concatenate([state[2:], rigid_body.joint_acceleration(piston, speed, wanted, RIG)[:, 0]])

    start = np.concatenate([now.piston[:, 0], now.speed[:, 0]])
    times = PERIOD * np.arange(round(seconds / PERIOD))
    path = solve_ivp(slope, (0, times[-1]), start, t_eval=times, rtol=1e-9, atol=1e-12).y.T
    assert np.all(np.abs(path[:, :2]) < [0.09, 0.19]), "the run must end before a stop"
    return path[:, :2], path[:, 2:], now.pressures


def test_unknown_forces_on_both_pistons_of_the_moving_rig() -> None:
    """d, 2/w late, is the unknown force over the apparent mass; what is known, of user and pistons, is not in it."""
    unknown, user = np.array([15.0, -8.0]), np.array([6.0, 12.0])

    def known(time: float) -> Array:
        return np.array([4.0 * np.sin(20 * time), -6.0 * np.cos(15 * time)])

    piston, speed, pressures = swinging(unknown, known, user, 0.3)
    assert np.abs(speed).max() > 0.2, "it must move"
    estimator = Measured(RIG, 200.0, 1)
    for tick, (y, v) in enumerate(zip(piston, speed, strict=True)):
        seen = measured(y[:, None], v[:, None], pressures, RIG, user[:, None])
        joints = estimator.update(seen, user[:, None], known(tick * PERIOD)[:, None])
        np.testing.assert_allclose(joints[:, 0], [*y, *v], rtol=0, atol=1e-12)
        if tick > 150:
            kappa = np.hypot(*rigid_body.jacobians(y[:, None], RIG)[0, :, 0])
            expected = unknown / (RIG.mechanics.mass * np.array([kappa**2, 1.0]))
            np.testing.assert_allclose(estimator.pistons.disturbance[:, 0], expected, rtol=0, atol=0.02)  # m/s2
