"""What a policy is paid, from the true state: to stay on the compliant target, calmly and with little effort. What is success.

Each step of 10 ms pays 1 minus a cost between 0 and 1. An episode that ends early is paid nothing afterwards. So ending early
is never better than going on, whatever the discount.

Nothing can follow a jump of the hand. After a jump the target of the reward therefore moves to the compliant target with a time
constant of 60 ms, and the error against it counts as at any other time. A reward that ignored the errors after a jump taught
haste, and rigs near their limit do not return from an overshoot.
"""

import math

from birthsim_env.loop.rows import World
from birthsim_env.loop.signals import Reference, compliant_offset
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Numbers, Rows, number, row, rows

ERROR_UNIT = 1e-3
"""m. A tracking error e costs ln(1 + e/``ERROR_UNIT``) per 10 ms: what is small counts, and what is large still matters."""

SPEED_UNIT = 0.01
"""m/s. Speed w relative to what is asked for costs ``HUNTING_COST`` ln(1 + w/``SPEED_UNIT``) per 10 ms."""

FARTHEST, FASTEST = 1.0, 10.0
"""m, m/s: more than the rig can be off and no more is paid for; what has become no number counts as that."""

HUNTING_COST = 0.2
EFFORT_COST = 0.04
"""Of the mean square of the action, per 10 ms."""

ACTION_CHANGE_COST = 0.2
"""Of the mean change of the action's entries from one policy step to the next, per 10 ms."""

LARGEST_COST = 8.75
"""All costs together are at most 1.2 ln(1001) + 0.44 = 8.7305 per 10 ms; this is a little more, so that rounding is none."""

GIVING_WAY = 0.06
"""s, time constant of what is asked for after a jump; assumed: about that of ``admittance-backstepping``."""

PRESSURE_RANGE = (0.2e5, 20e5)
"""Pa. A chamber outside it has left what the model describes."""

TEMPERATURE_RANGE = (100.0, 1000.0)
"""K, likewise."""

SETTLED = 0.5
"""s after a jump of force or setpoint (or the start) from which an error counts as settled."""

SUCCESS_ERROR = 1e-3
"""m, root mean square distance from the compliant target; assumed: a quarter of the paper's law's."""


class Terms(Rows):
    """What a policy step pays."""

    survive = row("1", "for going on", "reward_survive")
    tracking = row("1", "for the tracking error", "reward_tracking")
    hunting = row("1", "for speed that is not asked for", "reward_hunting")
    effort = row("1", "for the action", "reward_effort")
    action_change = row("1", "for its change", "reward_action_change")
    total = row("1", "their sum, the reward", "reward")


REWARD_TERMS = tuple(name for name, *_ in Terms.entries())[:-1]


class TargetLag(Rows):
    """What a policy step has to know of the ones before."""

    offset = rows("x y", "m", "what the hand has moved the compliant target by")
    remaining = rows("x y", "m", "how much of that is not asked for yet")


class Limits(Numbers):
    """Of an environment."""

    period = number("s", "policy period")
    jumped_below = number("s", "a jump was in this policy step where less time has gone since")
    impact_speed = number("m/s", "of the fastest collision with an end stop that does not end an episode")


class Tally(Rows):
    """Of an episode so far."""

    squares = row("m2", "sum of the squared distances from the compliant target")
    steps = row("1", "policy steps")
    settled_squares = row("m2", "the same, of settled steps")
    settled_steps = row("1", "settled policy steps")


