"""What happens to a lane that ends, in every mode that Gymnasium knows, and Gymnasium's own wrappers around it."""

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import birthsim_env

assert birthsim_env  # importing it registers the ids
PROBE = "BirthSIM/Probe-v2"
SLAM = np.array([[0, 0, 1, -1], [0, 0, 0, 0]], np.float32)


def make(mode=AutoresetMode.NEXT_STEP, lanes=2, **arguments):
    return gymnasium.make_vec(PROBE, num_envs=lanes, duration=0.4, randomize=True, autoreset_mode=mode, **arguments)


def test_the_next_step_is_gymnasiums_own_default_and_does_what_its_vectorization_does():
    native = gymnasium.make_vec(PROBE, num_envs=2, duration=0.4, randomize=True)
    generic = gymnasium.make_vec(PROBE, num_envs=2, vectorization_mode="sync", duration=0.4, randomize=True)
    assert native.autoreset_mode is native.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    for one, other in zip(native.reset(seed=3), generic.reset(seed=3), strict=True):
        if isinstance(one, np.ndarray):
            np.testing.assert_array_equal(one, other)
    ends = 0
    for _ in range(120):
        (*mine, info), (*its, other) = native.step(SLAM), generic.step(SLAM)
        for one, expected in zip(mine, its, strict=True):
            np.testing.assert_array_equal(one, expected)
        np.testing.assert_array_equal(info["position"], other["position"])
        ends += mine[2] + mine[3]
    assert (ends >= 2).all(), "both lanes begin anew, one after it was lost, one at its end"


def test_a_lane_waits_for_its_reset_where_autoreset_is_disabled():
    env = make("Disabled", lanes=2)
    env.reset(seed=0)
    while True:
        terminated = env.step(SLAM)[2]
        if terminated.any():
            break
    with pytest.raises(ValueError, match=r"lanes \[0\] have ended; allowed: reset\(options=\{'reset_mask': ...\}\)"):
        env.step(SLAM)
    _, info = env.reset(options={"reset_mask": terminated})
    assert info["time"][0] == 0.0
    assert info["time"][1] > 0.0
    env.step(SLAM)


def test_rounding_in_single_precision_is_no_error():
    env = gymnasium.make(PROBE)
    env.reset(seed=0)
    env.step(np.full(4, np.nextafter(np.float32(1), np.float32(2)), np.float32))
    with pytest.raises(ValueError, match=r"action\[0\] = 1\.0001"):
        env.step(np.array([1.0001, 0, 0, 0]))
