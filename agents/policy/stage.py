"""A policy as a stage of the closed loop, before the law that it corrects: the same bits as ``ResidualController``."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.policy.network import CLIP, EPSILON, PolicyNetwork, layer, remember
from birthsim_env.loop.rows import ACTION, POSITION, POSITION_TIME, PRESSURE, REFERENCE, SEEN, SHOWN, USER_FORCE, VELOCITY
from birthsim_env.loop.signals import REFERENCES
from birthsim_env.loop.stage import Stage, block, numbers, singles, table1, table3
from birthsim_env.observation import SCALES, SIZE, look
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import PARAMETERS, Array

PERIODS, ACTIONS, MEMORIES, LAYERS, SQUASHED, CELLS, ABOUT = range(7)
"""Constants of the stage: control periods of a policy step; lengths of an action and of what the law shows of its memory;
layers; 1 where the last one is squashed; cells of the policy's own memory. The rig follows, and the scales of an
observation."""

OBSERVED, MEAN, DEVIATION, ACTIVATIONS, WEIGHTS = range(5)
"""Tables: observations (N, D), means (D,), standard deviations (D,), activations (2, N, W), with a memory (4, N, W), then
weights (in, out) and bias (1, out) of each layer, those of the memory last."""


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
    size, shown, layers = int(about[ACTIONS]), int(about[MEMORIES]), int(about[LAYERS])
    observed, mean, deviation = singles(tables, OBSERVED)[lane : lane + n], table1(tables, MEAN), table1(tables, DEVIATION)
    space = table3(tables, ACTIVATIONS)[:, lane : lane + n]
    look(
        s[POSITION:VELOCITY, :n], s[VELOCITY:POSITION_TIME, :n], s[PRESSURE:USER_FORCE, :n],
        s[REFERENCE : REFERENCE + REFERENCES, :n], s[USER_FORCE:REFERENCE, :n], s[ACTION : ACTION + size, :n],
        s[SHOWN : SHOWN + shown, :n], about[ABOUT : ABOUT + PARAMETERS], about[ABOUT + PARAMETERS :], observed,
    )  # fmt: skip
    width = mean.shape[0]
    for i in range(n):
        for k in range(width):
            space[0, i, k] = min(max((observed[i, k] - mean[k]) / deviation[k], -CLIP), CLIP)
    last = layers - 1
    for k in range(last):
        _through(tables, k, True, space[k % 2], space[(k + 1) % 2])
    if cells > 0:
        enters, own = space[last % 2], kept[1:, :n].T
        _through(tables, layers, False, enters, space[2])
        _through(tables, layers + 1, False, own, space[3])
        remember(space[2], space[3], own)
        width = singles(tables, WEIGHTS + 2 * layers).shape[0]
        for i in range(n):
            for k in range(cells):
                enters[i, width + k] = own[i, k]
    _through(tables, last, about[SQUASHED] > 0.0, space[last % 2], space[layers % 2])
    for i in range(n):
        for k in range(size):
            s[ACTION + k, i] = np.float64(np.float32(min(max(space[layers % 2, i, k], -1.0), 1.0)))
    return 0


@helper
def _through(tables: int, k: int, squashed: bool, x: Array, y: Array) -> None:
    """The first numbers of ``x`` (N, W), through the ``k``-th layer of the tables, become the first of ``y`` (N, W)."""
    weight, bias = singles(tables, WEIGHTS + 2 * k), singles(tables, WEIGHTS + 2 * k + 1)[0]
    layer(x[:, : weight.shape[0]], weight, bias, squashed, y[:, : weight.shape[1]])


def policy_stage(network: PolicyNetwork, periods: int, actions: int, shown: int, nominal: Array, lanes: int) -> Stage:
    """A network that is asked every ``periods`` control periods; the law shows ``shown`` rows of its memory, and its owner
    describes the rig as ``nominal`` (PARAMETERS,)."""
    layers = [array for weight, bias in network.transposed for array in (weight, bias[None].copy())]
    widest = max(network.inputs, *(max(weight.shape) for weight, _ in network.transposed))
    about = (periods, actions, shown, len(network.layers), network.squashed, network.cells)
    tables: tuple[NDArray[Any], ...] = (
        np.zeros((lanes, network.inputs), dtype=np.float32),
        network.mean,
        np.sqrt(network.variance + EPSILON),
        np.zeros((4 if network.memory else 2, lanes, widest)),
        *layers,
    )
    memory = np.zeros((1 + network.cells, lanes))
    return Stage(decide, np.array([*about, *nominal, *SCALES]), memory, tables, sees_world=False)
