"""What a policy is paid, from the true state: to stay on the compliant target, calmly and with little effort."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from birthsim_env import lanes as at
from birthsim_env.compilation import kernel
from birthsim_env.lanes import Array
from birthsim_env.signals import compliance

ERROR_UNIT = 2e-3
"""m. Tracking error that costs one unit of reward per 10 ms."""

ERROR_CAP = 5.0
"""Largest tracking cost of one 10 ms, in units: beyond 10 mm a policy is lost anyway."""

SPEED_UNIT = 0.02
"""m/s. Speed relative to the compliant target that costs ``HUNTING_COST`` per 10 ms."""

HUNTING_COST = 0.2
EFFORT_COST = 0.01
ACTION_CHANGE_COST = 0.05
FAILURE_COST = 250.0
"""Cost of leaving the physical range: more than the 150 that tracking and hunting cost at most within the 25 steps that a
discount of 0.96 looks ahead, so that ending early does not pay. With a discount above 0.976 it would."""

GRACE = 0.3
"""s after a jump during which tracking error and hunting cost nothing."""

PRESSURE_RANGE = (0.2e5, 20e5)
"""Pa. A chamber outside it has left what the model describes."""

TEMPERATURE_RANGE = (100.0, 1000.0)
"""K, likewise."""

REWARD_TERMS = ("reward_tracking", "reward_hunting", "reward_effort", "reward_action_change", "reward_failure")


@kernel
def _assess(
    state: Array, motion: Array, reference: Array, force: Array, last_force: Array, since_jump: Array, action: Array,
    last_action: Array, impacts: Array, impact_speed: float, period: float, terms: Array, failed: NDArray[np.bool_],
) -> None:  # fmt: skip
    steps = period / 0.01
    for i in range(state.shape[1]):
        given = compliance(force[0, i], force[1, i], reference[8, i], reference[9, i], reference[14, i])
        before = compliance(last_force[0, i], last_force[1, i], reference[8, i], reference[9, i], reference[14, i])
        error_x = motion[0, i] - reference[0, i] - given[0]
        error_y = motion[1, i] - reference[1, i] - given[1]
        speed_x = motion[2, i] - reference[2, i] - (given[0] - before[0]) / period
        speed_y = motion[3, i] - reference[3, i] - (given[1] - before[1]) / period
        cost = min((abs(error_x) + abs(error_y)) / ERROR_UNIT, ERROR_CAP)
        hunting = min((abs(speed_x) + abs(speed_y)) / SPEED_UNIT, ERROR_CAP)
        change, effort = 0.0, 0.0
        for k in range(action.shape[0]):
            change += abs(action[k, i] - last_action[k, i])
            effort += action[k, i] * action[k, i]
        inside = True
        for k in (at.PP1, at.PN1, at.PP2, at.PN2):
            inside = inside and PRESSURE_RANGE[0] < state[k, i] < PRESSURE_RANGE[1]
        for k in (at.TP1, at.TN1, at.TP2, at.TN2):
            inside = inside and TEMPERATURE_RANGE[0] < state[k, i] < TEMPERATURE_RANGE[1]
        inside = inside and math.isfinite(state[at.Y1, i] + state[at.Y2, i])
        failed[i] = not inside or max(impacts[0, i], impacts[1, i]) > impact_speed
        settled = steps if since_jump[i] >= GRACE else 0.0
        terms[0, i] = -cost * settled
        terms[1, i] = -HUNTING_COST * hunting * settled
        terms[2, i] = -EFFORT_COST * effort * steps
        terms[3, i] = -ACTION_CHANGE_COST * change
        terms[4, i] = -FAILURE_COST if failed[i] else 0.0


def assess(
    state: Array, motion: Array, reference: Array, force: Array, last_force: Array, since_jump: Array, action: Array,
    last_action: Array, impacts: Array, impact_speed: float, policy_period: float,
) -> tuple[Array, NDArray[np.bool_]]:  # fmt: skip
    """Reward terms (5, N) in the order of ``REWARD_TERMS``, and which lanes (N,) have left the physical range.

    ``force`` and ``last_force`` (2, N), N, are the hand's now and a policy period ago; ``action`` and
    ``last_action`` (size, N).
    """
    lanes = state.shape[1]
    terms, failed = np.empty((len(REWARD_TERMS), lanes)), np.empty(lanes, dtype=np.bool_)
    _assess(
        state, motion, reference, force, last_force, since_jump, action, last_action, impacts, impact_speed, policy_period,
        terms, failed,
    )  # fmt: skip
    return terms, failed
