"""A driver for one cylinder on a rail behind a National Instruments card, to copy and to change:

    pip install nidaqmx                        # and NI-DAQmx, the driver of the card
    birthsim drive --driver examples/bench_nidaqmx.py:Bench --parameters bench.toml --dry-run --out out/bench

**It has been tried with a card that a test imitates, and with no real one.** Read docs/how-to/real_rig.md first, and wire an
emergency stop that needs no computer. Analogue inputs are the pressures of chambers P and N, the position of the rod and the
hand's force; one analogue output sets a 5/3 valve, 0 to 10 V with 5 V shut.
"""

import math

import nidaqmx
import numpy as np

from birthsim_drive.pace import Pace
from birthsim_env.loop.signals import Measurement

INPUTS = "Dev1/ai0:3"
"""Channels of pressure P, pressure N, position, force."""

OUTPUT = "Dev1/ao0"

PASCAL_PER_VOLT, PASCAL_AT_ZERO = 1.0e5, 1.013e5
"""A cell with 0 to 10 bar above the atmosphere on 0 to 10 V; pressures are absolute."""

METRE_PER_VOLT, METRE_AT_ZERO = 0.02, -0.1
"""A potentiometer of 0.2 m on 10 V; positions count from mid stroke, positive as the rod extends."""

NEWTON_PER_VOLT, NEWTON_AT_ZERO = 50.0, -250.0

SHUT, VOLT_PER_OPENING = 5.0, 5.0

SPEED_TIME = 0.003
"""s, time constant of the filter behind the difference of positions."""


class Bench:
    """Reads and writes one sample per control period, by the computer's clock."""

    sampled = True

    def __init__(self, rig):
        self._period, self._k2 = rig.electronics.control_period, rig.geometry.k2
        self._along = np.array([math.cos(rig.linkage.inclination), math.sin(rig.linkage.inclination)])
        self._pace, self._place, self._speed = Pace(self._period), None, 0.0
        self._tasks = self._inputs, self._outputs = nidaqmx.Task(), nidaqmx.Task()
        self._inputs.ai_channels.add_ai_voltage_chan(INPUTS, min_val=-10.0, max_val=10.0)
        self._outputs.ao_channels.add_ao_voltage_chan(OUTPUT, min_val=0.0, max_val=10.0)
        self._outputs.write(SHUT)

    def read(self):
        """Wait for the next control period, and sample all inputs at once."""
        time = np.float64(self._pace.wait() * self._period)
        pressure_p, pressure_n, position, force = self._inputs.read()
        place = METRE_AT_ZERO + METRE_PER_VOLT * position
        if self._place is not None:
            change = (place - self._place) / self._period
            self._speed += (change - self._speed) * self._period / (SPEED_TIME + self._period)
        self._place = place
        pressures = np.full(4, PASCAL_AT_ZERO)  # there is no cylinder 1
        pressures[2:] += PASCAL_PER_VOLT * np.array([pressure_p, pressure_n])
        pushed = NEWTON_AT_ZERO + NEWTON_PER_VOLT * force
        return Measurement(
            time,
            (self._k2 + place) * self._along,
            time,
            self._speed * self._along,
            pressures,
            pushed * self._along,
            self.sampled,
        )

    def write(self, openings):
        """Set the 5/3 valve, which gives chamber P what it takes from chamber N: half the difference of both openings."""
        self._outputs.write(SHUT + VOLT_PER_OPENING * 0.5 * (openings[2] - openings[3]))

    def stop(self):
        """Shut the valve and let go of the card."""
        tasks, self._tasks = self._tasks, ()
        if tasks:
            self._outputs.write(SHUT)
        for task in tasks:
            task.close()
