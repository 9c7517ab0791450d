"""A controller of a user's own, in Python and compiled: each axis by its own cylinder, opened in proportion to the error.

A file is used by its path, ``controller.py:Plain``. Where a distribution has it as a module, its entry point of the group
``birthsim.plugins`` names the module, and the controllers are used by their names."""

import numpy as np

from baselines.staged import ControllerStage, StagedController
from birthsim_env.loop.rows import Seen
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.records import Numbers, number
from birthsim_env.registry import register

GAIN = 10.0
"""1/m. An error of 11 mm opens a valve beyond its overlap of 0.11; with a gain of 15 the head swings."""


@register(controller="proportional-python", about="Opens valves in proportion to the error.", needs={"force sensor"})
class Plain:
    def __init__(self, parameters):
        pass

    def reset(self, lanes=None):
        pass

    def command(self, measurement, reference):
        along, up = np.clip(GAIN * (reference.position - measurement.position), -1, 1)
        return np.array([-up, up, along, -along])


class Gain(Numbers):
    gain = number("1/m", "opening per error")


@kernel
def push(world: int, seen: Seen, memory: int, gain: Gain, tables: int, lane: int, n: int):
    for i in range(n):
        along = max(-1.0, min(1.0, gain.gain * (seen.asked.position[0, i] - seen.position[0, i])))
        up = max(-1.0, min(1.0, gain.gain * (seen.asked.position[1, i] - seen.position[1, i])))
        seen.opening[0, i], seen.opening[1, i], seen.opening[2, i], seen.opening[3, i] = -up, up, along, -along
    return 0


@register(controller="proportional", about="Opens valves in proportion to the error, compiled.")
class Compiled(StagedController):
    reads_force = False

    def __init__(self, parameters=None, gain=GAIN):
        super().__init__(parameters)
        self.gain = gain

    def controller_stages(self, sampled):
        return [ControllerStage(push, Gain.numbers(gain=self.gain), np.zeros(0))]
