"""What closes a policy step: reward, success, info and observation of all lanes, as one stage of the closed loop."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from birthsim_env import info, observation, reward, success
from birthsim_env.loop.rows import (
    ACTION,
    FORCE,
    IMPACT,
    MOTION,
    POSITION,
    POSITION_TIME,
    PRESSURE,
    REFERENCE,
    SEEN,
    SHOWN,
    SINCE_JUMP,
    STATE,
    TIME,
    USER_FORCE,
    VELOCITY,
    WORLD,
)
from birthsim_env.loop.signals import REFERENCES, Mask, compliance
from birthsim_env.loop.stage import Stage, block, numbers, scratch, singles, table2
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import PARAMETERS, STATES, Array

MOVED, TALLY, FRESH, LAST = 0, 4, 8, 9
"""Rows of memory at which its parts begin: what ``reward.assess`` carries on, what ``success.add`` carries on, 1 where an
episode begins, the last action."""

ABOUT = 6
"""Constants of the stage: 1 after a step, 0 where episodes begin; policy period, s; time, s, below which a jump was in this
step; largest speed, m/s, of a collision; lengths of an action and of what is shown of a memory. The rig as described follows,
and the scales of an observation."""


@kernel
def _close(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    w, s, mine = block(world, WORLD), block(seen, SEEN), slice(lane, lane + n)
    about = numbers(constants, ABOUT + PARAMETERS + observation.SIZE)
    size, shown, m = int(about[4]), int(about[5]), block(memory, LAST + int(about[4]))[:, :n]
    nominal, scales, jumped = about[ABOUT : ABOUT + PARAMETERS], about[ABOUT + PARAMETERS :], scratch(1)[0, :n]
    state, motion, hits = w[STATE : STATE + STATES, :n], w[MOTION : MOTION + 4, :n], w[IMPACT : IMPACT + 2, :n]
    force, since, asked = w[FORCE : FORCE + 2, :n], w[SINCE_JUMP, :n], s[REFERENCE : REFERENCE + REFERENCES, :n]
    action, last = s[ACTION : ACTION + size, :n], m[LAST : LAST + size]
    failed, succeeded = table2(tables, 1)[0, mine], table2(tables, 1)[1, mine]
    terms = table2(tables, 0)[:, mine]
    if about[0] > 0.0:
        for i in range(n):
            jumped[i] = 1.0 if since[i] < about[2] else 0.0
        reward.assess(
            state, motion, asked, force, jumped, m[MOVED:TALLY], action, last, hits, about[3], about[1],
            terms, failed,
        )  # fmt: skip
        for i in range(n):
            terms[5, i] = terms[0, i] + terms[1, i] + terms[2, i] + terms[3, i] + terms[4, i]
        success.add(motion, asked, force, since, failed, m[TALLY:FRESH], succeeded)
        for k in range(size):
            for i in range(n):
                last[k, i] = action[k, i]
    else:
        for i in range(n):
            if m[FRESH, i] > 0.0:
                # It starts on the target, however hard the hand pushes: all that the push asks for comes little by little.
                given = compliance(force[0, i], force[1, i], asked[8, i], asked[9, i], asked[14, i])
                for axis in range(2):
                    m[MOVED + axis, i], m[MOVED + 2 + axis, i] = given[axis], given[axis]
                m[FRESH, i], failed[i], succeeded[i] = 0.0, 0.0, 0.0
    info.describe(s[TIME, :n], since, state, motion, asked, force, hits, w[:PARAMETERS, :n], table2(tables, 2)[:, mine])
    observation.look(
        s[POSITION:VELOCITY, :n], s[VELOCITY:POSITION_TIME, :n], s[PRESSURE:USER_FORCE, :n], asked, s[USER_FORCE:REFERENCE, :n],
        last, s[SHOWN : SHOWN + shown, :n], nominal, scales, singles(tables, 3)[mine],
    )  # fmt: skip
    return 0


class Outcome:
    """What N lanes show after a policy step, or where their episodes begin.

    - ``terms`` (6, N): the terms of the reward, in the order of ``reward.REWARD_TERMS``, and the reward;
    - ``ends`` (2, N): 1 in lanes that have left the physical range, and in lanes whose episode is successful so far;
    - ``rows`` (info.ROWS, N): the fields of ``info``;
    - ``seen`` (N, size): observations.
    """

    def __init__(
        self, lanes: int, nominal: Array, actions: int, shown: int, policy_period: float, period: float, impact_speed: float
    ) -> None:
        self.terms, self.ends = np.zeros((len(reward.REWARD_TERMS) + 1, lanes)), np.zeros((2, lanes))
        self.rows: Array = np.zeros((info.ROWS, lanes))
        self.seen: NDArray[np.float32] = np.zeros((lanes, observation.SIZE + actions + shown), dtype=np.float32)
        self._memory: Array = np.zeros((LAST + actions, lanes))
        # Half a control period less: the clock of a jump counts in sums of them.
        about = (policy_period, policy_period - 0.5 * period, impact_speed, actions, shown, *nominal, *observation.SCALES)
        self._constants = [np.array([float(stepped), *about]) for stepped in (False, True)]

    def begin(self, lanes: Mask) -> None:
        """Forget the past of the lanes of a mask (N,)."""
        self._memory[:, lanes], self._memory[FRESH, lanes] = 0.0, 1.0

    def stages(self) -> Sequence[Stage]:
        """What runs where episodes begin, and after a policy step."""
        tables = (self.terms, self.ends, self.rows, self.seen)
        return [Stage(_close, about, self._memory, tables) for about in self._constants]
