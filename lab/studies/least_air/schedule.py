"""The pneumatic stiffness that takes the least air along a reference.

Position and load decide the difference of a cylinder's two pressures, and the stiffness (9) their level:

    Pp Sp = (K Lp Ln / k + F Lp) / l,   Pn Sn = (K Lp Ln / k - F Ln) / l

So K is free as long as both pressures stay between atmosphere and supply. The paper names the air as what could decide (section
V). A chamber holds ``m = P (V0 + S L) / (r T)`` of air at the room's temperature. With ``leak_in`` from the supply and
``leak_out`` to the atmosphere (ISO 6358, conductance Cl), the supply gives ``max(dm/dt + leak_out, leak_in)``: what the valve
adds, but never less than what leaks in. While the piston moves, a lower level takes less: what a stroke fills and empties is in
proportion to it. At rest a higher level takes less, since ``leak_in`` falls above ``b Ps``; at ``P = 0.76 Ps`` it is three
quarters of that at low pressure.

``least_air`` chooses the stiffness phase by phase by dynamic programming. Noise that moves the valves is not in the model.
"""

import copy
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from birthsim_env.parts.references import Trajectory
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage.geometry import inverse_geometry, joint_force
from birthsim_env.physics.pneumatics.valves import driving_flow, laminar_slope
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import checked_number, shown

GRID = 0.01
"""s between the instants at which the air is summed; a stroke takes hundreds of them."""

LEVELS = 40
"""Equally spaced stiffnesses that are tried, besides the least that every phase allows."""

RESTS = 1e-3
"""m/s; a slower piston may rest, and its friction is then left out."""

Bounds = tuple[Array, Array]


def least_air(
    reference: Trajectory,
    stiffness: StiffnessSchedule,
    duration: float,
    rig: Parameters,
    pushes: Sequence[tuple[float, float]],
    phase: float = 1.0,
    reserve: float = 3e4,
) -> StiffnessSchedule:
    """``stiffness`` with its pneumatic setpoints, N/m, replaced by those that take the least air along ``reference``.

    ``duration`` (s) is that of the reference. ``pushes`` are forces (Fx, Fy) of the hand, N; at every setpoint the cylinders
    bear each of them, and no push. ``phase`` (s) is the time between two changes of a setpoint. The pressures stay ``reserve``
    (Pa) away from their limits, so that flows remain for control. Closed-loop setpoints do not change. Raises ``ValueError``
    for numbers that are drawn, a reference out of reach and pushes that the cylinders cannot bear.
    """
    for name, number, unit, least in (
        ("duration", duration, "s", GRID),
        ("phase", phase, "s", stiffness.transition),
        ("reserve", reserve, "Pa", 0.0),
    ):
        checked_number(name, number, unit, least=least, most=1e6)
    columns = [stiffness.closed_loop, stiffness.closed_loop_y, stiffness.closed_loop_xy]
    if any(isinstance(setpoint, tuple) for column in columns for setpoint in column or ()):
        raise ValueError(f"closed_loop = {shown(stiffness.closed_loop)}; allowed: numbers, not ranges")
    instants = np.unique([*stiffness.times, *np.arange(0.0, duration, phase)])
    # A change that begins before another has ended would step.
    apart = np.abs(instants[:, None] - np.asarray(stiffness.times)).min(axis=1)
    starts: Array = instants[(apart == 0.0) | (apart >= stiffness.transition)].astype(np.float64)
    times = np.linspace(0.0, GRID * round(duration / GRID), round(duration / GRID) + 1)
    piston, load = _along(reference, times, rig)
    chosen = []
    for k in range(2):
        lower, upper = _bounds(k, piston, load[k], [(0.0, 0.0), *pushes], reserve, rig)
        # A phase also has to allow the change out of it.
        ends = np.append(starts[1:] + stiffness.transition, times[-1])
        inside = [(times >= begin - 1e-9) & (times <= end + 1e-9) for begin, end in zip(starts, ends, strict=True)]
        bounds = np.array([lower[one].max() for one in inside]), np.array([upper[one].min() for one in inside])
        if (bounds[0] > bounds[1]).any():
            late = starts[int((bounds[0] > bounds[1]).argmax())]
            raise ValueError(
                f"pushes = {shown(list(pushes))} are more than cylinder {k + 1} bears from {late:g} s on with reserve = "
                f"{reserve:g} Pa; allowed: less of either"
            )
        chosen.append(tuple(_least(k, times, piston[k], load[k], starts, bounds, stiffness.transition, rig).tolist()))
    now = np.searchsorted(stiffness.times, starts, side="right") - 1
    x, y, xy = (None if column is None else tuple(column[i] for i in now) for column in columns)
    return StiffnessSchedule(tuple(starts.tolist()), x or (), chosen[0], chosen[1], y, xy, stiffness.transition)


def _along(reference: Trajectory, times: Array, rig: Parameters) -> tuple[Array, Array]:
    """Pistons' positions (2, M), m, and the force F = Pp Sp - Pn Sn of each cylinder (2, M), N, there, without hand."""
    reference = copy.copy(reference)  # it may be in use
    reference.prepare(1)
    reference.begin(0, np.random.default_rng(0))
    motion = np.concatenate([reference.sample(np.array([t])) for t in times], axis=1)
    piston = inverse_geometry(motion[:2], rig)
    speed: Array = np.gradient(piston, times, axis=1)
    load = -rig.mechanics.mass * motion[4:6]
    load[1] -= rig.mechanics.mass * rig.mechanics.gravity
    dry = np.where(np.abs(speed) > RESTS, np.sign(speed), 0.0)
    cylinders = (rig.cylinder1, rig.cylinder2)
    friction = np.stack([one.coulomb_friction * dry[k] + one.viscous_friction * speed[k] for k, one in enumerate(cylinders)])
    outside = rig.air.atmospheric_pressure * np.array([[one.area_p - one.area_n] for one in cylinders])
    return piston, np.asarray(outside + friction - joint_force(load, piston, rig))


