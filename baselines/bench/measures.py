"""What an evaluation measures as two stages of the closed loop: nothing of it stops the loop.

``_see`` samples metrics and error once the controller has commanded. ``_pay`` rewards the period when the rig is at its end. A
lane that leaves the physical range is lost: it is measured no further, and put back to where its episode began, where it
harms nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from baselines.bench.metrics import ALIVE, COUNT, ERROR, TALLY, figures_of, fresh_tally, sample, window
from birthsim_env import reward, success
from birthsim_env.info import ROWS as INFO
from birthsim_env.info import describe
from birthsim_env.loop.rows import FORCE, IMPACT, MOTION, OPENING, REFERENCE, SEEN, SINCE_JUMP, STATE, TIME, WORLD
from birthsim_env.loop.signals import REFERENCES, compliance
from birthsim_env.loop.stage import Stage, block, numbers, scratch, table3
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import PARAMETERS, STATES, Array
from birthsim_env.simulation import Simulation

DISCOUNTS = (0.9, 0.96, 0.99, 0.999, 1.0)
"""Per 10 ms, the default policy period: returns are summed with each of them."""

TRACE = 0.01
"""s between the samples of the error kept for the figure."""

COMMAND = TALLY
LAST = COMMAND + 4
START = LAST + 4
MOVED = START + STATES + 4
CALM = MOVED + 4
SUCCESS = CALM + 4
FAILED = SUCCESS + 1
WEIGHT = FAILED + 1
RETURN = WEIGHT + len(DISCOUNTS)
ROWS = RETURN + len(DISCOUNTS)
"""Rows of memory behind the tally: the command and the last one; state and motion where the episode began; what
``reward.assess`` and ``success.add`` carry on; 1 in episodes that are successful so far; 1 in lanes that left the physical
range; weight of the next reward and sum of the past ones, for each of ``DISCOUNTS``."""

PERIOD, EVERY, JUMPED, SPEED, FACTOR = range(5)
"""Constants: control period, s; periods between samples of the error; time, s, below which a jump was in this period; largest
speed, m/s, of a collision; discounts of a period."""


@kernel
def _see(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Tables: positions kept for the metrics (W, 2, N); error (T, 2, N), m."""
    w, s, m, about = block(world, WORLD), block(seen, SEEN), block(memory, ROWS)[:, :n], numbers(constants, FACTOR)
    state, motion, hits = w[STATE : STATE + STATES, :n], w[MOTION : MOTION + 4, :n], w[IMPACT : IMPACT + 2, :n]
    force, asked, now = w[FORCE : FORCE + 2, :n], s[REFERENCE : REFERENCE + REFERENCES, :n], scratch(INFO)[:, :n]
    kept, errors = table3(tables, 0)[:, :, lane : lane + n], table3(tables, 1)[:, :, lane : lane + n]
    describe(s[TIME, :n], w[SINCE_JUMP, :n], state, motion, asked, force, hits, w[:PARAMETERS, :n], now)
    for i in range(n):
        if m[COUNT, i] == 0.0:
            given = compliance(force[0, i], force[1, i], asked[8, i], asked[9, i], asked[14, i])
            for axis in range(2):
                m[MOVED + axis, i], m[MOVED + 2 + axis, i] = given[axis], given[axis]
            for k in range(STATES):
                m[START + k, i] = state[k, i]
            for k in range(4):
                m[START + STATES + k, i] = motion[k, i]
        number = int(m[COUNT, i])
        if m[ALIVE, i] > 0.0 and number % int(about[EVERY]) == 0:
            for axis in range(2):
                errors[number // int(about[EVERY]), axis, i] = now[ERROR + axis, i]
        for k in range(2):
            hits[k, i] = 0.0
    for k in range(4):
        for i in range(n):
            m[COMMAND + k, i] = s[OPENING + k, i]
    sample(now, m[COMMAND:LAST], about[PERIOD], m, kept)
    return 0


@kernel
def _pay(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    w, s, m = block(world, WORLD), block(seen, SEEN), block(memory, ROWS)[:, :n]
    about, own = numbers(constants, FACTOR + len(DISCOUNTS)), scratch(8)[:, :n]
    state, motion, hits = w[STATE : STATE + STATES, :n], w[MOTION : MOTION + 4, :n], w[IMPACT : IMPACT + 2, :n]
    force, asked, since = w[FORCE : FORCE + 2, :n], s[REFERENCE : REFERENCE + REFERENCES, :n], w[SINCE_JUMP, :n]
    jumped, failed, good, terms, command, last = own[0], own[1], own[2], own[3:], m[COMMAND:LAST], m[LAST:START]
    for i in range(n):
        jumped[i] = 1.0 if since[i] < about[JUMPED] else 0.0
    reward.assess(
        state, motion, asked, force, jumped, m[MOVED:CALM], command, last, hits, about[SPEED], about[PERIOD], terms, failed
    )  # fmt: skip
    success.add(motion, asked, force, since, failed, m[CALM:SUCCESS], good)
    for i in range(n):
        paid = terms[0, i] + terms[1, i] + terms[2, i] + terms[3, i] + terms[4, i]
        for k in range(len(DISCOUNTS)):
            m[RETURN + k, i] += m[WEIGHT + k, i] * (paid if m[ALIVE, i] > 0.0 else 0.0)
            m[WEIGHT + k, i] *= about[FACTOR + k]
        for k in range(4):
            last[k, i] = command[k, i]
        if failed[i] > 0.0:
            m[ALIVE, i], m[FAILED, i] = 0.0, 1.0
            for k in range(STATES):
                state[k, i] = m[START + k, i]
            for k in range(4):
                motion[k, i] = m[START + STATES + k, i]
        m[SUCCESS, i] = good[i] * m[ALIVE, i]
    return 0


class Measures:
    """Metrics, rewards, success and error of the episodes that have just begun in a ``simulation``, whose loop they join.

    ``steps`` is the most control periods of an episode. ``error`` (T, 2, N), m, every ``TRACE`` s, is NaN where a lane is lost.
    ``stops`` says whether the loop stops in every period for a user's Python.
    """

    def __init__(self, simulation: Simulation, steps: int) -> None:
        period, lanes = simulation.period, simulation.plant.num_envs
        every = max(1, round(TRACE / period))
        self.error: Array = np.full((-(-steps // every), 2, lanes), np.nan)
        self._period, self._memory = period, fresh_tally(lanes, ROWS)
        self._memory[WEIGHT:RETURN] = 1.0
        about = (period, every, period - 0.5 * period, simulation.parameters.mechanics.impact_speed)
        constants = np.array([*about, *np.power(DISCOUNTS, period / 0.01)])
        see = Stage(_see, constants, self._memory, (window(lanes, period), self.error))
        self.stops = simulation.watch([see], [Stage(_pay, constants, self._memory)])

    @property
    def alive(self) -> NDArray[np.bool_]:
        """Lanes (N,) that are not lost."""
        return np.asarray(self._memory[ALIVE] > 0.0)

    @property
    def success(self) -> NDArray[np.bool_]:
        """Lanes (N,) that are successful so far, see ``birthsim_env.success``."""
        return np.asarray(self._memory[SUCCESS] > 0.0)

    @property
    def returns(self) -> Array:
        """Sums of discounted rewards, (D, N), for each of ``DISCOUNTS``."""
        return self._memory[RETURN:].copy()

    def fallen(self) -> NDArray[np.bool_]:
        """Lanes (N,) that have left the physical range since the last call."""
        fallen: NDArray[np.bool_] = self._memory[FAILED] > 0.0
        self._memory[FAILED] = 0.0
        return fallen

    def metrics(self) -> dict[str, Array]:
        """Every metric of ``metrics.UNITS`` per lane, (N,)."""
        return figures_of(self._memory[:TALLY], self._period)
