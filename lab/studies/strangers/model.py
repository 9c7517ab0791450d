"""Rigs that the package's model lacks: the second model, with what real rigs may have besides.

No equation of the package is used, so that identification and controllers are not judged by the model that they know. The state
(27) has that of ``second_model``, the pressure of the supply, the rates of four spools, and place and velocity of the handle.
Classical Runge-Kutta steps of ``STEP`` integrate it: a control period has twenty.
"""

from dataclasses import dataclass, fields

import numpy as np

from birthsim_env.physics.rig.parameters import Parameters
from lab.studies.accuracy.second_model import Array, SecondModel, compiled, opened, orifice, rates

STEP = 5e-5
"""s."""

HANDLE = slice(23, 27)
"""Rows of place and velocity of the handle."""

RESERVOIR = 4e-4
"""m3: volume behind a supply line; the package's default."""

HANDLE_SHARE, HANDLE_DAMPING = 0.2, 0.03
"""The handle's share of the mass, and its damping ratio; the package's defaults."""


@dataclass(frozen=True)
class Strangeness:
    """What a rig has besides; zeros are nothing. All figures are assumed."""

    friction_asymmetry: float = 0.0
    """Fraction by which Coulomb friction is larger where a piston comes out, and smaller where it goes in."""
    friction_wave: float = 0.0
    """Fraction by which Coulomb friction varies along the stroke, once in 0.1 m."""
    piston_leak: float = 0.0
    """m3/(s Pa): sonic conductance from chamber to chamber past each piston."""
    line_conductance: float = 0.0
    """m3/(s Pa): sonic conductance of the line that fills a reservoir of ``RESERVOIR``, from which the valves draw."""
    spool_frequency: float = 0.0
    """Hz: natural frequency of spools of second order, damping ratio 0.7, in place of the lag."""
    handle_frequency: float = 0.0
    """Hz: natural frequency of the handle, in which hand and tracker are, on its spring."""
    play: float = 0.0
    """Width of the play between command and spool, an opening."""
    delay: float = 0.0
    """s by which commands reach the valves late."""


@compiled
def pose(s: Array, linkage: Array) -> tuple[float, float, float, float]:
    """Extensions, m, and speeds, m/s, of both pistons."""
    ox, oy, d6, k1, k2 = linkage[:5]
    r2 = np.sqrt(s[0] * s[0] + s[1] * s[1])
    ex, ey = s[0] / r2, s[1] / r2
    ax, ay = d6 * ex - ox, d6 * ey - oy
    r4 = np.sqrt(ax * ax + ay * ay)
    turning = (s[3] * ex - s[2] * ey) / r2
    return r4 - k1, r2 - k2, turning * d6 * (ex * ay - ey * ax) / r4, s[2] * ex + s[3] * ey


