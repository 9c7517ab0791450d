"""The ``info`` of the environments: the true state of the rig and its task in SI units."""

import math

import numpy as np

from birthsim_env.loop.rows import Signals, World
from birthsim_env.loop.signals import compliant_offset
from birthsim_env.physics import control_model
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, row, rows
from birthsim_env.physics.pneumatics import air, tubes


class Info(Rows):
    """What ``describe`` writes."""

    time = row("s", "since the episode began")
    since_jump = row("s", "since the user force or a stiffness setpoint jumped")
    position = rows(2, "m", "end effector x, y")
    velocity = rows(2, "m/s", "end effector")
    target = rows(2, "m", "x, y")
    compliant_target = rows(2, "m", "(19)")
    tracking_error = rows(2, "m", "end effector minus compliant target")
    user_force = rows(2, "N", "x, y")
    stiffness_setpoint = rows(2, "N/m", "Kclx and Kcly")
    piston_position = rows(2, "m", "y1 and y2")
    piston_velocity = rows(2, "m/s", "v1 and v2")
    pressure = rows(4, "Pa", "absolute, chambers P1, N1, P2, N2")
    temperature = rows(4, "K", "chambers P1, N1, P2, N2")
    opening = rows(4, "1", "spools of chambers P1, N1, P2, N2")
    pneumatic_force = rows(2, "N", "Pp Sp - Pn Sn of both cylinders (3)")
    pneumatic_stiffness = rows(2, "N/m", "(9)")
    pneumatic_stiffness_setpoint = rows(2, "N/m", "of both cylinders")
    supply_flow = row("kg/s", "drawn from the supply")
    impact_speed = rows(2, "m/s", "fastest collision of each piston with an end stop in the last step; 0 where none")
    stop_depth = rows(2, "m", "how far each piston is in an end stop; 0 where it is in none")
    pressure_excess = rows(4, "Pa", "how far chambers P1, N1, P2, N2 are above the supply or below the atmosphere, else 0")
    hand_force = row("N", "magnitude of the user force")
    air_used = row("kg", "drawn from the supply since the episode began: supply_flow times the policy period, summed")
    cost = row("1", "1 where stop_depth or pressure_excess is more than 0, else 0")


FIELDS = {name: (count, f"{unit}, {about}") for name, unit, about, count in Info.entries()}
"""Name -> (number of values, unit and meaning)."""


@helper
def describe(world: World, seen: Signals, info: Info, n: int) -> None:
    """Writes all fields of n lanes but ``air_used``, which needs the past."""
    state, p = world.state, world.rig
    reference, motion = seen.reference, world.motion
    for i in range(n):
        info.time[i], info.since_jump[i] = seen.time[i], world.since_jump[i]
        given = compliant_offset(reference, world.force[0, i], world.force[1, i], i)
        for k in range(2):
            compliant = reference.position[k, i] + given[k]
            info.position[k, i], info.velocity[k, i] = motion.position[k, i], motion.velocity[k, i]
            info.target[k, i], info.compliant_target[k, i] = reference.position[k, i], compliant
            info.tracking_error[k, i] = motion.position[k, i] - compliant
            info.user_force[k, i], info.stiffness_setpoint[k, i] = world.force[k, i], reference.stiffness[k, i]
            info.pneumatic_stiffness_setpoint[k, i] = reference.pneumatic_stiffness[k, i]
            info.impact_speed[k, i] = world.impact[k, i]
        info.piston_position[0, i], info.piston_position[1, i] = state[at.Y1, i], state[at.Y2, i]
        info.piston_velocity[0, i], info.piston_velocity[1, i] = state[at.V1, i], state[at.V2, i]
        for k in range(4):
            info.pressure[k, i] = state[at.PRESSURES[k], i]
            info.temperature[k, i] = state[at.TEMPERATURES[k], i]
            info.opening[k, i] = state[at.SPOOLS[k], i]
        info.pneumatic_force[0, i] = state[at.PP1, i] * p[at.AREA_P1, i] - state[at.PN1, i] * p[at.AREA_N1, i]
        info.pneumatic_force[1, i] = state[at.PP2, i] * p[at.AREA_P2, i] - state[at.PN2, i] * p[at.AREA_N2, i]
        half1, half2 = p[at.HALF_L1, i], p[at.HALF_L2, i]
        y1, y2 = max(-0.99 * half1, min(0.99 * half1, state[at.Y1, i])), max(-0.99 * half2, min(0.99 * half2, state[at.Y2, i]))
        info.pneumatic_stiffness[0, i] = control_model.pneumatic_stiffness(
            state[at.PP1, i], state[at.PN1, i], p[at.AREA_P1, i], p[at.AREA_N1, i], half1 + y1, half1 - y1, p[at.INDEX, i]
        )
        info.pneumatic_stiffness[1, i] = control_model.pneumatic_stiffness(
            state[at.PP2, i], state[at.PN2, i], p[at.AREA_P2, i], p[at.AREA_N2, i], half2 + y2, half2 - y2, p[at.INDEX, i]
        )
        info.supply_flow[i] = 0.0
        for k in range(4):
            pressure, temperature = state[at.PRESSURES[k], i], state[at.TEMPERATURES[k], i]
            end, coldness = tubes.at_valve(p, i, world.at_valve[k, i], pressure, temperature)
            inflow, _ = air.orifice_flows(p, i, k, end, state[at.SPOOLS[k], i], 1.0 / end, coldness)
            info.supply_flow[i] += max(inflow, 0.0)
    _describe_costs(world, info, n)


@helper
def _describe_costs(world: World, info: Info, n: int) -> None:
    """What violates a constraint, and how hard the hand is pushed, in loops without a branch, which LLVM vectorises."""
    state, p = world.state, world.rig
    for i in range(n):
        fx, fy = world.force[0, i], world.force[1, i]
        info.hand_force[i] = math.sqrt(fx * fx + fy * fy)
        info.stop_depth[0, i] = max(abs(state[at.Y1, i]) - p[at.HALF_L1, i], 0.0)
        info.stop_depth[1, i] = max(abs(state[at.Y2, i]) - p[at.HALF_L2, i], 0.0)
        info.cost[i] = max(info.stop_depth[0, i], info.stop_depth[1, i])
    for k in range(4):
        for i in range(n):
            pressure = state[at.PRESSURES[k], i]
            info.pressure_excess[k, i] = max(pressure - p[at.SUPPLY, i], max(p[at.ATMOSPHERE, i] - pressure, 0.0))
            info.cost[i] = max(info.cost[i], info.pressure_excess[k, i])
    for i in range(n):
        info.cost[i] = 1.0 if info.cost[i] > 0.0 else 0.0


_PLACES = {name: group.first if group.single else group.place for name, group in Info.groups.items()}


def vector_info(rows: Array) -> dict[str, Array]:
    """Name -> (N,) for single values, (N, size) for several."""
    return {name: rows[place].T for name, place in _PLACES.items()}


def single_info(rows: Array) -> dict[str, np.float64 | Array]:
    """Name -> NumPy number or array (size,) of the first lane."""
    column = rows[:, 0]
    return {name: column[place] for name, place in _PLACES.items()}
