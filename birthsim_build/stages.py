"""Stages that act from outside on a loop with a scenario: a person's hand and setpoints, smooth passages, exchanged sensors.

The page's rig has them too. Besides: what a law without a residual is asked for, and one valve per cylinder.
"""

import math

from birthsim_build.layout import Inputs, Passages
from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.signals import REFERENCES
from birthsim_env.parts.references import minimum_jerk
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Numbers, number

LEAST_TIME, PACE = 0.5, 0.1
"""s and m/s, assumed: a target passes over in the least time and a second for every 0.1 m: with 0.15 m/s at most."""

NEGLIGIBLE = 1e-9
"""SI: offsets of a target below it, and derivatives, are rounding."""

SETPOINTS_TIME, FORCE_TIME = 0.05, 0.1
"""s, assumed: in which setpoints pass over, with the rates that laws need, and a scenario's hand takes hold and lets go."""

SETPOINTS = (8, 9, 10, 11, 14)
"""Rows of a reference with the setpoints Kclx, Kcly, Kpneu1, Kpneu2, Kclxy; 12 and 13 are rates of the third and fourth."""


@kernel
def pair_valves(world: int, seen: Seen, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """One 5/3 valve per cylinder gets half the difference of what its chambers should: what moves the piston."""
    opening = seen.opening
    for cylinder in range(2):
        for i in range(n):
            half = (opening[2 * cylinder, i] - opening[2 * cylinder + 1, i]) / 2.0
            opening[2 * cylinder, i], opening[2 * cylinder + 1, i] = half, -half
    return 0


@kernel
def enter_scenario(world: World, seen: Seen, inputs: Inputs, constants: int, tables: int, lane: int, n: int) -> int:
    """The clock shows the time since the scenario began, until ``outside`` puts it back."""
    for i in range(n):
        inputs.clock[i] = seen.time[i]
        seen.time[i] -= inputs.begins[i]
        for row in range(REFERENCES):
            inputs.given.rows[row, i] = seen.reference.rows[row, i]
        for axis in range(2):
            inputs.given_force[axis, i] = world.force[axis, i]
    return 0


@helper
def _choose(asked: Array, inputs: Inputs, i: int) -> None:
    for row in range(REFERENCES):
        if inputs.keep[row, i] == 0.0:
            asked[row, i] = inputs.add[row, i]
        elif inputs.add[row, i] != 0.0:
            asked[row, i] += inputs.add[row, i]


@helper
def _begin_passages(asked: Array, force: Array, inputs: Inputs, own: Passages, now: float, i: int) -> bool:
    """From what was given to ``asked`` and the scenario's ``force`` (2, N); whether one begins."""
    given, passes = inputs.given.rows, inputs.passes
    if passes[0, i] != 0.0:
        largest = 0.0
        for row in range(8):
            own.target[row, i] = given[row, i] - asked[row, i]
            largest = max(largest, abs(own.target[row, i]))
        way = math.sqrt(own.target[0, i] * own.target[0, i] + own.target[1, i] * own.target[1, i])
        own.target_begins[i], own.target_lasts[i] = now, LEAST_TIME + way / PACE if largest > NEGLIGIBLE else 0.0
    if passes[1, i] != 0.0:
        own.setpoints_begin[i], own.setpoints_last[i] = now, SETPOINTS_TIME
        for k in range(5):
            own.setpoints[k, i] = given[SETPOINTS[k], i] - asked[SETPOINTS[k], i]
    if passes[2, i] != 0.0:
        own.force_begins[i], own.force_lasts[i] = now, FORCE_TIME
        for axis in range(2):
            own.force[axis, i] = inputs.scenario_force[axis, i] - force[axis, i]
    begun = bool(passes[0, i] + passes[1, i] + passes[2, i] > 0.0)
    for k in range(3):
        passes[k, i] = 0.0
    return begun


@helper
def _pass_target(asked: Array, own: Passages, now: float, i: int) -> None:
    """Adds a polynomial of degree 7, whose jerk is continuous."""
    lasts = own.target_lasts[i]
    u = (now - own.target_begins[i]) / lasts
    for axis in range(2):
        a, b = own.target[axis, i], own.target[2 + axis, i] * lasts
        c, d = own.target[4 + axis, i] * lasts**2 / 2.0, own.target[6 + axis, i] * lasts**3 / 6.0
        # Coefficients 4 to 7 make value and three derivatives zero at u = 1.
        value, slope, bend, jerk = -(a + b + c + d), -(b + 2.0 * c + 3.0 * d), -(2.0 * c + 6.0 * d), -6.0 * d
        e = 35.0 * value - 15.0 * slope + 2.5 * bend - jerk / 6.0
        f = -84.0 * value + 39.0 * slope - 7.0 * bend + jerk / 2.0
        g = 70.0 * value - 34.0 * slope + 6.5 * bend - jerk / 2.0
        h = -20.0 * value + 10.0 * slope - 2.0 * bend + jerk / 6.0
        asked[axis, i] += a + u * (b + u * (c + u * (d + u * (e + u * (f + u * (g + u * h))))))
        rate = b + u * (2.0 * c + u * (3.0 * d + u * (4.0 * e + u * (5.0 * f + u * (6.0 * g + u * 7.0 * h)))))
        asked[2 + axis, i] += rate / lasts
        rate = 2.0 * c + u * (6.0 * d + u * (12.0 * e + u * (20.0 * f + u * (30.0 * g + u * 42.0 * h))))
        asked[4 + axis, i] += rate / lasts**2
        rate = 6.0 * d + u * (24.0 * e + u * (60.0 * f + u * (120.0 * g + u * 210.0 * h)))
        asked[6 + axis, i] += rate / lasts**3


@helper
def _pass_setpoints(asked: Array, own: Passages, now: float, i: int) -> None:
    u = (now - own.setpoints_begin[i]) / own.setpoints_last[i]
    left, rate = 1.0 - minimum_jerk(u, 0), -minimum_jerk(u, 1) / own.setpoints_last[i]
    for k in range(5):
        asked[SETPOINTS[k], i] += own.setpoints[k, i] * left
    for k in range(2):
        asked[12 + k, i] += own.setpoints[2 + k, i] * rate


@helper
def _pull(world: World, inputs: Inputs, i: int) -> bool:
    """What the person's hand does, within its limit; whether it does anything."""
    held, pull = inputs.pointer_held[i] != 0.0, inputs.pointer_force
    for axis in range(2):
        stretched = inputs.pointer[axis, i] - world.motion.position[axis, i]
        spring = inputs.pointer_stiffness[i] * stretched - inputs.pointer_damping[i] * world.motion.velocity[axis, i]
        pull[axis, i] = (spring if held else 0.0) + inputs.push[axis, i]
    size = math.sqrt(pull[0, i] * pull[0, i] + pull[1, i] * pull[1, i])
    if size > inputs.pointer_limit[i]:
        for axis in range(2):
            pull[axis, i] *= inputs.pointer_limit[i] / size
    return held or size > 0.0


@helper
def _keep_finite(rows: Array, before: Array, i: int) -> int:
    """Puts all ``rows`` back to those of the period ``before`` where one is not finite; 1 where that was so."""
    bad = 0
    for row in range(before.shape[0]):
        bad = bad if math.isfinite(rows[row, i]) else 1
    for row in range(before.shape[0] if bad else 0):
        rows[row, i] = before[row, i]
    return bad


@kernel
def outside(world: World, seen: Seen, inputs: Inputs, constants: int, tables: int, lane: int, n: int) -> int:
    """Inputs act on what the scenario asks for and on its hand's force, and what jumped passes over.

    Inputs that are not finite change nothing; returns in how many lanes there are some."""
    asked, force, own, refused = seen.reference.rows, world.force, inputs.passages, 0
    for i in range(n):
        now = inputs.clock[i]
        inputs.episode_time[i], seen.time[i] = seen.time[i], now
        for k in range(4):
            inputs.scenario_stiffness[k, i] = asked[SETPOINTS[k], i]
        _choose(asked, inputs, i)
        if inputs.keep_force[i] == 0.0:
            force[0, i] = force[1, i] = 0.0
        if _begin_passages(asked, force, inputs, own, now, i):
            for row in range(REFERENCES):
                asked[row, i] = inputs.given.rows[row, i]
            for axis in range(2):
                force[axis, i] = inputs.given_force[axis, i]
            continue
        if now < own.target_begins[i] + own.target_lasts[i]:
            _pass_target(asked, own, now, i)
        if now < own.setpoints_begin[i] + own.setpoints_last[i]:
            _pass_setpoints(asked, own, now, i)
        if now < own.force_begins[i] + own.force_lasts[i]:
            left = 1.0 - minimum_jerk((now - own.force_begins[i]) / own.force_lasts[i], 0)
            for axis in range(2):
                force[axis, i] += own.force[axis, i] * left
        pulled = _pull(world, inputs, i)
        for axis in range(2):
            inputs.scenario_force[axis, i] = force[axis, i]
            if inputs.add_force[axis, i] != 0.0:
                force[axis, i] += inputs.add_force[axis, i]
            if pulled:
                force[axis, i] += inputs.pointer_force[axis, i]
        refused += _keep_finite(asked, inputs.given.rows, i) | _keep_finite(force, inputs.given_force, i)
    return refused


class Period(Numbers):
    """A control period."""

    period = number("s", "control period")


@kernel
def enter_sensors(world: World, seen: Seen, inputs: Inputs, constants: Period, tables: int, lane: int, n: int) -> int:
    """The clock shows the time since these sensors were put in place, until ``leave_sensors`` puts it back."""
    for i in range(n):
        inputs.clock[i] = seen.time[i]
        world.tick[i] -= inputs.sensors_begin[i]
        seen.time[i] = world.tick[i] * constants.period
        seen.position_time[i] -= inputs.sensors_begin[i] * constants.period
    return 0


@kernel
def leave_sensors(world: World, seen: Seen, inputs: Inputs, constants: Period, tables: int, lane: int, n: int) -> int:
    """The clock is that of the loop again."""
    for i in range(n):
        world.tick[i] += inputs.sensors_begin[i]
        seen.time[i] = inputs.clock[i]
        seen.position_time[i] += inputs.sensors_begin[i] * constants.period
    return 0
