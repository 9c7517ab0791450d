"""A recurrent student imitates a privileged teacher from measurements alone, without the true parameters that the teacher sees.

DAgger (Ross, Gordon and Bagnell 2011): the teacher says at every step what it would do, while from the second round on the
student acts. The student is a gated recurrent unit (GRU), as in RAPTOR (arXiv 2509.11481).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium.vector import AutoresetMode

from agents.policy.files import Policy
from agents.residual.privileged import TRUE_PARAMETERS, with_true_parameters
from agents.training.differentiated import Differentiated
from agents.training.validation import TRAINING_SEED, Score, validate
from baselines.network import PolicyNetwork
from birthsim_env.physics.rig.parameters import Parameters

LANES = 256
"""Worlds of a round, all of their episodes."""

KEPT = 8
"""Rounds that are remembered; assumed."""

CHUNK = 50
"""Policy steps that a gradient goes back; assumed."""

RATE, LEAST_RATE = 2e-3, 5e-5
"""Learning rate of Adam at the beginning, falling linearly, and what is added to it; assumed."""

SEED, SPACING = TRAINING_SEED + 500_000, 100_000
"""First seed of the worlds, and between those of neighbouring seeds: none that the teacher was trained or validated on."""


@dataclass(frozen=True)
class Lessons:
    """What a student is taught with: cells of its memory, how many rounds, ``seed`` of weights and worlds."""

    hidden: int = 32
    rounds: int = 12
    seed: int = 0


Round = tuple[torch.Tensor, torch.Tensor, torch.Tensor]
"""Normalised observations (T, N, D), the teacher's actions (T, N, size), and whether the episode went on (T, N)."""


def teach(teacher: Policy, lessons: Lessons, parameters: Parameters) -> Iterator[tuple[int, PolicyNetwork, Score]]:
    """Before the first and after each round: policy steps so far, the student as it is, and what it reaches in validation.

    An untaught student is the law alone. ``parameters`` is the rig as its owner describes it. Raises ``ValueError`` for a
    teacher that was told other parameters than ``true_parameters``.
    """
    torch.set_num_threads(1)
    torch.manual_seed(lessons.seed)
    env, checks = (_worlds(teacher, lanes, parameters) for lanes in (LANES, teacher.training["validation_lanes"]))
    inputs, outputs = env.single_observation_space.shape[0], teacher.network.outputs
    if teacher.network.inputs != inputs + TRUE_PARAMETERS:
        raise ValueError(
            f"teacher observes {teacher.network.inputs} numbers; allowed: {inputs + TRUE_PARAMETERS}, of which "
            f"{TRUE_PARAMETERS} are the true parameters that this version tells"
        )
    mean, variance = teacher.network.mean[:inputs], teacher.network.variance[:inputs]
    student = Differentiated(inputs, outputs, (lessons.hidden,), lessons.hidden, squashed=False)
    adam = torch.optim.Adam(student.parameters(), lr=RATE)
    past: deque[Round] = deque(maxlen=KEPT)
    network = student.network(mean, variance)
    with closing(env), closing(checks):
        yield 0, network, validate(checks, network.acting())
        for number in range(lessons.rounds):
            past.append(_round(env, teacher, network, SEED + SPACING * lessons.seed + LANES * number, number == 0))
            adam.param_groups[0]["lr"] = RATE * (1 - number / lessons.rounds) + LEAST_RATE
            _learn(student, adam, list(past), number)
            network = student.network(mean, variance)
            yield (number + 1) * LANES * env.steps, network, validate(checks, network.acting())


def _worlds(teacher: Policy, lanes: int, parameters: Parameters) -> Any:
    its = {name: teacher.training[name] for name in ("sensors", "randomize")}
    return gymnasium.make_vec(
        teacher.environment,
        num_envs=lanes,
        parameters=parameters,
        autoreset_mode=AutoresetMode.SAME_STEP,
        **its,
        **teacher.settings.to_dict(),
    )


def _round(env: Any, teacher: Policy, network: PolicyNetwork, seed: int, shown: bool) -> Round:
    """An episode in every lane, in which the student acts, or where it is ``shown`` how, the teacher."""
    seen, _ = env.reset(seed=seed)
    acts, shows, alive, steps = network.acting(), teacher.network.acting(), np.ones(env.num_envs, dtype=np.bool_), []
    for _ in range(env.steps):
        right = shows(with_true_parameters(env, seen))
        steps.append((network.normalized(seen).astype(np.float32), right, alive))
        seen, _, terminated, _, _ = env.step(right if shown else acts(seen))
        alive = alive & ~terminated
    observations, actions, counted = (torch.from_numpy(np.stack(rows)) for rows in zip(*steps, strict=True))
    return observations, actions, counted


def _learn(student: Differentiated, adam: torch.optim.Optimizer, rounds: list[Round], number: int) -> None:
    """The last round and then all of them, four times in the first round and else twice; least squares."""
    order = [len(rounds) - 1, *np.random.default_rng(number).permutation(len(rounds))]
    for k in order * (2 if number else 4):
        observations, actions, counted = rounds[k]
        held = torch.zeros(observations.shape[1], student.cells)
        for first in range(0, len(observations), CHUNK):
            part = slice(first, first + CHUNK)
            does, held = student(observations[part], held)
            held = held.detach()
            loss = (((does - actions[part]) ** 2).mean(-1) * counted[part]).mean()
            adam.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(student.parameters(), 1.0)
            adam.step()
