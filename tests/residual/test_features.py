"""What an informed policy is shown: where the hand should find the end effector, and how far it is from there."""

import gymnasium
import numpy as np
import pytest

from agents.residual.features import SCALES, EstimatorFeatures
from birthsim_env.loop.signals import Reference
from birthsim_env.observation import LIMIT


@pytest.mark.parametrize(("law", "reach"), [("admittance-adaptive", 0.3), ("none", 0.02)])
def test_what_is_shown_is_true_with_exact_sensors(law, reach):
    """Place = target + F/K + what is owed + error, and the same of speeds, a control period before the observation."""
    arguments = {"num_envs": 3, "user_force": "noise", "randomize": True, "informed": True, "policy_period": 1e-3}
    env = gymnasium.make_vec("BirthSIM/CircleResidual-v2", law=law, **arguments)
    env.reset(seed=3)
    rng, largest = np.random.default_rng(0), 0.0
    for _ in range(300):
        simulation = env.simulation
        motion, reference, force = simulation.motion, simulation.reference, simulation.force
        seen, *_ = env.step(rng.uniform(-reach, reach, env.action_space.shape).astype(np.float32))
        told = EstimatorFeatures(seen[:, -EstimatorFeatures.size :].T * SCALES[:, None])
        given = Reference(reference.rows).compliant_target(force)
        error = np.clip(motion[:2] - given - told.lag, -LIMIT * SCALES[0], LIMIT * SCALES[0])
        np.testing.assert_allclose(error, told.error, atol=1e-8)
        rate = np.clip(motion[2:] - reference.velocity - told.velocity, -LIMIT * SCALES[2], LIMIT * SCALES[2])
        np.testing.assert_allclose(rate, told.error_rate, atol=1e-6)
        largest = max(largest, float(np.abs(told.lag).max()))
    assert largest > 1e-4, "a pushed mass comes late"
