"""Analytic policy gradient: the reward of a short horizon is differentiated through the closed loop, and Adam climbs it.

As in SHAC (Xu et al., "Accelerated policy learning with parallel differentiable simulation", ICLR 2022), but without a critic:
the plant forgets an action within some 100 ms, and every step of the horizon is paid for (`docs/gradients.md`). A policy may
have a memory, which goes on from one rollout to the next; gradients go back through it to the beginning of a rollout
(truncated backpropagation through time, Williams and Peng 1990), over several horizons of the plant.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from agents.training.by_gradients.lanes import Lanes, observation_names, observations
from agents.training.checkpoint import read_checkpoint, require_moments, tensors, write_checkpoint
from agents.training.configuration import TrainingSettings
from agents.training.differentiated import Differentiated
from agents.training.validation import training_seeds
from agents.training.watch import Watch
from baselines.network import CLIP, EPSILON, PolicyNetwork
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.simulation import Simulation

LEAST_RATE = 0.01
"""Fraction of the learning rate at the end, to which it falls linearly."""

FREE = ("past", "state", "lanes")
"""Keys of a checkpoint below which whatever restores them looks itself."""

OBSERVED, LEAST = 64, 0.4
"""Rigs whose observations, during an episode, say how to normalise; the least standard deviation of an entry, in its scale."""

MET = 5.0
"""s: mean time that a rig is met; assumed."""

MOMENTS = (0.9, 0.99)
"""Of Adam; an update is a gradient of length one, so that one bad horizon moves no more than another."""


def _statistics(envs: Sequence[Any], seeds: Sequence[int], privileged: bool) -> tuple[Array, Array]:
    """Mean and variance (D,) of observations.

    They stay as they are: running ones would remember what the first policies see, beside which a millimetre is nothing.
    """
    names, found = zip(
        *(observations(env, seed, OBSERVED // len(envs), privileged) for env, seed in zip(envs, seeds, strict=True)),
        strict=True,
    )
    seen = np.concatenate(found)
    known = dict(zip(names[0], zip(seen.mean(axis=0), seen.var(axis=0), strict=True), strict=True))
    mean, variance = np.array([known.get(name, (0.0, 0.0)) for name in observation_names(envs[0], privileged)]).T
    return mean.copy(), np.maximum(variance, LEAST**2)


class PolicyGradient:
    """Learns in the lanes of ``envs``, ``settings.rollout`` policy steps at a time; the policy begins with actions of zero."""

    def __init__(self, settings: TrainingSettings, envs: Sequence[Any], folder: Path) -> None:
        self._settings, self._folder, self.steps = settings, folder, 0
        torch.manual_seed(settings.seed)
        env, counts = envs[0], [one.num_envs for one in envs]
        inputs, outputs = len(observation_names(env, settings.privileged)), env.single_action_space.shape[0]
        self._policy = Differentiated(inputs, outputs, settings.hidden, settings.memory, squashed=True)
        self._adam = torch.optim.Adam(self._policy.parameters(), lr=settings.learning_rate, betas=MOMENTS)
        seed = training_seeds(settings.seed, settings.lanes).start
        firsts = [seed + sum(counts[:k]) for k in range(len(counts))]
        self._mean, self._variance = _statistics(envs, firsts, settings.privileged)
        self._noise: np.random.Generator | None = None
        self._groups = [
            Lanes(settings, one, [first + lane for lane in range(count)])
            for one, first, count in zip(envs, firsts, counts, strict=True)
        ]

    def load(self, settings: dict[str, Any]) -> dict[str, Any] | None:
        """Go on from a checkpoint of these ``settings`` and return its past; None where there is none."""
        return read_checkpoint(self._folder, settings, lambda: self._content({}), self._restore, self._restore, FREE)

    def _restore(self, content: dict[str, Any]) -> dict[str, Any]:
        self._policy.load_state_dict(tensors(content["policy"]))
        self._adam.load_state_dict(tensors(content["adam"]))
        require_moments(self._adam)
        self.steps = content["steps"]
        if self.steps < 0:
            raise ValueError(f"steps = {self.steps}; allowed: >= 0")
        for group, state in zip(self._groups, content["groups"], strict=True):
            group.restore(state)
        past: dict[str, Any] = content["past"]
        return past

    def learn(self, watch: Watch, goes_on: bool) -> None:
        """Learn to the end."""
        watch.updated()
        while not watch.over:
            self._update()
            watch.updated()

    def stepping(self) -> tuple[Simulation, float, int]:
        """Of an environment: its simulation, the time in its policy steps, s, and their number."""
        groups = self._groups
        simulation: Simulation = groups[0].worlds.env.simulation
        return simulation, sum(group.seconds for group in groups), sum(group.steps for group in groups)

    def _update(self) -> None:
        """One rollout forward and back in every group of lanes."""
        settings = self._settings
        self._noise = np.random.default_rng((settings.seed, self.steps)) if settings.noise else None
        self._adam.zero_grad()
        for group in self._groups:
            (group.cost(self._act) / len(self._groups)).backward()  # type: ignore[no-untyped-call]
        weights = [weight.grad for weight in self._policy.parameters() if weight.grad is not None]
        size = torch.sqrt(sum((gradient * gradient).sum() for gradient in weights))  # type: ignore[arg-type]
        self.steps += settings.rollout * settings.lanes
        # A rollout in which something collides may have no finite gradient; it teaches nothing.
        if torch.isfinite(size) and size > 0:
            for gradient in weights:
                gradient /= size
            left = max(0.0, 1.0 - self.steps / settings.steps)
            self._adam.param_groups[0]["lr"] = settings.learning_rate * (LEAST_RATE + (1 - LEAST_RATE) * left)
            self._adam.step()
        self._begin_some()

    def _begin_some(self) -> None:
        """Begin some lanes anew: a policy that meets more rigs is lost on fewer."""
        simulation = self._groups[0].worlds.env.simulation
        share = self._settings.rollout * simulation.periods * simulation.period / MET
        chosen = np.random.default_rng((self._settings.seed, self.steps)).random(self._settings.lanes) < share
        for group, lanes in zip(self._groups, np.split(chosen, len(self._groups)), strict=True):
            group.begin(lanes)

    def _act(self, observation: Tensor, held: Tensor) -> tuple[Tensor, Tensor]:
        """Actions (N, size), with noise, for observations (N, D), which are normalised as by ``PolicyNetwork``, and what the
        memory holds then, (N, cells).

        A spool within its overlap lets nothing through, so that a policy that begins with zeros would have no gradient. The
        mean over noise has one everywhere (randomised smoothing).
        """
        mean, spread = torch.from_numpy(self._mean), torch.from_numpy(np.sqrt(self._variance + EPSILON))
        steps, held = self._policy(((observation - mean) / spread).clamp(-CLIP, CLIP).float()[None], held)
        actions: Tensor = steps[0]
        if self._noise is None:
            return actions, held
        drawn = self._noise.standard_normal(actions.shape, dtype=np.float32)
        deviation = self._settings.noise * max(0.0, 1.0 - self.steps / self._settings.steps)
        return (actions + deviation * torch.from_numpy(drawn)).clamp(-1.0, 1.0), held

    def network(self) -> PolicyNetwork:
        """The policy as plain arrays, a copy."""
        return self._policy.network(self._mean, self._variance)

    def save(self, settings: dict[str, Any], past: dict[str, Any]) -> None:
        """Write a checkpoint of these ``settings`` with this ``past``, between two updates."""
        write_checkpoint(self._folder, settings, self._content(past))

    def _content(self, past: dict[str, Any]) -> dict[str, Any]:
        return {
            "past": past, "policy": self._policy.state_dict(), "adam": self._adam.state_dict(), "steps": self.steps,
            "groups": [group.state() for group in self._groups],
        }  # fmt: skip
