"""The whole rig a second time, from first principles and in other coordinates, for an adaptive method of SciPy's.

It is the oracle of the plant: tests compare both, and ``accuracy`` measures the plant's error against it. State (18): end
effector x, y, vx, vy; air masses (4) and internal energies (4) of chambers P1, N1, P2, N2; bristles z1, z2; spools (4). Rod
forces act between points, chambers obey conservation of mass and energy, and nothing of the package is imported but the data of
a rig.

With generalised Maxwell slip the forces of the elements follow, four of piston 1 and four of piston 2. Each sticks or slips
until an event, whose instant is found: it reaches its share of the level, or its piston turns.
"""

from collections.abc import Callable
from typing import Any, TypeVar

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.seals.maxwell_slip import ELEMENTS, REACH, STIFFNESS

Array = NDArray[np.float64]
F = TypeVar("F", bound=Callable[..., Any])

LEFT_OUT = {
    "mechanics.stop_stiffness": "no motion that is compared meets an end stop",
    "mechanics.stop_damping": "no motion that is compared meets an end stop",
    "chambers.tube_length": "an option, compared with a model of its own in tests/physics/plant/test_options.py",
    "chambers.tube_diameter": "an option, compared with a model of its own in tests/physics/plant/test_options.py",
}
"""Parameters that ``dynamics`` computes with and this model does not, and why not."""

SCALES = np.array([0.1, 0.1, 0.1, 0.1, *[1e-4] * 4, *[20.0] * 4, 1e-4, 1e-4, *[1.0] * 4])
ELEMENT_SCALES = np.ones(2 * ELEMENTS)
"""Size of each state: the solver sees multiples of it, so that one absolute tolerance serves all."""


def constants(rig: Parameters) -> tuple[Array, ...]:
    """Numbers of a rig: linkage, mass, friction per cylinder, its law, chambers, valves, their edges, air.

    The last numbers of the law are the rate at which a bristle's relaxation is held, here nowhere, and the way in which each
    element slips, 1 or -1, and 0 of those that stick.
    """
    g, m, f, v, air = rig.geometry, rig.mechanics, rig.friction, rig.valves, rig.air
    cylinders = (rig.cylinder1, rig.cylinder2)
    pivot = g.d3 * np.exp(1j * g.gamma3)
    linkage = np.array([pivot.real, pivot.imag, g.d6, g.k1, g.k2, m.mass, m.gravity, rig.linkage.is_rail])
    sizes = [(c.piston_diameter, c.rod_diameter, c.stroke) for c in cylinders]
    rubbing = [(c.coulomb_friction, c.pressure_friction, c.direction_asymmetry, c.viscous_friction) for c in cylinders]
    pistons = np.array([(*size, *level) for size, level in zip(sizes, rubbing, strict=True)])
    bristle = f.bristle_stiffness, f.bristle_damping
    number = ("coulomb", "lugre", "elasto_plastic", "gms").index(f.law)
    numbers = f.static_ratio, f.stribeck_speed, *bristle, f.sign_speed, f.breakaway_ratio, f.attraction
    law = np.array([number, *numbers, np.inf, *np.zeros(2 * ELEMENTS)], dtype=float)
    heat = np.array([rig.chambers.dead_volume, rig.chambers.wall_heat_transfer, rig.chambers.piston_conductance])
    valve = np.array([v.sonic_conductance, v.critical_ratio, v.leakage_ratio * v.sonic_conductance, v.time_constant])
    edges = np.empty((4, 2, 3))  # overlap, curvature and share of the edges to supply and exhaust
    for k, own in enumerate((rig.valve_p1, rig.valve_n1, rig.valve_p2, rig.valve_n2)):
        to_supply = v.supply_overlap + own.supply_overlap, v.supply_curvature + own.supply_curvature
        to_exhaust = v.exhaust_overlap + own.exhaust_overlap, v.exhaust_curvature + own.exhaust_curvature
        edges[k, 0] = *to_supply, 1 + own.supply_conductance
        edges[k, 1] = *to_exhaust, v.exhaust_ratio * (1 + own.exhaust_conductance)
    edges[:, :, 0], edges[:, :, 1] = edges[:, :, 0].clip(0), edges[:, :, 1].clip(-0.95, 0.95)
    around = air.supply_pressure, air.atmospheric_pressure, air.temperature
    reference = air.reference_density, air.reference_temperature
    gas = np.array([*around, air.gas_constant, air.heat_capacity_ratio, *reference])
    return linkage, pistons, law, heat, valve, edges, gas


