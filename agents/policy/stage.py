"""A policy as a stage of the closed loop, before the law that it corrects: the same bits as ``ResidualController``."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.policy.network import CLIP, EPSILON, PolicyNetwork, layer
from birthsim_env.loop.rows import ACTION, POSITION, POSITION_TIME, PRESSURE, REFERENCE, SEEN, SHOWN, USER_FORCE, VELOCITY
from birthsim_env.loop.signals import REFERENCES
from birthsim_env.loop.stage import Stage, block, numbers, singles, table1, table3
from birthsim_env.observation import SCALES, SIZE, look
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import PARAMETERS, Array

PERIODS, ACTIONS, MEMORIES, LAYERS, SQUASHED, ABOUT = range(6)
"""Constants of the stage: control periods of a policy step; lengths of an action and of what the law shows of its memory;
layers; 1 where the last one is squashed. The rig follows, and the scales of an observation."""

OBSERVED, MEAN, DEVIATION, ACTIVATIONS, WEIGHTS = range(5)
"""Tables: observations (N, D), means (D,), standard deviations (D,), activations (2, N, W), then weights (in, out) and bias
(1, out) of each layer."""


@kernel
def decide(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """Writes the action, once per policy step; memory: control periods until the next."""
    s, left, about = block(seen, SEEN), block(memory, 1), numbers(constants, ABOUT + PARAMETERS + SIZE)
    due = left[0, 0] == 0.0
    for i in range(n):
        left[0, i] = (about[PERIODS] if due else left[0, i]) - 1.0
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
    for k in range(layers):
        weight, bias = singles(tables, WEIGHTS + 2 * k), singles(tables, WEIGHTS + 2 * k + 1)[0]
        squashed = k + 1 < layers or about[SQUASHED] > 0.0
        layer(space[k % 2, :, : weight.shape[0]], weight, bias, squashed, space[(k + 1) % 2, :, : weight.shape[1]])
    for i in range(n):
        for k in range(size):
            s[ACTION + k, i] = np.float64(np.float32(min(max(space[layers % 2, i, k], -1.0), 1.0)))
    return 0


def policy_stage(network: PolicyNetwork, periods: int, actions: int, shown: int, nominal: Array, lanes: int) -> Stage:
    """A network that is asked every ``periods`` control periods; the law shows ``shown`` rows of its memory, and its owner
    describes the rig as ``nominal`` (PARAMETERS,)."""
    layers = [array for weight, bias in network.layers for array in (np.ascontiguousarray(weight.T), bias[None].copy())]
    widest = max(network.inputs, *(len(bias) for _, bias in network.layers))
    about = (periods, actions, shown, len(network.layers), network.squashed)
    tables: tuple[NDArray[Any], ...] = (
        np.zeros((lanes, network.inputs), dtype=np.float32),
        network.mean,
        np.sqrt(network.variance + EPSILON),
        np.zeros((2, lanes, widest)),
        *layers,
    )
    return Stage(decide, np.array([*about, *nominal, *SCALES]), np.zeros((1, lanes)), tables, sees_world=False)
