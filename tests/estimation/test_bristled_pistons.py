"""Samples of both pistons that arrive late: against where pistons with a steady speed were."""

import numpy as np
import pytest

from baselines.estimation.hand import bristled_pistons
from baselines.estimation.hand.bristle_filter import Bristled
from birthsim_env.loop.signals import Joints

KAPPA, AGE, NOISE, VARIANCE = 2.0, 0.01, 1e-4, 1e-8


def test_a_late_sample_is_compared_with_where_a_piston_was_and_trusted_less_the_faster_it_moves():
    b, joints, sample = Bristled(np.zeros((Bristled.size, 1))), Joints(np.zeros((4, 1))), Joints(np.zeros((4, 1)))
    b.position[:, 0], b.yy[:] = (0.20, 0.30), VARIANCE
    joints.speed[:, 0] = speed = np.array([0.05, -0.4])
    off = np.array([2e-5, -3e-5])
    sample.position[:, 0] = b.position[:, 0] - speed * AGE + off
    before = b.position[:, 0].copy()
    bristled_pistons.see(b, 0, sample, joints, KAPPA, AGE, NOISE)
    # Piston 1 moves by 1/kappa of what the head does across, and so does the noise.
    noise = NOISE / np.array([KAPPA, 1.0]) + bristled_pistons.LATE * np.abs(speed)
    gain = VARIANCE / (VARIANCE + noise**2)
    assert b.position[:, 0] - before == pytest.approx(gain * off)
    assert b.yy[:, 0] == pytest.approx((1.0 - gain) * VARIANCE)
