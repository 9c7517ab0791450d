"""What a force sensor measures when nobody touches: its bias, taken over the first moments of an episode.

Force sensors are tared so before use. While a hand rests on the head, no sensor of the rig separates bias and hand: the force
balance of the chambers gives the hand only up to friction, which is ten times the bias. So a bias beyond what the sensor is
believed to have is not taken off: a hand that was there at the start costs no more than that. A hand that begins to push, or
that moves, leaves the mean so far so quickly that its samples can be told apart, and they are not counted.
"""

from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array

TIME = 0.25
"""s; assumed: over which the force is averaged. Noise of 0.1 N at 1 kHz leaves 6 mN."""

STEADY = 0.5
"""N; assumed: a sample of a force sensor that is farther from the mean is a hand's. Its noise is 0.03 to 0.3 N."""


@helper
def tare(bias: Array, time: Array, measured: Array, most: float, steady: float, period: float, force: Array) -> None:
    """Writes ``force`` (2, N), N: ``measured`` (2, N) less its mean until ``TIME``, ``bias``, of which +-``most`` N count.

    The mean leaves out samples that are more than ``steady`` N from it.
    """
    for i in range(time.shape[0]):
        samples = time[i] / period + 1.0
        for axis in range(2):
            if samples < 1.5:
                bias[axis, i] = 0.0
            if time[i] < TIME and (samples < 1.5 or abs(measured[axis, i] - bias[axis, i]) < steady):
                counted = max(-most, min(most, measured[axis, i]))
                bias[axis, i] += (counted - bias[axis, i]) / samples
            force[axis, i] = measured[axis, i] - bias[axis, i]
