"""How many times as long as the plant's twin in C, alone, a policy step of a lane takes."""

import sys
import tempfile
from pathlib import Path

import numpy as np

import birthsim_env
from birthsim_env.physics import dynamics

# asv runs one checkout's benchmarks on another's package, so these come by their folder.
sys.path.append(str(Path(__file__).resolve().parents[2] / "studies" / "speed"))

from stopwatch import seconds_per_call, step, vector_step
from twin import Twin

ENVIRONMENT, LANES, STEPS, BUDGET = "BirthSIM/Circle-v2", 256, round(0.01 / dynamics.INTEGRATION_STEP), 2.0
"""Lanes beside each other, integration steps in a policy step, and CPU seconds of a measurement."""


class Ratios:
    """CPU times, divided by the twin's in the same process and minute."""

    unit, timeout = "times the C twin", 1800.0  # a new environment compiles its kernels

    def setup(self):
        """Measure the twin."""
        with tempfile.TemporaryDirectory() as folder:
            self._twin = self._seconds(Twin(Path(folder)).advance)

    def _seconds(self, advance):
        """CPU s of a policy step and lane of the plant alone."""
        plant = birthsim_env.Plant(num_envs=LANES)
        command, forces = np.random.default_rng(0).uniform(-0.05, 0.05, (4, LANES)), np.zeros((1, 2, LANES))
        rig, impacts, start = plant.lane_parameters, plant.impacts, plant.state.copy()

        def policy_step():
            plant.state[:] = start
            advance(plant.state, command, forces, rig, STEPS, dynamics.INTEGRATION_STEP, impacts)

        return seconds_per_call(policy_step, BUDGET) / LANES

    def track_plant(self):
        """The plant's kernel."""
        return self._seconds(dynamics.advance) / self._twin

    def track_single_environment(self):
        """``gymnasium.make``."""
        return step(ENVIRONMENT, BUDGET) / self._twin

    def track_lanes(self):
        """``gymnasium.make_vec``, on one thread."""
        return vector_step(ENVIRONMENT, LANES, BUDGET, num_threads=1) / self._twin

    def track_honest_lanes(self):
        """With the sensors of data sheets."""
        return vector_step(ENVIRONMENT, LANES, BUDGET, num_threads=1, sensors="honest") / self._twin
