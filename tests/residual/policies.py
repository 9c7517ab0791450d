"""Policies that several tests use."""

from itertools import pairwise
from pathlib import Path

import numpy as np

from agents.policy.files import Policy
from agents.policy.network import PolicyNetwork
from agents.residual.law import observation_names
from agents.residual.settings import ResidualSettings

ENVIRONMENT = "BirthSIM/CircleResidual-v1"
SETTINGS = ResidualSettings("backstepping-weight", authority=33.0, time_constant=0.04, policy_period=0.02)
INPUTS = len(observation_names(SETTINGS))


def network(inputs=INPUTS, outputs=2, hidden=(16, 8), seed=0, squashed=False, cells=0) -> PolicyNetwork:
    """Random weights; with ``cells`` also a memory."""
    rng = np.random.default_rng(seed)

    def layer(m, n):
        return rng.normal(size=(n, m), scale=0.4).astype(np.float32), rng.normal(size=n, scale=0.1).astype(np.float32)

    widths = (inputs, *hidden, outputs)
    layers = [layer(m, n) for m, n in pairwise(widths)]
    mean, variance = rng.normal(size=inputs), rng.uniform(0.1, 2, inputs)
    memory = ()
    if cells:
        layers[-1], memory = layer(widths[-2] + cells, outputs), (layer(widths[-2], 3 * cells), layer(cells, 3 * cells))
    return PolicyNetwork(mean, variance, tuple(layers), squashed, memory)


class Trap:
    """Unpickling one writes a file."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return (Path.touch, (self.path,))


TRAINING = {"steps": 7, "seed": 3, "curve": [{"steps": 0, "pooled_mm": 1.5}]}
POLICY = Policy(network(), ENVIRONMENT, SETTINGS, TRAINING)
REMEMBERS = Policy(network(cells=5), ENVIRONMENT, SETTINGS, TRAINING)
"""Three layers, without and with a memory."""