@helper
def assess(
    world: World,
    reference: Reference,
    lag: TargetLag,
    action: Array,
    last_action: Array,
    limits: Limits,
    terms: Terms,
    terminated: Array,
    n: int,
) -> None:
    """Writes ``terms`` of n lanes, and 1 in ``terminated`` (N,) for lanes that have left the physical range.

    ``lag`` is carried on. ``action`` and ``last_action`` (size, N).
    """
    steps, kept = limits.period / 0.01, exact.exp(-limits.period / GIVING_WAY)
    unit, entries = steps / LARGEST_COST, max(1, action.shape[0])
    state, p = world.state, world.rig
    for i in range(n):
        along_error, along_speed = 0.0, 0.0
        offset = compliant_offset(reference, world.force[0, i], world.force[1, i], i)
        jumped = world.since_jump[i] < limits.jumped_below
        error, speed = 0.0, 0.0
        for axis in range(2):
            change = offset[axis] - lag.offset[axis, i]
            due = kept * (lag.remaining[axis, i] + (change if jumped else 0.0))
            asked = offset[axis] - due
            rate = (asked - lag.offset[axis, i] + lag.remaining[axis, i]) / limits.period
            off = world.motion.position[axis, i] - reference.position[axis, i] - asked
            fast = world.motion.velocity[axis, i] - reference.velocity[axis, i] - rate
            error += abs(off)
            speed += abs(fast)
            direction = p[at.SIN_GAMMA3, i] if axis == 0 else -p[at.COS_GAMMA3, i]
            along_error += direction * off
            along_speed += direction * fast
            lag.offset[axis, i], lag.remaining[axis, i] = offset[axis], due
        # On a rail there is one axis, whatever its inclination.
        error = error if p[at.FREE, i] > 0.0 else abs(along_error)
        speed = speed if p[at.FREE, i] > 0.0 else abs(along_speed)
        cost = exact.log1p(min(FARTHEST, error) / ERROR_UNIT)
        hunting = exact.log1p(min(FASTEST, speed) / SPEED_UNIT)
        turned, effort = 0.0, 0.0
        for k in range(action.shape[0]):
            turned += abs(action[k, i] - last_action[k, i])
            effort += action[k, i] * action[k, i]
        inside = True
        (least_p, most_p), (least_t, most_t) = PRESSURE_RANGE, TEMPERATURE_RANGE
        for k in (at.PP1, at.PN1, at.PP2, at.PN2):
            inside = inside and least_p < state[k, i] < most_p
        for k in (at.TP1, at.TN1, at.TP2, at.TN2):
            inside = inside and least_t < state[k, i] < most_t
        inside = inside and math.isfinite(state[at.Y1, i] + state[at.Y2, i])
        terminated[i] = 1.0 if not inside or max(world.impact[0, i], world.impact[1, i]) > limits.impact_speed else 0.0
        terms.survive[i] = steps
        terms.tracking[i] = -unit * cost
        terms.hunting[i] = -unit * HUNTING_COST * hunting
        terms.effort[i] = -unit * EFFORT_COST * effort / entries
        terms.action_change[i] = -unit * ACTION_CHANGE_COST * turned / entries
        terms.total[i] = terms.survive[i] + terms.tracking[i] + terms.hunting[i] + terms.effort[i] + terms.action_change[i]


@helper
def add(world: World, reference: Reference, terminated: Array, tally: Tally, success: Array, n: int) -> None:
    """Takes one policy step: carries ``tally`` on and writes ``success`` (N,), 1 where an episode is successful so far.

    The error is the root mean square over the policy steps ``SETTLED`` s and more after a jump, or over all of them before
    there is such a step. An episode that has ``terminated`` (N,) is not successful.
    """
    for i in range(n):
        offset_x, offset_y = compliant_offset(reference, world.force[0, i], world.force[1, i], i)
        x = world.motion.position[0, i] - reference.position[0, i] - offset_x
        y = world.motion.position[1, i] - reference.position[1, i] - offset_y
        tally.squares[i] += x * x + y * y
        tally.steps[i] += 1.0
        if world.since_jump[i] >= SETTLED:
            tally.settled_squares[i] += x * x + y * y
            tally.settled_steps[i] += 1.0
        any_settled = tally.settled_steps[i] > 0.0
        squares = tally.settled_squares[i] if any_settled else tally.squares[i]
        steps = tally.settled_steps[i] if any_settled else tally.steps[i]
        success[i] = 1.0 if terminated[i] == 0.0 and math.sqrt(squares / steps) < SUCCESS_ERROR else 0.0
