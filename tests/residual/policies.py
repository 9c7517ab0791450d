"""Policies that several tests use."""

from itertools import pairwise
from pathlib import Path

import numpy as np

from agents.policy.files import Policy
from agents.residual.corrected import observation_names
from agents.residual.settings import ResidualSettings
from baselines.network import PolicyNetwork

ENVIRONMENT = "BirthSIM/ProbeResidual-v3"
SETTINGS = ResidualSettings("backstepping-weight", authority=33.0, time_constant=0.04, policy_period=0.02)
INPUTS = len(observation_names(SETTINGS))
TRAINING = {"steps": 7, "seed": 3, "curve": [{"steps": 0, "pooled_mm": 1.5}]}


def network(inputs=INPUTS, outputs=2, hidden=(16, 8), seed=0, squashed=False, cells=0, reach=1.0) -> PolicyNetwork:
    """Random weights, actions of about ``reach`` in size; with ``cells`` also a memory."""
    rng = np.random.default_rng(seed)

    def layer(m, n, size=1.0):
        weight, bias = rng.normal(size=(n, m), scale=size / np.sqrt(m)), rng.normal(size=n, scale=0.1 * size)
        return weight.astype(np.float32), bias.astype(np.float32)

    widths = (inputs, *hidden)
    layers = *(layer(m, n) for m, n in pairwise(widths)), layer(widths[-1] + cells, outputs, reach)
    memory = (layer(widths[-1], 3 * cells), layer(cells, 3 * cells)) if cells else ()
    return PolicyNetwork(rng.normal(size=inputs, scale=0.3), rng.uniform(0.1, 2, inputs), layers, squashed, memory)


def policy(settings=SETTINGS, **options) -> Policy:
    """Of a random network that fits the settings."""
    return Policy(network(len(observation_names(settings)), settings.size, **options), ENVIRONMENT, settings, TRAINING)


class Trap:
    """Unpickling one writes a file."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return (Path.touch, (self.path,))


POLICIES = {"forward": policy(), "with a memory": policy(cells=5)}
"""Three layers, without and with a memory."""
