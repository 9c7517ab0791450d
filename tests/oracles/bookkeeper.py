"""Balances of mass and energy of the chambers, kept beside the plant by bookkeeping of flows, work and heat."""

import math

import numpy as np

from birthsim_env.physics.compiled.lanes import PRESSURES, TEMPERATURES, V1, V2, Y1, Y2, Array
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters

R, GAMMA, WALL = 287.05, 1.4, 293.15
CV, CP = R / (GAMMA - 1), GAMMA * R / (GAMMA - 1)
P, T = list(PRESSURES), list(TEMPERATURES)
KEEPING = 0.25e-3
"""s: the step of what keeps its own books."""
OTHER = [1, 0, 3, 2]
"""Chambers P1, N1, P2, N2; heat passes through the piston to the other chamber of the same cylinder."""


class Volumes:
    """Volumes, their rates and wall areas of the four chambers from bore, rod and stroke, (4, N)."""

    def __init__(self, rig: Parameters, state: Array) -> None:
        bore = np.repeat([rig.cylinder1.piston_diameter, rig.cylinder2.piston_diameter], 2)[:, None]
        rod = np.array([[0.0], [rig.cylinder1.rod_diameter], [0.0], [rig.cylinder2.rod_diameter]])
        half = np.repeat([rig.cylinder1.stroke, rig.cylinder2.stroke], 2)[:, None] / 2
        away = np.array([[1.0], [-1.0], [1.0], [-1.0]])
        area, length = math.pi * (bore**2 - rod**2) / 4, half + away * state[[Y1, Y1, Y2, Y2]]
        self.volume = rig.chambers.dead_volume + area * length
        self.rate = area * away * state[[V1, V1, V2, V2]]
        self.wall = 2 * area + math.pi * bore * length


def mass_and_energy(rig: Parameters, state: Array) -> Array:
    """What the chambers hold by their state: m = P V/(r T) and U = m cv T, (2, 4, N)."""
    mass = state[P] * Volumes(rig, state).volume / (R * state[T])
    return np.stack([mass, mass * CV * state[T]])


def sources(rig: Parameters, state: Array, flows: Array) -> Array:
    """d(m, U)/dt by bookkeeping: flows with the enthalpy of where they come from, work on the piston, heat; (2, 4, N)."""
    v, inside, h, g12 = Volumes(rig, state), state[T], rig.chambers.wall_heat_transfer, rig.chambers.piston_conductance
    supplied, exhausted = flows[:4], flows[4:]
    enthalpy = supplied * CP * np.where(supplied > 0, WALL, inside) - exhausted * CP * np.where(exhausted > 0, inside, WALL)
    heat = h * v.wall * (WALL - inside) + g12 * (inside[OTHER] - inside)
    return np.array([supplied - exhausted, enthalpy - state[P] * v.rate + heat])


class Bookkeeper:
    """Steps a plant's equations by the classical Runge-Kutta method with the balances beside them, in the same stages."""

    def __init__(self, rig: Parameters, lanes: int, step: float, start: Array | None = None) -> None:
        self.rig, self.plant, self.step = rig, Plant(rig, lanes), step
        if start is not None:
            self.plant.state = start
        self.ledger = mass_and_energy(rig, self.plant.state)

    def _rates(self, state: Array, command: Array, force: Array) -> tuple[Array, Array]:
        self.plant.state = state
        return self.plant.derivatives(state, command, force), sources(self.rig, state, self.plant.mass_flows())

    def advance(self, command: Array, force: Array, seconds: float) -> None:
        for _ in range(round(seconds / self.step)):
            h, x, book = self.step, self.plant.state.copy(), self.ledger
            k1, s1 = self._rates(x, command, force)
            k2, s2 = self._rates(x + h / 2 * k1, command, force)
            k3, s3 = self._rates(x + h / 2 * k2, command, force)
            k4, s4 = self._rates(x + h * k3, command, force)
            self.plant.state = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            self.ledger = book + h / 6 * (s1 + 2 * s2 + 2 * s3 + s4)

    def gap(self) -> Array:
        """Largest relative difference of books and chambers, (mass, energy)."""
        gap: Array = np.abs(self.ledger / mass_and_energy(self.rig, self.plant.state) - 1).max(axis=(1, 2))
        return gap