def compiled(function: F) -> F:
    """Machine code of a function, in this module's own way."""
    fast: Any = numba.njit(function)
    return fast  # type: ignore[no-any-return]


@compiled
def orifice(conductance: float, p_up: float, t_up: float, p_down: float, b: float, rho: float, t_ref: float) -> float:
    """ISO 6358 mass flow for p_up >= p_down, kg/s."""
    x = p_down / p_up
    if x < b:
        psi = 1.0
    elif x < 0.99:
        psi = np.sqrt(1 - ((x - b) / (1 - b)) ** 2)
    else:
        psi = np.sqrt(1 - ((0.99 - b) / (1 - b)) ** 2) * (1 - x) * 100
    flow: float = conductance * rho * p_up * np.sqrt(t_ref / t_up) * psi
    return flow


@compiled
def opened(stroke: float, edge: Array) -> float:
    """Part of the conductance that an edge opens after a stroke towards it: nothing within the overlap, then a parabola."""
    overlap, curvature, share = edge
    if stroke <= overlap:
        return 0.0
    t = (stroke - overlap) / (1 - overlap)
    part: float = share * t * (1 + curvature * (1 - t))
    return part


@compiled
def plastic_fraction(z: float, v: float, steady: float, breakaway: float) -> float:
    """alpha of the elasto-plastic law: where the bristle leans the way it moves, a cubic from z_ba to z_ss."""
    if z * v <= 0 or abs(z) <= breakaway * steady:
        return 0.0
    if abs(z) >= steady:
        return 1.0
    s = (abs(z) - breakaway * steady) / (steady - breakaway * steady)
    return 3 * s**2 - 2 * s**3


@compiled
def element_rate(
    force: float, way: float, v: float, strength: float, stiffness: float, level: float, attraction: float
) -> float:
    """Rate of the force of an element, N/s, that sticks, or slips along ``way``, no faster than its piston bends it."""
    if way == 0:
        return stiffness * v
    return way * min(attraction * (strength - way * force / level), way * stiffness * v)


@compiled
def rates(
    s: Array,
    command: Array,
    push: Array,
    linkage: Array,
    pistons: Array,
    law: Array,
    heat: Array,
    valve: Array,
    edges: Array,
    gas: Array,
) -> Array:
    """d(state)/dt."""
    return rates_and_levels(np.zeros(4), s, command, push, linkage, pistons, law, heat, valve, edges, gas)


