"""A policy as a stage of the closed loop, before the law that it corrects: the same bits as ``ResidualController``."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.policy.network import PolicyNetwork, answer
from birthsim_env.loop.rows import ACTION, POSITION, POSITION_TIME, PRESSURE, REFERENCE, SEEN, SHOWN, USER_FORCE, VELOCITY
from birthsim_env.loop.signals import REFERENCES
from birthsim_env.loop.stage import TABLE, Stage, block, numbers, singles, table3
from birthsim_env.observation import SCALES, SIZE, look
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import PARAMETERS, Array

PERIODS, ACTIONS, MEMORIES, LAYERS, SQUASHED, CELLS, ABOUT = range(7)
"""Constants of the stage: control periods of a policy step; lengths of an action and of what the law shows of its memory;
layers; 1 where the last one is squashed; cells of the policy's own memory. The rig follows, and the scales of an
observation."""

TOLD = 2
"""Tables: observations (N, D), ``PolicyNetwork.room``, and from here on ``PolicyNetwork.tables``."""


@kernel
def decide(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Writes the action, once per policy step; memory: control periods until the next, and then the policy's own."""
    s, about = block(seen, SEEN), numbers(constants, ABOUT + PARAMETERS + SIZE)
    cells = int(about[CELLS])
    kept = block(memory, 1 + cells)
    due = kept[0, 0] == 0.0
    for i in range(n):
        kept[0, i] = (about[PERIODS] if due else kept[0, i]) - 1.0
    if not due:
        return 0
    size, shown, mine = int(about[ACTIONS]), int(about[MEMORIES]), slice(lane, lane + n)
    observed, space = singles(tables, 0)[mine], table3(tables, 1)[:, mine]
    look(
        s[POSITION:VELOCITY, :n], s[VELOCITY:POSITION_TIME, :n], s[PRESSURE:USER_FORCE, :n],
        s[REFERENCE : REFERENCE + REFERENCES, :n], s[USER_FORCE:REFERENCE, :n], s[ACTION : ACTION + size, :n],
        s[SHOWN : SHOWN + shown, :n], about[ABOUT : ABOUT + PARAMETERS], about[ABOUT + PARAMETERS :], observed,
    )  # fmt: skip
    network, actions = tables + TOLD * TABLE * 8, s[ACTION : ACTION + size, :n].T
    answer(network, int(about[LAYERS]), about[SQUASHED] > 0.0, observed, space, kept[1:, :n].T, actions)
    return 0


def policy_stage(network: PolicyNetwork, periods: int, actions: int, shown: int, nominal: Array, lanes: int) -> Stage:
    """A network that is asked every ``periods`` control periods; the law shows ``shown`` rows of its memory, and its owner
    describes the rig as ``nominal`` (PARAMETERS,)."""
    about = (periods, actions, shown, len(network.layers), network.squashed, network.cells)
    observed: NDArray[Any] = np.zeros((lanes, network.inputs), dtype=np.float32)
    tables = (observed, network.room(lanes), *network.tables)
    memory = np.zeros((1 + network.cells, lanes))
    return Stage(decide, np.array([*about, *nominal, *SCALES]), memory, tables, sees_world=False)
