"""The target of a training, and of a validation, that is the impedance of ``admittance`` rather than its spring alone."""

from typing import Any

import numpy as np

from baselines.estimation.admittance import DAMPING_RATIO
from baselines.impedance import DeclaredMotion, mass_spring_damper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.simulation import Simulation


class Declared:
    """Where ``admittance`` would mean the end effector of every lane to be, were the hand's true force known to it."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        self.motion, self._force = DeclaredMotion(simulation.plant.num_envs), simulation.force
        self._reference = simulation.reference

    def begin(self, lanes: Any) -> None:
        """Episodes have begun in the lanes of a mask (N,)."""
        self.motion.offset[:, lanes] = 0.0
        self._force, self._reference = self.simulation.force, self.simulation.reference

    def follow(self) -> Array:
        """After a policy step: x, y (m), vx, vy (m/s), (4, N). Its gradient to a hand that feels the rig is left out."""
        simulation = self.simulation
        impedance = mass_spring_damper(self._reference, simulation.parameters.mechanics.mass, DAMPING_RATIO)
        force, self._reference = simulation.force, simulation.reference
        self.motion.advance(impedance, self._force, force, simulation.periods * simulation.period)
        self._force = force
        return np.concatenate([self._reference.position, self._reference.velocity]) + self.motion.offset
