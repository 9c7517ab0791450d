"""What a force sensor measures when nobody touches: its bias, taken over the first moments of an episode.

Force sensors are tared so before use. While a hand rests on the head, no sensor of the rig separates bias and hand: the force
balance of the chambers gives the hand only up to friction, which is ten times the bias. So a bias beyond what the sensor is
believed to have is not taken off: a hand that was there at the start costs no more than that.
"""

from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array

TIME = 0.25
"""s; assumed: over which the force is averaged. Noise of 0.1 N at 1 kHz leaves 6 mN."""


@helper
def tare(bias: Array, time: Array, measured: Array, most: float, period: float, force: Array) -> None:
    """Writes ``force`` (2, N), N: ``measured`` (2, N) less its mean until ``TIME``, of which +-``most`` N count, ``bias``."""
    for i in range(time.shape[0]):
        samples = time[i] / period + 1.0
        for axis in range(2):
            if samples < 1.5:
                bias[axis, i] = 0.0
            if time[i] < TIME:
                counted = max(-most, min(most, measured[axis, i]))
                bias[axis, i] += (counted - bias[axis, i]) / samples
            force[axis, i] = measured[axis, i] - bias[axis, i]
