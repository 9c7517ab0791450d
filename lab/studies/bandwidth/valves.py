"""What exact rendering of a declared impedance under a multisine hand would ask of a rig's valves.

Inverse dynamics of the true rig along the declared motion, with its friction (LuGre), pressures at the pneumatic stiffness
asked for and air as (6)-(10) have it, give the active flow that each cylinder needs at every instant:
    L = J^T (m a - m g - Fu) + friction,    qA = (dL/dt + K v) l/(2 k r T)
Of all pressurisation flows the one is taken that needs the smallest opening u of both valves. Spools follow with the lag tau,
so the command is u + tau du/dt, and it is possible where that stays within 1. What goes beyond full flow counts as so much
more opening. The temperature of the air is left out. A controller that is allowed an error may get further.
"""

import math

import numpy as np

from baselines.estimation import dry_friction, reference_friction
from baselines.impedance import Complex, Impedance
from baselines.valve_inverse import CLEARANCE, air_at, driving_flows, stiffness_of, valve_of
from birthsim_env.loop.signals import Reference
from birthsim_env.physics import control_model
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array, Rig, parameter_column
from birthsim_env.physics.linkage.geometry import inverse_geometry, jacobian, joint_force
from birthsim_env.physics.pneumatics.characteristic import common_opening
from birthsim_env.physics.rig.parameters import Parameters

CROSSING = 1e-3
"""Part of the conductance over which the overlap is crossed: what a controller that renders exactly could not do without."""

STEP, SETTLED = 1e-3, 2.0
"""s: of the inverse dynamics, and after which the bristles have forgotten how they began."""


@kernel
def _commanded(load: Array, position: Array, speed: Array, stiffness: Array, p: Rig, largest: Array) -> None:
    """Writes the largest opening that a motion commands, 1 at a valve's limit: ``largest`` (2, N) from the load on the pistons
    besides friction, N, positions, m, and speeds, m/s, (2, N, T), at the pneumatic stiffness (2, N), N/m."""
    for k in range(2):
        fv, half = (p.fv1, p.half_l1) if k == 0 else (p.fv2, p.half_l2)
        ap, an = (p.area_p1, p.area_n1) if k == 0 else (p.area_p2, p.area_n2)
        for i in range(load.shape[1]):
            z, before, opening, most, pressures = 0.0, 0.0, 0.0, 0.0, np.full((4, 1), p.atmosphere)
            for t in range(load.shape[2]):
                y, v = position[k, i, t], speed[k, i, t]
                # Friction at the pressures of the step before, which change little in one.
                z = reference_friction.bristle(z, v, dry_friction.level_moving(k, v, pressures, 0, p), p, STEP)
                force = load[k, i, t] + p.s0 * z + fv * v
                rate, before = (force - before) / STEP, force
                # As in ``equilibrium.balance``: both pressures for a force and a stiffness, between atmosphere and supply.
                length_p, length_n = max(half + y, CLEARANCE), max(half - y, CLEARANCE)
                force += p.atmosphere * (ap - an)
                a = (stiffness[k, i] / p.index + force / length_n) / (1.0 / length_p + 1.0 / length_n)
                a = min(p.supply * ap, p.supply * an + force, max(p.atmosphere * ap, p.atmosphere * an + force, a))
                pressures[2 * k, 0], pressures[2 * k + 1, 0] = a / ap, (a - force) / an
                if t * STEP < SETTLED:
                    continue
                air = air_at(k, a / ap, (a - force) / an, y, v, p)
                stroke = length_p + length_n
                active = control_model.active_flow_for(rate, stiffness_of(air, p), v, stroke, p.index, p.gas * p.temperature)
                fill_p, drain_p = driving_flows(air.pp, p)
                fill_n, drain_n = driving_flows(air.pn, p)
                valve_p, valve_n, opens = valve_of(2 * k, p), valve_of(2 * k + 1, p), active > 0.0
                driven_p = (fill_p if opens else drain_p) / length_p
                driven_n = (drain_n if opens else fill_n) / length_n
                edge_p = valve_p.supply if opens else valve_p.exhaust
                edge_n = valve_n.exhaust if opens else valve_n.supply
                driven = max(driven_p + driven_n, 1e-12)
                part = abs(active) / max(0.5 * p.conductance * stroke * driven, 1e-12)
                opened = common_opening(min(part, 1.0), driven_p / driven, edge_p, edge_n, CROSSING) + max(part - 1.0, 0.0)
                last, opening = opening, math.copysign(opened, active)
                if t * STEP > SETTLED + STEP:
                    most = max(most, abs(opening + p.tau * (opening - last) / STEP))
            largest[k, i] = most


def commanded_openings(
    rig: Parameters,
    reference: Reference,
    declared: Impedance,
    direction: Array,
    frequency: Array,
    force: Complex,
    period: float,
) -> Array:
    """The largest opening that exact rendering of the lines up to each one commands of any valve, (F, N); 1 is a valve's limit.

    ``rig`` renders the impedance ``declared`` at a resting ``reference`` over N lanes. The hand pushes along unit vectors
    ``direction`` (2, N) with the lines ``force`` (F, N), N, of ``frequency`` (F,), Hz, which repeat after ``period``, s. Lines
    beyond are taken to move nothing.
    """
    turns = np.exp(2j * np.pi * frequency[:, None] * np.arange(0.0, period, STEP))
    compliance = np.linalg.inv(declared.at(frequency).transpose(0, 3, 1, 2))
    summed, largest = np.zeros((4, *direction.shape, turns.shape[1])), np.empty((len(frequency), *direction.shape))
    mechanics, stiffness = rig.mechanics, np.ascontiguousarray(reference.pneumatic_stiffness)
    weight = np.array([0.0, -mechanics.mass * mechanics.gravity])[:, None, None]
    for line, turn in enumerate(turns):
        offset, jw = np.einsum("nij,jn,n->in", compliance[line], direction, force[line]), 2j * np.pi * frequency[line]
        for k, size in enumerate((direction * force[line], offset, jw * offset, jw * jw * offset)):
            summed[k] += (size[..., None] * turn).real
        pushed, place, velocity, acceleration = summed
        piston = inverse_geometry(reference.position[..., None] + place, rig)
        speed = np.einsum("ntji,int->jnt", np.linalg.inv(jacobian(piston, rig).transpose(2, 3, 0, 1)), velocity)
        load = joint_force(mechanics.mass * acceleration - weight - pushed, piston, rig)
        _commanded(load, piston, np.ascontiguousarray(speed), stiffness, Rig(parameter_column(rig)), largest[line])
    return np.asarray(largest.max(axis=1))
