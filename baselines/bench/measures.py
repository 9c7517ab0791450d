"""What an evaluation measures as two stages of the closed loop: nothing of it stops the loop.

``_measure`` samples metrics and error once the controller has commanded. ``_reward`` rewards the period when the rig is at its
end. A lane that leaves the physical range is lost: it is measured no further, and put back to where its episode began, where
it harms nothing.
"""

import math

import numpy as np
from numpy.typing import NDArray

from baselines.bench.metrics import Tally, fresh_tally, sample, turn, window
from birthsim_env import reward
from birthsim_env.info import Info, describe
from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.signals import compliance
from birthsim_env.loop.stage import Stage, scratch, table3
from birthsim_env.outcome import Ends
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import STATES, Array
from birthsim_env.physics.compiled.records import Numbers, number, part, row, rows
from birthsim_env.physics.dynamics import load
from birthsim_env.simulation import Simulation

DISCOUNTS = (0.9, 0.96, 0.99, 0.999, 1.0)
"""Per 10 ms, the default policy period: returns are summed with each of them."""

TRACE = 0.01
"""s between the samples of the error kept for the figure."""


class Memory(Tally):
    """What is carried from period to period."""

    command = rows(4, "1", "openings")
    last = rows(4, "1", "those of the period before")
    state = rows(STATES, "SI", "where the episode began")
    motion = rows(4, "SI", "of the end effector there")
    target_lag = part(reward.TargetLag, "for the reward")
    tally = part(reward.Tally, "for success")
    success = row("1", "1 where the episode is successful so far")
    terminated = row("1", "1 where the lane has left the physical range")
    weight = rows(len(DISCOUNTS), "1", "of the next reward, for each of ``DISCOUNTS``")
    returns = rows(len(DISCOUNTS), "1", "sums of the rewards so far")


class Constants(Numbers):
    """Constants of the stages."""

    limits = part(reward.Limits, "of the environment")
    every = number("1", "control periods between samples of the error")
    discounts = rows(len(DISCOUNTS), "1", "of a control period")


@kernel
def _measure(world: World, seen: Seen, own: Memory, constants: Constants, tables: int, lane: int, n: int) -> int:
    """Tables: positions kept for the metrics (W, 2, N); error (T, 2, N), m."""
    now, every, reference = Info(scratch(Info.size)), int(constants.every), seen.reference
    kept, errors = table3(tables, 0)[:, :, lane : lane + n], table3(tables, 1)[:, :, lane : lane + n]
    describe(world, seen, now, n)
    load(seen.opening, 0, n, own.command)
    turn(now, own.command, world.rig, n)
    for i in range(n):
        number = int(own.count[i])
        if number == 0:
            kx, ky, kxy = reference.stiffness[0, i], reference.stiffness[1, i], reference.stiffness_coupling[i]
            offset = compliance(world.force[0, i], world.force[1, i], kx, ky, kxy)
            for axis in range(2):
                own.target_lag.offset[axis, i], own.target_lag.remaining[axis, i] = offset[axis], offset[axis]
            for k in range(STATES):
                own.state[k, i] = world.state[k, i]
            for k in range(4):
                own.motion[k, i] = world.motion.rows[k, i]
        if own.alive[i] > 0.0 and number % every == 0:
            for axis in range(2):
                errors[number // every, axis, i] = now.tracking_error[axis, i]
        world.impact[0, i], world.impact[1, i] = 0.0, 0.0
    sample(now, own.command, constants.limits.period, own, kept, n)
    return 0


@kernel
def _reward(world: World, seen: Seen, own: Memory, constants: Constants, tables: int, lane: int, n: int) -> int:
    terms, ends, reference = reward.Terms(scratch(reward.Terms.size)), Ends(scratch(Ends.size)), seen.reference
    terminated = ends.terminated
    reward.assess(world, reference, own.target_lag, own.command, own.last, constants.limits, terms, terminated, n)
    reward.add(world, reference, terminated, own.tally, ends.success, n)
    for i in range(n):
        total = terms.total[i] if own.alive[i] > 0.0 else 0.0
        for k in range(len(DISCOUNTS)):
            own.returns[k, i] += own.weight[k, i] * total
            own.weight[k, i] *= constants.discounts[k]
        if terminated[i] > 0.0:
            own.alive[i], own.terminated[i] = 0.0, 1.0
            for k in range(STATES):
                world.state[k, i] = own.state[k, i]
            for k in range(4):
                world.motion.rows[k, i] = own.motion[k, i]
        own.success[i] = ends.success[i] * own.alive[i]
    load(own.command, 0, n, own.last)
    return 0


class Measures:
    """Metrics, rewards, success and error of the episodes that have just begun in a ``simulation``, whose loop they join.

    ``steps`` is the most control periods of an episode. ``own`` is what has been measured, ``error`` (T, 2, N), m, the error
    every ``TRACE`` s, NaN where a lane is lost.
    ``stops`` says whether the loop stops in every period for a user's Python.
    """

    def __init__(self, simulation: Simulation, steps: int) -> None:
        period, lanes = simulation.period, simulation.plant.num_envs
        every = max(1, round(TRACE / period))
        self.error: Array = np.full((-(-steps // every), 2, lanes), np.nan)
        self.own = Memory(fresh_tally(lanes, Memory.size - Tally.size))
        self.own.weight[:] = 1.0
        limits = reward.Limits.numbers(
            period=period, jumped_below=period - 0.5 * period, impact_speed=simulation.parameters.mechanics.impact_speed
        )
        # NumPy's power differs between processors in its last bits.
        discounts = [exact.number("exp", exact.number("log2", one) * math.log(2) * (period / 0.01)) for one in DISCOUNTS]
        constants = Constants.numbers(limits=limits, every=every, discounts=np.array(discounts))
        measure = Stage(_measure, constants, self.own.rows, (window(lanes, period), self.error))
        rewards = Stage(_reward, constants, self.own.rows)
        # Once the valves are commanded; once target, hand and rig are at the new instant, before the sensors look.
        pipeline = simulation.pipeline.without("outcome").after("actuation", measure).before("sensors", rewards)
        simulation.pipeline, self.stops = pipeline, pipeline.stops

    def terminated(self) -> NDArray[np.bool_]:
        """Lanes (N,) that have left the physical range since the last call."""
        terminated: NDArray[np.bool_] = self.own.terminated > 0.0
        self.own.terminated[:] = 0.0
        return terminated
