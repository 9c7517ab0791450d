"""Analytic policy gradient: the reward of a short horizon is differentiated through the closed loop, and Adam climbs it.

As in SHAC (Xu et al., "Accelerated policy learning with parallel differentiable simulation", ICLR 2022), but without a critic:
the plant forgets an action within some 100 ms, and every step of the horizon is paid for (`docs/gradients.md`).
"""

from __future__ import annotations

import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
from torch import Tensor
from torch.utils.tensorboard import SummaryWriter
from tqdm import tqdm

from agents.gradients.rollouts import Worlds
from agents.policy.network import CLIP, EPSILON, PolicyNetwork
from agents.residual.settings import LAWS, NO_LAW, ResidualSettings
from agents.training.checkpoint import read_checkpoint, tensors, write_checkpoint
from agents.training.configuration import TrainingSettings
from agents.training.events import EVENTS
from agents.training.reached import Reached
from agents.training.time_split import split
from agents.training.validation import SEED_SPACING, TRAINING_SEED
from birthsim_env.observation import Observation
from birthsim_env.reward import LARGEST_COST

LEAST_RATE = 0.01
"""Fraction of the learning rate at the end, to which it falls linearly."""

OBSERVED, LEAST = 64, 0.4
"""Rigs whose observations, during an episode, say how to normalise; the least standard deviation of an entry, in its scale."""

STIFFNESS = 1.0
"""Cost of an error of 5000 N/m on cylinder 1, or 2500 on cylinder 2, in errors of a millimetre; assumed."""

MET = 5.0
"""s: mean time that a rig is met; assumed."""

MOMENTS = (0.9, 0.99)
"""Of Adam; an update is a gradient of length one, so that one bad horizon moves no more than another."""


def _cost(reward: Tensor, period: float) -> Tensor:
    """What a policy step of ``period`` s costs (N,), in errors of a millimetre and more rather than in their logarithm.

    The reward counts ln(1 + error), which leaves a rig alone on which the policy is far off: others gain more by less.
    """
    return torch.exp(LARGEST_COST * (1.0 - reward * (0.01 / period)))


def _statistics(settings: TrainingSettings, env: Any) -> tuple[Any, Any]:
    """Mean and variance (D,) of observations under the controller inside, the paper's where there is none.

    They stay as they are: running ones would remember what the first policies see, beside which a millimetre is nothing.
    """
    given = env.spec.kwargs
    law = {"law": LAWS[0], "impedance": ResidualSettings.impedance} if given["law"] == NO_LAW else {}
    driven: Any = gymnasium.make_vec(settings.environment, **{**given, **law, "num_envs": OBSERVED})
    seed = TRAINING_SEED + SEED_SPACING * settings.seed
    observation, _ = driven.reset(seed=[seed + lane for lane in range(OBSERVED)])
    zero, seen = np.zeros(driven.action_space.shape, dtype=np.float32), []
    for _ in range(driven.steps):
        seen.append(observation.copy())
        observation, *_ = driven.step(zero)
    found = np.concatenate(seen).astype(np.float64)
    known = dict(zip(driven.observation_names, zip(found.mean(axis=0), found.var(axis=0), strict=True), strict=True))
    driven.close()
    mean, variance = np.array([known.get(name, (0.0, 0.0)) for name in env.observation_names]).T
    return mean.copy(), np.maximum(variance, LEAST**2)


def _stiffness_cost(observation: Tensor) -> Tensor:
    """What errors of the pneumatic stiffness (9) cost (N,), which the reward leaves to a controller underneath."""
    has, asked = Observation.pneumatic_stiffness.first, Observation.pneumatic_setpoint.first
    error = observation[:, has : has + 2] - observation[:, asked : asked + 2]
    return STIFFNESS * error.abs().sum(dim=1)


