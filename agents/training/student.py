"""A recurrent student of a privileged teacher: it is told nothing, and does what the teacher does by what it remembers.

DAgger (Ross, Gordon and Bagnell 2011): the teacher says at every step what it would do, while from the second round on the
student acts. The student is a gated recurrent unit (GRU), as in RAPTOR (arXiv 2509.11481).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from agents.policy.files import Policy
from agents.policy.network import CLIP, EPSILON
from agents.residual.privileged import told
from agents.training.validation import TRAINING_SEED, Score, validate
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
    """What a student is taught with: sizes of its memory, how many rounds, ``seed`` of weights and worlds."""

    hidden: int = 32
    rounds: int = 12
    seed: int = 0


Numbers = NDArray[np.floating]


class Student(torch.nn.Module):
    """Observations (T, N, D) -> actions (T, N, size): a tanh layer, a GRU of as many cells, and a layer over both."""

    def __init__(self, mean: Numbers, deviation: Numbers, outputs: int, hidden: int) -> None:
        """``mean`` and ``deviation`` (D,) of the observations."""
        super().__init__()
        self.mean: torch.Tensor
        self.deviation: torch.Tensor
        self.register_buffer("mean", torch.tensor(mean, dtype=torch.float32))
        self.register_buffer("deviation", torch.tensor(deviation, dtype=torch.float32))
        self.enter, self.memory = torch.nn.Linear(len(mean), hidden), torch.nn.GRU(hidden, hidden)
        self.leave = torch.nn.Linear(2 * hidden, outputs)
        torch.nn.init.zeros_(self.leave.weight)
        torch.nn.init.zeros_(self.leave.bias)

    def forward(self, seen: torch.Tensor, state: torch.Tensor | None = None) -> tuple[torch.Tensor, torch.Tensor]:
        """Actions, and the state (1, N, hidden) of the memory after them; None begins an episode."""
        entered = torch.tanh(self.enter(((seen - self.mean) / self.deviation).clamp(-CLIP, CLIP)))
        remembered, state = self.memory(entered, state)
        return self.leave(torch.cat([entered, remembered], -1)), state

    def acting(self) -> Callable[[NDArray[np.float32]], NDArray[np.float32]]:
        """What it does from the beginning of an episode on: observations (N, D) of one step after the other -> actions."""
        state: list[torch.Tensor | None] = [None]

        def act(seen: NDArray[np.float32]) -> NDArray[np.float32]:
            with torch.no_grad():
                actions, state[0] = self(torch.from_numpy(seen)[None], state[0])
            return np.asarray(actions[0].clamp(-1.0, 1.0).numpy())

        return act


Round = tuple[torch.Tensor, torch.Tensor, torch.Tensor]
"""Observations (T, N, D), the teacher's actions (T, N, size), and whether the episode went on (T, N)."""


def teach(teacher: Policy, lessons: Lessons, parameters: Parameters) -> Iterator[tuple[Student, Score, bool]]:
    """After each round: the student as it is, what it reaches in validation, and whether no round before was as good (sum of
    pooled error and tail).

    ``parameters`` is the rig as its owner describes it.
    """
    torch.set_num_threads(1)
    torch.manual_seed(lessons.seed)
    env, checks = (_worlds(teacher, lanes, parameters) for lanes in (LANES, teacher.training["validation_lanes"]))
    network, inputs = teacher.network, env.single_observation_space.shape[0]
    deviation = np.sqrt(network.variance[:inputs] + EPSILON)
    student = Student(network.mean[:inputs], deviation, network.outputs, lessons.hidden)
    adam = torch.optim.Adam(student.parameters(), lr=RATE)
    past: deque[Round] = deque(maxlen=KEPT)
    least = np.inf
    with closing(env), closing(checks):
        for number in range(lessons.rounds):
            past.append(_round(env, teacher, student, SEED + SPACING * lessons.seed + LANES * number, number == 0))
            adam.param_groups[0]["lr"] = RATE * (1 - number / lessons.rounds) + LEAST_RATE
            _learn(student, adam, list(past), number)
            score = validate(checks, student.acting())
            before, least = least, min(least, score.pooled + score.tail)
            yield student, score, number == 0 or least < before


def _worlds(teacher: Policy, lanes: int, parameters: Parameters) -> Any:
    its = {name: teacher.training[name] for name in ("sensors", "randomize")}
    return gymnasium.make_vec(
        teacher.environment, num_envs=lanes, parameters=parameters, autoreset_mode=AutoresetMode.SAME_STEP, **its,
        **teacher.settings.to_dict(),
    )  # fmt: skip


def _round(env: Any, teacher: Policy, student: Student, seed: int, shown: bool) -> Round:
    """An episode in every lane, in which the student acts, or where it is ``shown`` how, the teacher."""
    seen, _ = env.reset(seed=seed)
    act, alive, steps = student.acting(), np.ones(env.num_envs, dtype=np.bool_), []
    for _ in range(env.steps):
        right = teacher.network.actions(told(env, seen))
        steps.append((seen, right, alive))
        seen, _, terminated, _, _ = env.step(right if shown else act(seen))
        alive = alive & ~terminated
    observations, actions, counted = (torch.from_numpy(np.stack(rows)) for rows in zip(*steps, strict=True))
    return observations, actions, counted


def _learn(student: Student, adam: torch.optim.Optimizer, rounds: list[Round], number: int) -> None:
    """The last round and then all of them, four times in the first round and else twice; least squares."""
    order = [len(rounds) - 1, *np.random.default_rng(number).permutation(len(rounds))]
    for k in order * (2 if number else 4):
        observations, actions, counted = rounds[k]
        state = None
        for first in range(0, len(observations), CHUNK):
            part = slice(first, first + CHUNK)
            does, state = student(observations[part], state)
            state = state.detach()
            loss = (((does - actions[part]) ** 2).mean(-1) * counted[part]).mean()
            adam.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(student.parameters(), 1.0)
            adam.step()