@compiled
def air_in(s: Array, y1: float, y2: float, pistons: Array, dead: float, gas: Array) -> Array:
    """Pressures, Pa, and temperatures, K, of chambers P1, N1, P2, N2, (2, 4), for extensions of both pistons, m."""
    found, r, gamma = np.zeros((2, 4)), gas[3], gas[4]
    for k in range(4):
        bore, rod, stroke = pistons[k // 2, 0], pistons[k // 2, 1], pistons[k // 2, 2]
        extension = y1 if k < 2 else y2
        area, sign = (np.pi / 4.0 * bore**2, 1.0) if k % 2 == 0 else (np.pi / 4.0 * (bore**2 - rod**2), -1.0)
        found[0, k] = (gamma - 1.0) * s[8 + k] / (dead + area * (stroke / 2.0 + sign * extension))
        found[1, k] = s[8 + k] / s[4 + k] * (gamma - 1.0) / r
    return found


@compiled
def strange_rates(
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
    odd: Array,
) -> Array:
    """d(state)/dt, (27,); ``odd`` has the fields of ``Strangeness``."""
    asymmetry, wave, leak, line, spool_frequency, handle_frequency = odd[:6]
    ds, own, air, pistons, linkage = np.zeros(27), s[:18], gas.copy(), pistons.copy(), linkage.copy()
    y1, y2, v1, v2 = pose(own, linkage)
    for c in range(2):
        speed, extension = (v1, y1) if c == 0 else (v2, y2)
        pistons[c, 3] *= (1.0 + asymmetry * np.sign(speed)) * (1.0 + wave * np.sin(2.0 * np.pi * extension / 0.1))
    if line > 0.0:
        air[0] = s[18]
    force = push
    if handle_frequency > 0.0:
        mass, gravity = linkage[5] * HANDLE_SHARE, linkage[6]
        width = 2.0 * np.pi * handle_frequency
        spring = mass * width * width * (s[23:25] - s[0:2]) + 2.0 * HANDLE_DAMPING * mass * width * (s[25:27] - s[2:4])
        ds[23:25], ds[25:27] = s[25:27], (push - spring) / mass
        ds[26] -= gravity
        force, linkage[5] = spring, linkage[5] - mass
    ds[:18] = rates(own, command, force, linkage, pistons, law, heat, valve, edges, air)
    if spool_frequency > 0.0:
        width = 2.0 * np.pi * spool_frequency
        ds[14:18], ds[19:23] = s[19:23], width * width * (command - s[14:18]) - 1.4 * width * s[19:23]
    r, gamma, rho, t_ref = air[3], air[4], air[5], air[6]
    pressure, warmth = air_in(s, y1, y2, pistons, heat[0], air)
    if leak > 0.0:
        for c in range(2):
            up, down = (2 * c, 2 * c + 1) if pressure[2 * c] > pressure[2 * c + 1] else (2 * c + 1, 2 * c)
            flow = orifice(leak, pressure[up], warmth[up], pressure[down], valve[1], rho, t_ref)
            heated = flow * gamma * r / (gamma - 1.0) * warmth[up]
            ds[4 + up] -= flow
            ds[4 + down] += flow
            ds[8 + up] -= heated
            ds[8 + down] += heated
    if line > 0.0:
        drawn = 0.0
        for k in range(4):
            conductance = valve[2] + valve[0] * opened(s[14 + k], edges[k, 0])
            if air[0] > pressure[k]:
                drawn += orifice(conductance, air[0], air[2], pressure[k], valve[1], rho, t_ref)
            else:
                drawn -= orifice(conductance, pressure[k], warmth[k], air[0], valve[1], rho, t_ref)
        filled = orifice(line, gas[0], gas[2], min(air[0], gas[0]), valve[1], rho, t_ref)
        ds[18] = r * gas[2] / RESERVOIR * (filled - drawn)
    return ds


@compiled
def integrate(
    s: Array,
    steps: int,
    command: Array,
    push: Array,
    linkage: Array,
    pistons: Array,
    law: Array,
    heat: Array,
    valve: Array,
    edges: Array,
    gas: Array,
    odd: Array,
) -> tuple[Array, Array]:
    """The state (27,) after so many steps of ``STEP``, and the air in the chambers (2, 4)."""
    for _ in range(steps):
        a = strange_rates(s, command, push, linkage, pistons, law, heat, valve, edges, gas, odd)
        b = strange_rates(s + 0.5 * STEP * a, command, push, linkage, pistons, law, heat, valve, edges, gas, odd)
        c = strange_rates(s + 0.5 * STEP * b, command, push, linkage, pistons, law, heat, valve, edges, gas, odd)
        d = strange_rates(s + STEP * c, command, push, linkage, pistons, law, heat, valve, edges, gas, odd)
        s = s + STEP / 6.0 * (a + 2.0 * b + 2.0 * c + d)
    y1, y2, _, _ = pose(s, linkage)
    return s, air_in(s, y1, y2, pistons, heat[0], gas)


class Stranger:
    """A rig with a ``Strangeness``, from the plant's end effector ``observed`` (4,) and ``state`` (18,) on.

    ``state`` (27,) is that of the module, ``air`` (2, 4) has pressures, Pa, and temperatures, K, of chambers P1, N1, P2, N2.
    """

    def __init__(self, rig: Parameters, strangeness: Strangeness, observed: Array, state: Array) -> None:
        odd = np.array([getattr(strangeness, one.name) for one in fields(strangeness)])
        begun = SecondModel(rig, observed, state)
        self._constants, self._play, self._inner = (*begun.constants, odd), strangeness.play, state[14:18].copy()
        self._late = [state[14:18].copy() for _ in range(round(strangeness.delay / rig.electronics.control_period))]
        handle, frequency = observed.copy(), strangeness.handle_frequency
        self._has_handle = frequency > 0
        if frequency:
            handle[1] -= rig.mechanics.gravity / (2 * np.pi * frequency) ** 2
        self.state: Array = np.concatenate([begun.state, [rig.air.supply_pressure], np.zeros(4), handle])
        self.air: Array = state[6:14].reshape(4, 2).T

    def advance(self, command: Array, push: Array, seconds: float) -> None:
        """Go on for a control period under opening commands (4,) and the hand's force (2,), N."""
        self._late.append(command.copy())
        half = 0.5 * self._play
        self._inner = np.clip(self._inner, self._late[0] - half, self._late[0] + half)
        del self._late[0]
        self.state, self.air = integrate(self.state, round(seconds / STEP), self._inner, push, *self._constants)

    @property
    def seen(self) -> Array:
        """x, y, vx, vy (4,) where hand and tracker are."""
        return self.state[HANDLE] if self._has_handle else self.state[:4]