class PolicyGradient:
    """Learns in the lanes of ``env``, ``settings.rollout`` policy steps at a time; the policy begins with actions of zero."""

    def __init__(self, settings: TrainingSettings, env: Any, folder: Path) -> None:
        self._settings, self._folder, self.steps = settings, folder, 0
        torch.manual_seed(settings.seed)
        self._worlds = Worlds(env)
        inputs, outputs = env.single_observation_space.shape[0], env.single_action_space.shape[0]
        widths = (inputs, *settings.hidden, outputs)
        layers = [torch.nn.Linear(width, wide) for width, wide in pairwise(widths)]
        torch.nn.init.zeros_(layers[-1].weight)
        torch.nn.init.zeros_(layers[-1].bias)
        self._policy = torch.nn.Sequential(*(part for layer in layers for part in (layer, torch.nn.Tanh())))
        self._adam = torch.optim.Adam(self._policy.parameters(), lr=settings.learning_rate, betas=MOMENTS)
        self._mean, self._variance = _statistics(settings, env)
        seed = TRAINING_SEED + SEED_SPACING * settings.seed
        self._now = self._worlds.reset(seed=[seed + lane for lane in range(settings.lanes)], options={"staggered": True})

    def load(self, settings: dict[str, Any]) -> dict[str, Any] | None:
        """Go on from a checkpoint of these ``settings`` and return its past; None where there is none."""
        return read_checkpoint(self._folder, settings, self._restore)

    def _restore(self, content: dict[str, Any]) -> dict[str, Any]:
        self._policy.load_state_dict(tensors(content["policy"]))
        self._adam.load_state_dict(tensors(content["adam"]))
        self.steps = int(content["steps"])
        self._worlds.env.set_state(content["lanes"])
        self._now = self._worlds.now(content["last"])
        past: dict[str, Any] = content["past"]
        return past

    def learn(self, reached: Reached, goes_on: bool, bar: tqdm[Any], began: float) -> None:
        """Learn to the end."""
        settings, validating, stepping = self._settings, 0.0, 0.0
        writer = SummaryWriter(str(self._folder / EVENTS / "run"), purge_step=self.steps if goes_on else None)
        before, skipped = reached.seconds, goes_on
        if not goes_on:
            validating = time.perf_counter() - began
        while True:
            # A checkpoint is written right after a validation, which need not be repeated.
            ends = self.steps >= settings.steps
            if not skipped and (reached.is_due(self.steps) or ends):
                started, network = time.perf_counter(), self.network()
                figures = reached.validate(network)
                validating += time.perf_counter() - started
                seconds = time.perf_counter() - began
                about = self._about(before + seconds, stepping, max(seconds - validating, 1e-9))
                best = reached.add(network, figures, about)
                for name, value in reached.events(figures).items():
                    writer.add_scalar(name, value, self.steps)
                bar.set_postfix_str(reached.words(figures))
                self._save(reached)
                if best:
                    reached.keep()
            if ends or reached.enough:
                break
            skipped = False
            stepping += self._update()
            bar.update(min(self.steps, settings.steps) - bar.n)
        writer.close()

    def _about(self, seconds: float, stepping: float, training: float) -> dict[str, Any]:
        stepped = self.steps // self._settings.lanes
        parts = split(self._worlds.env.simulation, stepping / stepped) if stepping else {}
        return {"steps": self.steps, "seconds": seconds, "environment_fraction": stepping / training, "split": parts}

    def _update(self) -> float:
        """One horizon forward and back; returns the time in the environment, s."""
        settings, stepping = self._settings, 0.0
        simulation = self._worlds.env.simulation
        period = simulation.periods * simulation.period
        now, loss = self._now.detached(), torch.zeros((), dtype=torch.float64)
        for k in range(settings.rollout):
            action = self._policy(self._normalized(now.observation))
            started = time.perf_counter()
            now = self._worlds.step(now, action)
            stepping += time.perf_counter() - started
            loss = loss + settings.discount**k * (_cost(now.reward, period) + _stiffness_cost(now.observation)).mean()
        self._now = now
        self._adam.zero_grad()
        loss.backward()  # type: ignore[no-untyped-call]
        weights = [weight.grad for weight in self._policy.parameters() if weight.grad is not None]
        size = torch.sqrt(sum((gradient * gradient).sum() for gradient in weights))  # type: ignore[arg-type]
        self.steps += settings.rollout * settings.lanes
        # A horizon in which something collides may have no finite gradient; it teaches nothing.
        if torch.isfinite(size) and size > 0:
            for gradient in weights:
                gradient /= size
            left = max(0.0, 1.0 - self.steps / settings.steps)
            self._adam.param_groups[0]["lr"] = settings.learning_rate * (LEAST_RATE + (1 - LEAST_RATE) * left)
            self._adam.step()
        self._begin_some()
        return stepping

    def _begin_some(self) -> None:
        """Begin some lanes anew: a policy that meets more rigs is lost on fewer."""
        env = self._worlds.env
        share = self._settings.rollout * env.simulation.periods * env.simulation.period / MET
        chosen = np.random.default_rng((self._settings.seed, self.steps)).random(self._settings.lanes) < share
        if chosen.any():
            self._now = self._worlds.now(env.reset(options={"reset_mask": chosen})[0])

    def _normalized(self, observation: Tensor) -> Tensor:
        """Observations (N, D) in standard deviations, as ``PolicyNetwork`` takes them."""
        mean, deviation = torch.from_numpy(self._mean), torch.from_numpy(np.sqrt(self._variance + EPSILON))
        return ((observation - mean) / deviation).clamp(-CLIP, CLIP).float()

    def network(self) -> PolicyNetwork:
        """The policy as plain arrays, a copy."""
        layers = tuple(
            (layer.weight.detach().numpy().copy(), layer.bias.detach().numpy().copy())
            for layer in self._policy
            if isinstance(layer, torch.nn.Linear)
        )
        return PolicyNetwork(self._mean, self._variance, layers, squashed=True)

    def _save(self, reached: Reached) -> None:
        content = {
            "past": reached.past(), "policy": self._policy.state_dict(), "adam": self._adam.state_dict(), "steps": self.steps,
            "lanes": self._worlds.env.get_state(), "last": self._now.observation.detach(),
        }  # fmt: skip
        write_checkpoint(self._folder, reached.describe(), content)
