"""An own controller in ten lines: proportional and derivative action on each axis, straight to the valves."""

import numpy as np


class PD:
    def __init__(self, parameters):
        self.parameters = parameters  # the rig, for controllers that need a model

    def reset(self, lanes=None):
        pass

    def command(self, measurement, reference):
        error = reference.position - measurement.position
        along, up = 6 * error + 2 * reference.velocity - measurement.velocity
        # Cylinder 2 points along x; extending cylinder 1 lowers the end effector.
        return np.clip([-up, up, along, -along], -1, 1)
