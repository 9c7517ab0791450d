"""One cylinder on a rail, derived from energy: nothing of the package but the data of a rig is imported.

Coordinates: the carriage's place s along the rail (m) and its momentum; of either chamber the air's mass and internal
energy U; the bristle's deflection; both spools. The energies are p^2/2m, m g s sin(a), and U of the chambers, whose
generalised forces on s are -dU/ds of an adiabatic displacement: with U proportional to V^(1 - gamma), (gamma - 1) U / V dV/ds.
The atmosphere on the rod, friction and the hand do the work that is left. Every flow carries the enthalpy of where it comes
from.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from birthsim_env.physics.rig.parameters import Parameters

Array = NDArray[np.float64]

SCALES = np.array([0.1, 1.0, 1e-4, 1e-4, 20.0, 20.0, 1e-4, 1.0, 1.0])
"""Sizes of the state, in which one absolute tolerance serves all."""


class OneCylinder:
    """A carriage on a rail; ``state``: s, p, masses of the air in chambers P and N, energies of both, bristle, both spools."""

    def __init__(self, rig: Parameters, place: float, pressures: Array, relaxation_limit: float) -> None:
        self.rig, self._limit, self.energies = rig, relaxation_limit, 0.0
        cylinder, gas = rig.cylinder2, rig.air
        full = math.pi * cylinder.piston_diameter**2 / 4
        self.areas = np.array([full, full - math.pi * cylinder.rod_diameter**2 / 4])
        volumes = self.volumes(place)
        masses = pressures * volumes / (gas.gas_constant * gas.temperature)
        energies = pressures * volumes / (gas.heat_capacity_ratio - 1)
        self.state: Array = np.array([place, 0.0, *masses, *energies, 0.0, 0.0, 0.0])

    def volumes(self, place: float) -> Array:
        """Of chambers P and N, m3, with the piston ``place`` m from mid stroke."""
        half = self.rig.cylinder2.stroke / 2
        columns = self.areas * np.array([half + place, half - place])
        return np.asarray(self.rig.chambers.dead_volume + columns)

    @property
    def pressures(self) -> Array:
        """Of chambers P and N, Pa."""
        return np.asarray((self.rig.air.heat_capacity_ratio - 1) * self.state[4:6] / self.volumes(self.state[0]))

    @property
    def speed(self) -> float:
        """Of the carriage, m/s."""
        return float(self.state[1] / self.rig.mechanics.mass)

    def rates(self, state: Array, openings: Array, push: float) -> Array:
        """d(state)/dt under openings of the valves of chambers P and N, and a ``push`` along the rail, N."""
        rig, gas, (place, momentum, *_) = self.rig, self.rig.air, state
        masses, energies, bristle, spools = state[2:4], state[4:6], state[6], state[7:9]
        m, gamma = rig.mechanics.mass, gas.heat_capacity_ratio
        speed, volumes, swept = momentum / m, self.volumes(place), self.areas * np.array([1.0, -1.0])
        temperatures = (gamma - 1) * energies / (masses * gas.gas_constant)
        pushes = (gamma - 1) * energies / volumes * swept
        by_air = pushes.sum() - gas.atmospheric_pressure * swept.sum()
        weight = m * rig.mechanics.gravity * math.sin(rig.linkage.inclination)
        friction, bending = self._friction(speed, bristle, pushes / swept)
        heat = self._heat(place, temperatures)
        flows = np.array([self._flows(k, spools[k], (pushes / swept)[k], temperatures[k]) for k in range(2)])
        stored = flows[:, 1] - pushes * speed + heat
        lag = (openings - spools) / rig.valves.time_constant
        return np.array([speed, by_air - weight - friction + push, *flows[:, 0], *stored, bending, *lag])

    def _friction(self, speed: float, bristle: float, pressures: Array) -> tuple[float, float]:
        law, seal = self.rig.friction, self.rig.cylinder2
        pressed = seal.pressure_friction * (pressures - self.rig.air.atmospheric_pressure).sum()
        sliding = max(seal.coulomb_friction + pressed, 0.0) * (1 + math.copysign(seal.direction_asymmetry, speed))
        level = sliding * (1 + (law.static_ratio - 1) / (1 + (speed / law.stribeck_speed) ** 2))
        pace = law.bristle_stiffness * abs(speed) / level
        bending = (speed - pace * bristle) * min(1.0, self._limit / pace if pace > 0 else 1.0)
        held = law.bristle_stiffness * bristle + law.bristle_damping * bending
        return held + seal.viscous_friction * speed, bending

    def _heat(self, place: float, temperatures: Array) -> Array:
        """Into both chambers from their walls and through the piston, W."""
        air, bore = self.rig.chambers, self.rig.cylinder2.piston_diameter
        lengths = self.rig.cylinder2.stroke / 2 + np.array([place, -place])
        walls = 2 * self.areas + math.pi * bore * lengths
        between = air.piston_conductance * (temperatures[::-1] - temperatures)
        return np.asarray(air.wall_heat_transfer * walls * (self.rig.air.temperature - temperatures) + between)

    def _flows(self, chamber: int, spool: float, pressure: float, temperature: float) -> tuple[float, float]:
        """Mass, kg/s, and enthalpy, W, that a valve lets into a chamber."""
        valves, gas, own = self.rig.valves, self.rig.air, (self.rig.valve_p2, self.rig.valve_n2)[chamber]
        cp = gas.gas_constant * gas.heat_capacity_ratio / (gas.heat_capacity_ratio - 1)
        mass, enthalpy = 0.0, 0.0
        for side, beyond, way in (("supply", gas.supply_pressure, 1.0), ("exhaust", gas.atmospheric_pressure, -1.0)):
            overlap, bend = (getattr(valves, f"{side}_{n}") + getattr(own, f"{side}_{n}") for n in ("overlap", "curvature"))
            share = (1 + getattr(own, f"{side}_conductance")) * (valves.exhaust_ratio if side == "exhaust" else 1.0)
            open_part = max(way * spool - overlap, 0.0) / (1 - overlap)
            part = valves.leakage_ratio + share * open_part * (1 + bend * (1 - open_part))
            inward = beyond > pressure
            high, low = max(beyond, pressure), min(beyond, pressure)
            hot = gas.temperature if inward else temperature
            flow = valves.sonic_conductance * part * gas.reference_density * high
            flow *= math.sqrt(gas.reference_temperature / hot) * self._psi(low / high) * (1 if inward else -1)
            mass, enthalpy = mass + flow, enthalpy + flow * cp * hot
        return mass, enthalpy

    def _psi(self, ratio: float) -> float:
        """The flow function of ISO 6358, straight from a ratio of 0.99 on."""
        b = self.rig.valves.critical_ratio
        curved = math.sqrt(1 - (max(min(ratio, 0.99) - b, 0.0) / (1 - b)) ** 2)
        return curved * (1.0 if ratio < 0.99 else (1 - ratio) / 0.01)

    def advance(self, openings: Array, push: float, seconds: float, rtol: float = 1e-11, atol: float = 1e-14) -> None:
        """Integrate under constant inputs."""

        def scaled(_: float, state: Array) -> Any:
            return self.rates(state * SCALES, openings, push) / SCALES

        found = solve_ivp(scaled, (0.0, seconds), self.state / SCALES, method="DOP853", rtol=rtol, atol=atol)
        assert found.success, found.message
        self.state = found.y[:, -1] * SCALES
