"""A camera: positions are whole pixels, no more than half a pixel off."""

import gymnasium
import numpy as np

from birthsim_env.parts.sensors.camera import PIXEL


def test_positions_are_whole_pixels_and_near_the_true_ones():
    env = gymnasium.make("BirthSIM/Circle-v2", sensors="camera").unwrapped
    env.reset(seed=0)
    for _ in range(50):
        env.step(np.zeros(4, np.float32))
        seen, true = env.measurement.position, env.simulation.motion[:2, 0]
        np.testing.assert_allclose(seen / PIXEL, np.round(seen / PIXEL), atol=1e-6)
        assert np.abs(seen - true).max() <= 0.5001 * PIXEL
