"""A policy as a stage of the closed loop, before the law that it corrects: the same bits as ``ResidualController``."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from baselines.network import PolicyNetwork, answer
from birthsim_env.loop.rows import Seen
from birthsim_env.loop.stage import TABLE, Stage, block, singles, table3
from birthsim_env.observation import SCALES, SIZE, look
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array, Rig
from birthsim_env.physics.compiled.records import Numbers, Rows, number, part, row, rows


class Constants(Numbers):
    """Constants of the stage."""

    periods = number("1", "control periods of a policy step")
    actions = number("1", "length of an action")
    shown = number("1", "length of what the law shows of its memory")
    layers = number("1", "layers of the network")
    squashed = number("1", "1 where the last layer is squashed")
    cells = number("1", "cells of the policy's own memory")
    rig = part(Rig, "the rig as described")
    scales = rows(SIZE, "SI", "of an observation")


class Memory(Rows):
    """What is carried from one control period to the next."""

    left = row("1", "control periods until the next action")
    cells = rows(0, "1", "the policy's own memory")


FIRST_TABLE = 2
"""Tables: observations (N, D), ``PolicyNetwork.room``, and from here on ``PolicyNetwork.tables``."""


@kernel
def decide(world: int, seen: Seen, memory: int, constants: Constants, tables: int, lane: int, n: int) -> int:
    """Writes the action, once per policy step."""
    cells = int(constants.cells)
    kept = Memory(block(memory, Memory.size + cells))
    due = kept.left[0] == 0.0
    for i in range(n):
        kept.left[i] = (constants.periods if due else kept.left[i]) - 1.0
    if not due:
        return 0
    size, shown, mine = int(constants.actions), int(constants.shown), slice(lane, lane + n)
    observed, space = singles(tables, 0)[mine], table3(tables, 1)[:, mine]
    look(seen, seen.action[:size], seen.shown[:shown], constants.rig, constants.scales, observed, n)
    network, actions = tables + FIRST_TABLE * TABLE * 8, seen.action[:size, :n].T
    answer(network, int(constants.layers), constants.squashed > 0.0, observed, space, kept.cells[:, :n].T, actions)
    return 0


def policy_stage(network: PolicyNetwork, periods: int, actions: int, shown: int, nominal: Array, lanes: int) -> Stage:
    """A network that is asked every ``periods`` control periods; the law shows ``shown`` rows of its memory, and its owner
    describes the rig as ``nominal`` (PARAMETERS,)."""
    constants = Constants.numbers(
        periods=periods,
        actions=actions,
        shown=shown,
        layers=len(network.layers),
        squashed=network.squashed,
        cells=network.cells,
        rig=nominal,
        scales=SCALES,
    )
    observed: NDArray[Any] = np.zeros((lanes, network.inputs), dtype=np.float32)
    tables = (observed, network.room(lanes), *network.tables)
    return Stage(decide, constants, np.zeros((Memory.size + network.cells, lanes)), tables, sees_world=False)
