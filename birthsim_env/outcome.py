"""What closes a policy step: reward, success, info and observation of all lanes, as one stage of the closed loop."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from birthsim_env import info, observation, reward
from birthsim_env.loop.pipeline import Step
from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.signals import Mask, compliant_offset
from birthsim_env.loop.stage import Stage, block, singles, table2
from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array, Rig
from birthsim_env.physics.compiled.records import Numbers, Rows, number, part, row, rows
from birthsim_env.restored import Declared


class Memory(Rows):
    """What is carried from one policy step to the next."""

    target_lag = part(reward.TargetLag, "for the reward")
    tally = part(reward.Tally, "for success")
    fresh = row("1", "1 where an episode begins")
    air = row("kg", "drawn from the supply")
    action = rows(0, "1", "the last action")


class Ends(Rows):
    """How episodes are doing."""

    terminated = row("1", "1 where the lane has left the physical range")
    success = row("1", "1 where the episode is successful so far")


class Constants(Numbers):
    """Constants of the stage."""

    stepped = number("1", "1 after a step, 0 where episodes begin")
    limits = part(reward.Limits, "of the environment")
    actions = number("1", "length of an action")
    shown = number("1", "length of what is shown of a memory")
    rig = part(Rig, "the rig as described")
    scales = rows(observation.SIZE, "SI", "of an observation")


@kernel
def _close(world: World, seen: Seen, memory: int, constants: Constants, tables: int, lane: int, n: int) -> int:
    size, mine, reference = int(constants.actions), slice(lane, lane + n), seen.reference
    own, ends = Memory(block(memory, Memory.size + size)), Ends(table2(tables, 1)[:, mine])
    told = info.Info(table2(tables, 2)[:, mine])
    action = seen.action[:size]
    if constants.stepped > 0.0:
        terms = reward.Terms(table2(tables, 0)[:, mine])
        reward.assess(world, reference, own.target_lag, action, own.action, constants.limits, terms, ends.terminated, n)
        reward.add(world, reference, ends.terminated, own.tally, ends.success, n)
        dynamics.copy(action, own.action, n)
    else:
        for i in range(n):
            if own.fresh[i] > 0.0:
                # It starts on the target, however hard the hand pushes: all that the push asks for comes little by little.
                offset = compliant_offset(reference, world.force[0, i], world.force[1, i], i)
                for axis in range(2):
                    own.target_lag.offset[axis, i], own.target_lag.remaining[axis, i] = offset[axis], offset[axis]
                own.fresh[i], ends.terminated[i], ends.success[i] = 0.0, 0.0, 0.0
    info.describe(world, seen, told, n)
    for i in range(n):
        own.air[i] += told.supply_flow[i] * (constants.limits.period * constants.stepped)
        told.air_used[i] = own.air[i]
    shown = seen.shown[: int(constants.shown)]
    observation.look(seen, own.action, shown, constants.rig, constants.scales, singles(tables, 3)[mine], n)
    return 0


class Outcome:
    """What N lanes show after a policy step, or where their episodes begin.

    - ``terms`` (6, N): ``reward.Terms``;
    - ``ends`` (2, N): ``Ends``;
    - ``rows`` (M, N): ``info.Info``;
    - ``seen`` (N, size): observations.
    """

    in_state: ClassVar[Declared] = {"_constants": None}

    def __init__(
        self, lanes: int, nominal: Array, actions: int, shown: int, policy_period: float, period: float, impact_speed: float
    ) -> None:
        self.terms, self.ends = np.zeros((reward.Terms.size, lanes)), np.zeros((Ends.size, lanes))
        self.rows: Array = np.zeros((info.Info.size, lanes))
        self.seen: NDArray[np.float32] = np.zeros((lanes, observation.size_of(nominal) + actions + shown), dtype=np.float32)
        self._memory: Array = np.zeros((Memory.size + actions, lanes))
        # Half a control period less: the clock of a jump counts in sums of them.
        limits = reward.Limits.numbers(
            period=policy_period, jumped_below=policy_period - 0.5 * period, impact_speed=impact_speed
        )
        self._constants = [
            Constants.numbers(
                stepped=stepped, limits=limits, actions=actions, shown=shown, rig=nominal, scales=observation.SCALES
            )
            for stepped in (False, True)
        ]

    def named(self) -> list[tuple[Array, list[str]]]:
        """``terms``, ``ends`` and ``rows`` with the names of their rows."""
        pairs = (self.terms, reward.Terms), (self.ends, Ends), (self.rows, info.Info)
        return [
            (array, [f"{name}{k}" if count > 1 else name for name, _, _, count in kind.entries() for k in range(count)])
            for array, kind in pairs
        ]

    def begin(self, lanes: Mask) -> None:
        """Forget the past of the lanes of a mask (N,)."""
        self._memory[:, lanes], Memory(self._memory).fresh[lanes] = 0.0, 1.0

    def step(self) -> Step:
        """What closes a policy step, and runs where episodes begin."""
        tables = (self.terms, self.ends, self.rows, self.seen)
        begin, close = (Stage(_close, about, self._memory, tables) for about in self._constants)
        return Step("outcome", close, begin, closes=True, built_in=True)
