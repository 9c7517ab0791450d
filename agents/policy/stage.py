"""A policy as a stage of the closed loop, before the law that it corrects: the same bits as ``ResidualController``."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.policy.network import CLIP, EPSILON, PolicyNetwork, layer, remember
from birthsim_env.loop.rows import Seen
from birthsim_env.loop.stage import Stage, block, singles, table1, table3
from birthsim_env.observation import SCALES, SIZE, look
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import PARAMETERS, Array
from birthsim_env.physics.compiled.records import Numbers, Rows, number, row, rows


class About(Numbers):
    """Constants of the stage."""

    periods = number("1", "control periods of a policy step")
    actions = number("1", "length of an action")
    shown = number("1", "length of what the law shows of its memory")
    layers = number("1", "layers of the network")
    squashed = number("1", "1 where the last layer is squashed")
    cells = number("1", "cells of the policy's own memory")
    rig = rows(PARAMETERS, "SI", "the rig as described")
    scales = rows(SIZE, "SI", "of an observation")


class Memory(Rows):
    """What is carried from one control period to the next."""

    left = row("1", "control periods until the next action")
    cells = rows(0, "1", "the policy's own memory")


OBSERVED, MEAN, DEVIATION, ACTIVATIONS, WEIGHTS = range(5)
"""Tables: observations (N, D), means (D,), standard deviations (D,), activations (2, N, W), with a memory (4, N, W), then
weights (in, out) and bias (1, out) of each layer, those of the memory last."""


@kernel
def decide(world: int, seen: Seen, memory: int, about: About, tables: int, lane: int, n: int) -> int:
    """Writes the action, once per policy step."""
    cells = int(about.cells)
    kept = Memory(block(memory, Memory.size + cells))
    due = kept.left[0] == 0.0
    for i in range(n):
        kept.left[i] = (about.periods if due else kept.left[i]) - 1.0
    if not due:
        return 0
    size, shown, layers = int(about.actions), int(about.shown), int(about.layers)
    observed, mean, deviation = singles(tables, OBSERVED)[lane : lane + n], table1(tables, MEAN), table1(tables, DEVIATION)
    space = table3(tables, ACTIVATIONS)[:, lane : lane + n]
    look(seen, seen.action[:size], seen.shown[:shown], about.rig, about.scales, observed, n)
    width = mean.shape[0]
    for i in range(n):
        for k in range(width):
            space[0, i, k] = min(max((observed[i, k] - mean[k]) / deviation[k], -CLIP), CLIP)
    last = layers - 1
    for k in range(last):
        _through(tables, k, True, space[k % 2], space[(k + 1) % 2])
    if cells > 0:
        enters, own = space[last % 2], kept.cells[:, :n].T
        _through(tables, layers, False, enters, space[2])
        _through(tables, layers + 1, False, own, space[3])
        remember(space[2], space[3], own)
        width = singles(tables, WEIGHTS + 2 * layers).shape[0]
        for i in range(n):
            for k in range(cells):
                enters[i, width + k] = own[i, k]
    _through(tables, last, about.squashed > 0.0, space[last % 2], space[layers % 2])
    for i in range(n):
        for k in range(size):
            seen.action[k, i] = np.float64(np.float32(min(max(space[layers % 2, i, k], -1.0), 1.0)))
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
    about = About.numbers(
        periods=periods, actions=actions, shown=shown, layers=len(network.layers), squashed=network.squashed,
        cells=network.cells, rig=nominal, scales=SCALES,
    )  # fmt: skip
    tables: tuple[NDArray[Any], ...] = (
        np.zeros((lanes, network.inputs), dtype=np.float32),
        network.mean,
        np.sqrt(network.variance + EPSILON),
        np.zeros((4 if network.memory else 2, lanes, widest)),
        *layers,
    )
    memory = np.zeros((Memory.size + network.cells, lanes))
    return Stage(decide, about, memory, tables, sees_world=False)