def _bounds(
    k: int, piston: Array, load: Array, pushes: Sequence[tuple[float, float]], reserve: float, rig: Parameters
) -> Bounds:
    """Least and largest stiffness of cylinder ``k`` + 1 at every instant, (M,) each, N/m, under any of ``pushes``."""
    cylinder = (rig.cylinder1, rig.cylinder2)[k]
    low, high = rig.air.atmospheric_pressure + reserve, rig.air.supply_pressure - reserve
    lengths = cylinder.stroke / 2 + piston[k], cylinder.stroke / 2 - piston[k]
    bounds = []
    for push in pushes:
        force = load - joint_force(np.tile(np.array(push)[:, None], piston.shape[1]), piston, rig)[k]
        # With F = a - b, where a = Pp Sp and b = Pn Sn, both chambers' limits are limits of a.
        least = np.maximum(low * cylinder.area_p, low * cylinder.area_n + force)
        most = np.minimum(high * cylinder.area_p, high * cylinder.area_n + force)
        bounds.append([rig.air.polytropic_index * (a / lengths[0] + (a - force) / lengths[1]) for a in (least, most)])
    return np.max([one[0] for one in bounds], axis=0), np.min([one[1] for one in bounds], axis=0)


def supplied(piston: Array, load: Array, stiffness: Array, k: int, rig: Parameters) -> tuple[Array, Array]:
    """Air that the supply gives to cylinder ``k`` + 1 from instant to instant, kg, (..., M - 1), and what its chambers hold at
    each, kg, (..., M).

    ``piston`` (M,), m; ``load`` F (M,), N; ``stiffness`` (..., M), N/m; at instants ``GRID`` apart.
    """
    cylinder, air = (rig.cylinder1, rig.cylinder2)[k], rig.air
    lengths = cylinder.stroke / 2 + piston, cylinder.stroke / 2 - piston
    sums = stiffness / air.polytropic_index * lengths[0] * lengths[1] / cylinder.stroke
    held: Array = np.zeros(stiffness.shape)
    given = held[..., 1:].copy()
    for sign, length, area in ((1.0, lengths[0], cylinder.area_p), (-1.0, lengths[1], cylinder.area_n)):
        pressure = (sums + sign * load * length / cylinder.stroke) / area
        mass = pressure * (rig.chambers.dead_volume + area * length) / (air.gas_constant * air.temperature)
        middle = (pressure[..., 1:] + pressure[..., :-1]) / 2
        leak_in = leaked(np.full_like(middle, air.supply_pressure), middle, rig)
        leak_out = leaked(middle, np.full_like(middle, air.atmospheric_pressure), rig)
        given += np.maximum(np.diff(mass) + leak_out * GRID, leak_in * GRID)
        held += mass
    return given, held


def leaked(upstream: Array, downstream: Array, rig: Parameters) -> Array:
    """Mass flow, kg/s, through a shut orifice between two pressures (...), Pa, at the room's temperature."""
    valves = rig.valves
    flow: Array = np.empty(upstream.size)
    _leaks(
        upstream.ravel(),
        downstream.ravel(),
        rig.air.reference_temperature / rig.air.temperature,
        rig.air.reference_density,
        valves.critical_ratio,
        laminar_slope(valves.critical_ratio),
        flow,
    )
    return valves.leakage_ratio * valves.sonic_conductance * flow.reshape(upstream.shape)


@kernel
def _leaks(
    upstream: Array, downstream: Array, coldness: float, density: float, critical: float, slope: float, flow: Array
) -> None:
    for i in range(upstream.shape[0]):
        up, down = upstream[i], downstream[i]
        flow[i] = driving_flow(
            up, 1.0 / up, coldness, down, 1.0 / down, coldness, density, critical, 1.0 / (1.0 - critical), slope
        )


def _least(
    k: int, times: Array, piston: Array, load: Array, starts: Array, bounds: Bounds, transition: float, rig: Parameters
) -> Array:
    """Stiffness of every phase, (P,), N/m; what the chambers hold at the beginning counts as supplied."""
    low, high = bounds
    levels = np.unique([*np.linspace(low.min(), high.max(), LEVELS), *low])
    edges = [*np.searchsorted(times, starts - 1e-9), len(times) - 1]
    least: Array = np.zeros(len(levels))
    came: list[Any] = []
    for p, (begin, end) in enumerate(pairwise(edges)):
        now = slice(begin, end + 1)
        u = np.clip((times[now] - starts[p]) / transition, 0.0, 1.0)
        part = u**3 * (10.0 + u * (6.0 * u - 15.0)) if p else np.ones_like(u)
        course = levels[:, None, None] + (levels[None, :, None] - levels[:, None, None]) * part
        given, held = supplied(piston[now], load[now], course, k, rig)
        cost = given.sum(axis=-1) + (held[..., 0] if p == 0 else 0.0)
        possible = np.isfinite(least)[:, None] & (levels >= low[p]) & (levels <= high[p])
        total = np.where(possible, least[:, None] + cost, np.inf)
        came.append(total.argmin(axis=0))
        least = total.min(axis=0)
    path = [int(least.argmin())]
    for back in came[:0:-1]:
        path.append(int(back[path[-1]]))
    return np.asarray(levels[path[::-1]])
