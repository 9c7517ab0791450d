"""What a policy is paid, from the true state: to stay on the compliant target, calmly and with little effort.

Every 10 ms pay one, less its costs as a fraction of the largest ones. So no step pays less than nothing, and an episode
that ends early, after which nothing is paid, is never worth more than one that goes on, whatever the discount.

Nothing can follow a jump of the hand. After a jump the target of the reward therefore moves to the compliant target with a time
constant of 60 ms, and the error against it counts as at any other time. A reward that ignored the errors after a jump taught
haste, and rigs near their limit do not return from an overshoot.
"""

from __future__ import annotations

import math

from birthsim_env.loop.signals import compliance
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array

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

REWARD_TERMS = ("reward_survive", "reward_tracking", "reward_hunting", "reward_effort", "reward_action_change")


@helper
def assess(
    state: Array, motion: Array, reference: Array, force: Array, jumped: Array, moved: Array, action: Array,
    last_action: Array, impacts: Array, impact_speed: float, period: float, terms: Array, failed: Array,
) -> None:  # fmt: skip
    """Writes reward ``terms`` (5, N) in the order of ``REWARD_TERMS``, and 1 in lanes (N,) that have left the physical range.

    ``force`` (2, N), N, is the hand's; ``jumped`` (N,) is 1 where it or a stiffness setpoint jumped within this policy
    ``period``, s. ``moved`` (4, N), m, is carried on: what the hand has moved the compliant target by, and how much of that is
    not asked for yet. ``action`` and ``last_action`` (size, N).
    """
    steps, kept = period / 0.01, exact.exp(-period / GIVING_WAY)
    unit, entries = steps / LARGEST_COST, max(1, action.shape[0])
    for i in range(state.shape[1]):
        given = compliance(force[0, i], force[1, i], reference[8, i], reference[9, i], reference[14, i])
        error, speed = 0.0, 0.0
        for axis in range(2):
            change = given[axis] - moved[axis, i]
            owed = kept * (moved[2 + axis, i] + (change if jumped[i] > 0.0 else 0.0))
            asked = given[axis] - owed
            rate = (asked - moved[axis, i] + moved[2 + axis, i]) / period
            error += abs(motion[axis, i] - reference[axis, i] - asked)
            speed += abs(motion[2 + axis, i] - reference[2 + axis, i] - rate)
            moved[axis, i], moved[2 + axis, i] = given[axis], owed
        cost = exact.log1p(min(FARTHEST, error) / ERROR_UNIT)
        hunting = exact.log1p(min(FASTEST, speed) / SPEED_UNIT)
        turned, effort = 0.0, 0.0
        for k in range(action.shape[0]):
            turned += abs(action[k, i] - last_action[k, i])
            effort += action[k, i] * action[k, i]
        inside = True
        for k in (at.PP1, at.PN1, at.PP2, at.PN2):
            inside = inside and PRESSURE_RANGE[0] < state[k, i] < PRESSURE_RANGE[1]
        for k in (at.TP1, at.TN1, at.TP2, at.TN2):
            inside = inside and TEMPERATURE_RANGE[0] < state[k, i] < TEMPERATURE_RANGE[1]
        inside = inside and math.isfinite(state[at.Y1, i] + state[at.Y2, i])
        failed[i] = 1.0 if not inside or max(impacts[0, i], impacts[1, i]) > impact_speed else 0.0
        terms[0, i] = steps
        terms[1, i] = -unit * cost
        terms[2, i] = -unit * HUNTING_COST * hunting
        terms[3, i] = -unit * EFFORT_COST * effort / entries
        terms[4, i] = -unit * ACTION_CHANGE_COST * turned / entries