@compiled
def rates_and_levels(
    found: Array,
    s: Array,
    command: Array,
    push: Array,
    linkage: Array,
    pistons: Array,
    law: Array,
    heat: Array,
    valve: Array,
    edges: Array,
    gas: Array,
) -> Array:
    """d(state)/dt, with the speeds of both pistons and their levels G(v) in ``found`` (4,)."""
    ox, oy, d6, k1, k2, mass, gravity, is_rail = linkage
    supply, atmosphere, ambient, r, gamma, rho, t_ref = gas
    ds = np.zeros(len(s))
    x, y, vx, vy = s[0], s[1], s[2], s[3]

    # The linkage as points: beam direction e, its left normal n, attachment A, rod direction u.
    r2 = np.sqrt(x * x + y * y)
    ex, ey = x / r2, y / r2
    nx, ny = -ey, ex
    ax, ay = d6 * ex, d6 * ey
    r4 = np.sqrt((ax - ox) ** 2 + (ay - oy) ** 2)
    ux, uy = (ax - ox) / r4, (ay - oy) / r4
    turning = (vx * nx + vy * ny) / r2
    speed = (turning * d6 * (nx * ux + ny * uy), vx * ex + vy * ey)
    extension = (r4 - k1, r2 - k2)

    along = np.zeros(2)
    for c in range(2):
        bore, rod, stroke, unpressed, growth, asymmetry, fv = pistons[c]
        full, ring = np.pi / 4 * bore**2, np.pi / 4 * (bore**2 - rod**2)
        v, pressure, temperature = speed[c], np.zeros(2), np.zeros(2)
        volume, rate, wall = np.zeros(2), np.zeros(2), np.zeros(2)
        for side in range(2):
            m, energy = s[4 + 2 * c + side], s[8 + 2 * c + side]
            area, sign = (full, 1.0) if side == 0 else (ring, -1.0)
            column = stroke / 2 + sign * extension[c]
            volume[side], rate[side], wall[side] = heat[0] + area * column, area * sign * v, 2 * area + np.pi * bore * column
            temperature[side] = energy / (m * r / (gamma - 1))
            pressure[side] = m * r * temperature[side] / volume[side]
        for side in range(2):
            p, t, k = pressure[side], temperature[side], 2 * c + side
            spool = s[14 + k]
            opened_in = valve[2] + valve[0] * opened(spool, edges[k, 0])
            opened_out = valve[2] + valve[0] * opened(-spool, edges[k, 1])
            mass_rate, enthalpy_rate, cp = 0.0, 0.0, gamma * r / (gamma - 1)
            for source, conductance in ((supply, opened_in), (atmosphere, opened_out)):
                if source > p:
                    q = orifice(conductance, source, ambient, p, valve[1], rho, t_ref)
                    mass_rate, enthalpy_rate = mass_rate + q, enthalpy_rate + q * cp * ambient
                else:
                    q = orifice(conductance, p, t, source, valve[1], rho, t_ref)
                    mass_rate, enthalpy_rate = mass_rate - q, enthalpy_rate - q * cp * t
            warming = heat[1] * wall[side] * (ambient - t) + heat[2] * (temperature[1 - side] - t)
            ds[4 + k] = mass_rate
            ds[8 + k] = enthalpy_rate - p * rate[side] + warming
            ds[14 + k] = (command[k] - spool) / valve[3]

        fc = unpressed + growth * ((pressure[0] - atmosphere) + (pressure[1] - atmosphere))
        fc = max(fc, 0.0) * (1 + asymmetry * np.sign(v))
        # A trial of the solver's, which it then rejects, may leave next to no air, and so no level to divide by.
        level = max(fc + (law[1] * fc - fc) / (1 + (v / law[2]) ** 2), 1e-9)
        found[c], found[2 + c] = v, level
        if law[0] == 3:
            rubbing = fv * v
            for e in range(ELEMENTS):
                k, force, stiffness = 18 + ELEMENTS * c + e, s[18 + ELEMENTS * c + e], STIFFNESS[e] * law[3]
                strength = STIFFNESS[e] * REACH[e]
                ds[k] = element_rate(force, law[9 + ELEMENTS * c + e], v, strength, stiffness, level, law[7])
                rubbing += force + law[4] * ds[k] / law[3]
        elif law[0] > 0:
            alpha = 1.0 if law[0] == 1 else plastic_fraction(s[12 + c], v, level / law[3], law[6])
            relaxation = law[3] * abs(v) / level
            sliding = v - alpha * relaxation * s[12 + c]
            if relaxation > law[8]:
                sliding *= law[8] / relaxation
            ds[12 + c] = sliding
            rubbing = law[3] * s[12 + c] + law[4] * sliding + fv * v
        else:
            rubbing = fv * v + fc * (v / law[5] if abs(v) < law[5] else np.sign(v))
        along[c] = pressure[0] * full - pressure[1] * ring - atmosphere * (full - ring) - rubbing

    # Rod 1 turns the massless beam; the torque about O1 reaches the end effector as a force across the beam.
    across = along[0] * (ax * uy - ay * ux) / r2
    ds[0], ds[1] = vx, vy
    ds[2] = (along[1] * ex + across * nx + push[0]) / mass
    ds[3] = (along[1] * ey + across * ny + push[1]) / mass - gravity
    if is_rail:  # which bears whatever acts across it
        ds[2], ds[3] = (ds[2] * ex + ds[3] * ey) * ex, (ds[2] * ex + ds[3] * ey) * ey
    return ds


class SecondModel:
    """A rig in these coordinates, with translations from and to what the plant shows."""

    def __init__(self, rig: Parameters, observed: Array, state: Array, relaxation_limit: float = np.inf) -> None:
        """``observed`` is the plant's end effector (4,), ``state`` its state (18,), for the same instant.

        With a ``relaxation_limit`` (1/s) a bristle that relaxes more quickly is slowed down as the plant's is.
        """
        self.constants = constants(rig)
        self.constants[2][8] = relaxation_limit
        self._rig = rig
        pressure, temperature = state[[6, 8, 10, 12]], state[[7, 9, 11, 13]]
        mass = pressure * self._volumes(observed) / (rig.air.gas_constant * temperature)
        energy = mass * temperature * rig.air.gas_constant / (rig.air.heat_capacity_ratio - 1)
        self.state: Array = np.concatenate([observed, mass, energy, state[4:6], state[14:18]])
        if rig.friction.law == "gms":
            self.state = np.concatenate([self.state, np.zeros(2 * ELEMENTS)])

    def _volumes(self, s: Array) -> Array:
        g, half = self._rig.geometry, np.array([self._rig.cylinder1.stroke, self._rig.cylinder2.stroke]) / 2
        point, pivot = complex(s[0], s[1]), g.d3 * np.exp(1j * g.gamma3)
        y = np.array([abs(g.d6 * point / abs(point) - pivot) - g.k1, abs(point) - g.k2])
        bore, rod = self.constants[1][:, 0], self.constants[1][:, 1]
        columns = np.stack([np.pi / 4 * bore**2 * (half + y), np.pi / 4 * (bore**2 - rod**2) * (half - y)], axis=1)
        return self._rig.chambers.dead_volume + columns.ravel()

    @property
    def pressures(self) -> Array:
        """Pressures of chambers P1, N1, P2, N2: (gamma - 1) U / V."""
        return (self._rig.air.heat_capacity_ratio - 1) * self.state[8:12] / self._volumes(self.state)

    def advance(
        self, command: Array, push: Array, seconds: float, method: str = "DOP853", rtol: float = 1e-11, atol: float = 1e-14
    ) -> int:
        """Integrate with constant opening commands (4,) and user force (2,); returns the evaluations of the equations.

        ``method`` is one of ``solve_ivp``. By default it has order 8 and chooses its own steps. Tolerances are those of the
        scaled state (``SCALES``).
        """
        evaluations, scales = 0, np.concatenate([SCALES, ELEMENT_SCALES])[: len(self.state)]

        def scaled(_: float, s: Array) -> Array:
            nonlocal evaluations
            evaluations += 1
            result: Array = rates(s * scales, command, push, *self.constants) / scales
            return result

        now = 0.0
        while now < seconds:
            events = self._events(command, push, scales)
            solution = solve_ivp(
                scaled, (now, seconds), self.state / scales, method=method, rtol=rtol, atol=atol, events=events
            )
            if not solution.success:
                raise RuntimeError(f"the second model could not be integrated: {solution.message}")
            self.state, now = solution.y[:, -1] * scales, solution.t[-1]
            self._switch(command, push)
        return evaluations

    def _margins(self, s: Array, command: Array, push: Array) -> tuple[Array, Array]:
        """Speeds of the pistons, and what is left of the elements' shares of their levels, N, (8,)."""
        found = np.zeros(4)
        rates_and_levels(found, s, command, push, *self.constants)
        shares = np.multiply(STIFFNESS, REACH)
        return found[:2], np.concatenate([shares * found[2], shares * found[3]]) - np.abs(s[18:])

    def _events(self, command: Array, push: Array, scales: Array) -> list[Callable[[float, Array], float]]:
        """What ends a stretch: an element that sticks reaches its share, or a piston whose elements slip comes to rest."""
        if len(scales) == 18:
            return []
        events: list[Any] = []
        for k, way in enumerate(self.constants[2][9:]):
            cylinder = k // ELEMENTS
            if way == 0:
                events.append(lambda _, s, k=k: self._margins(s * scales, command, push)[1][k])
            else:
                events.append(lambda _, s, c=cylinder, way=way: way * self._margins(s * scales, command, push)[0][c])
            events[-1].terminal, events[-1].direction = True, -1
        return events

    def _switch(self, command: Array, push: Array) -> None:
        """Elements slip that have reached their share, the way that they are bent, until their piston comes to rest."""
        if len(self.state) == 18:
            return
        (speeds, left), ways = self._margins(self.state, command, push), self.constants[2][9:]
        for k, force in enumerate(self.state[18:]):
            v = speeds[k // ELEMENTS]
            if ways[k] * v <= 1e-12:
                ways[k] = np.sign(force) if left[k] < 1e-9 and v * force > 0 else 0.0
