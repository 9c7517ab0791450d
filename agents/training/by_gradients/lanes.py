"""Worlds in which a policy learns by gradients, and what a policy step in them costs."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import torch
from torch import Tensor

from agents.gradients.rollouts import Now, Worlds
from agents.residual.privileged import TRUE_NAMES, true_parameters, with_true_parameters
from agents.residual.settings import LAWS, NO_LAW, ResidualSettings
from agents.training.configuration import TARGETS, TrainingSettings
from agents.training.declared import Declared
from birthsim_env.observation import SIZE, Observation
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.reward import ACTION_CHANGE_COST, EFFORT_COST, ERROR_UNIT, LARGEST_COST, SPEED_UNIT

STIFFNESS = 1.0
"""Cost of an error of 5000 N/m on cylinder 1, or 2500 on cylinder 2, in errors of a millimetre; assumed."""

SPEED = 0.02
"""Cost of a speed of ``SPEED_UNIT`` from the declared motion's, in errors of a millimetre. With ten times as much, as in the
reward, a policy on ``admittance`` gave up accuracy for calm."""

ROUND = 0.1
"""Errors far below this fraction of their unit cost their square: where noise is all that is left there is no kink; assumed."""

Policy = Callable[[Tensor, Tensor], tuple[Tensor, Tensor]]
"""Observations (N, D) and what a memory has held (N, H) -> actions (N, size) and what it holds then."""


class Lanes:
    """Lanes of ``env`` whose episodes are ``seeded``, (N,), what the policy saw of them last, ``now``, and what its memory
    holds of each, ``held`` (N, H)."""

    def __init__(self, settings: TrainingSettings, env: Any, seeded: list[int]) -> None:
        self._settings, self.worlds, self.seconds, self.steps = settings, Worlds(env), 0.0, 0
        self.now = self.worlds.reset(seed=seeded, options={"staggered": True})
        self.held = torch.zeros(len(seeded), settings.memory)
        self._declared = Declared(self.worlds.env.simulation)

    def cost(self, policy: Policy) -> Tensor:
        """What the steps of a rollout cost, summed, in means over the lanes.

        Gradients begin anew at its beginning, and those through the plant at that of each horizon.
        """
        settings, worlds, now, loss = self._settings, self.worlds, self.now, torch.zeros((), dtype=torch.float64)
        held, horizon = self.held, settings.horizon or settings.rollout
        for k in range(settings.rollout):
            if k % horizon == 0:
                now = now.detached()
            (action, held), before = policy(self._seen(now), held), now
            started = time.perf_counter()
            now = worlds.step(now, action)
            self.seconds += time.perf_counter() - started
            self.steps += 1
            one = self._paid(now) if settings.target == TARGETS[0] else self._apart(before, action, now)
            one = one + _stiffness_cost(now.observation)
            if settings.most_cost:
                one = one * settings.most_cost / (one + settings.most_cost)
            loss = loss + settings.discount ** (k % horizon) * one.mean()
            held = _without(now.ended, held)
        self.now, self.held = now, held.detach()
        return loss

    def _seen(self, now: Now) -> Tensor:
        """What a policy observes (N, D), without gradients to what it is told."""
        if not self._settings.privileged:
            return now.observation
        return torch.cat([now.observation, torch.from_numpy(true_parameters(self.worlds.env))], dim=1)

    def _paid(self, now: Now) -> Tensor:
        """What a policy step costs (N,), in errors of a millimetre and more rather than in their logarithm.

        The reward counts ln(1 + error), which leaves a rig alone on which the policy is far off: others gain more by less.
        """
        simulation = self.worlds.env.simulation
        return torch.exp(LARGEST_COST * (1.0 - now.reward * (0.01 / (simulation.periods * simulation.period))))

    def _apart(self, before: Now, action: Tensor, now: Now) -> Tensor:
        """The same (N,) of the distance from the declared motion, of the speed relative to it, and of the action."""
        apart = now.motion - torch.from_numpy(self._declared.follow())
        self._declared.begin(now.ended.numpy())
        error, speed = _size(apart[:2] / ERROR_UNIT), _size(apart[2:] / SPEED_UNIT)
        change = (action - before.observation[:, SIZE : SIZE + action.shape[1]]).abs().mean(dim=1)
        return error + SPEED * speed + EFFORT_COST * (action * action).mean(dim=1) + ACTION_CHANGE_COST * change

    def begin(self, lanes: Any) -> None:
        """Begin new episodes in the lanes of a mask (N,)."""
        if lanes.any():
            self.now = self.worlds.now(self.worlds.env.reset(options={"reset_mask": lanes})[0])
            self._declared.begin(lanes)
            self.held = _without(torch.from_numpy(lanes), self.held)

    def state(self) -> dict[str, Any]:
        """All that their future depends on."""
        offset = self._declared.motion.offset
        last = self.now.observation.detach()
        return {"lanes": self.worlds.env.get_state(), "last": last, "held": self.held, "declared": offset}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from a ``state``."""
        self.worlds.env.set_state(state["lanes"])
        self.now = self.worlds.now(state["last"])
        self.held = torch.from_numpy(state["held"])
        self._declared = Declared(self.worlds.env.simulation)
        self._declared.motion.offset = np.array(state["declared"])


def _without(lanes: Tensor, held: Tensor) -> Tensor:
    """What is ``held`` (N, H), zero in the lanes of a mask (N,), in which episodes begin."""
    return held * ~lanes[:, None]


def _stiffness_cost(observation: Tensor) -> Tensor:
    """What errors of the pneumatic stiffness (9) cost (N,), which the reward leaves to a controller underneath."""
    has, asked = Observation.pneumatic_stiffness.first, Observation.pneumatic_setpoint.first
    error = observation[:, has : has + 2] - observation[:, asked : asked + 2]
    return STIFFNESS * error.abs().sum(dim=1)


def _size(vector: Tensor) -> Tensor:
    return torch.sqrt((vector * vector).sum(dim=0) + ROUND * ROUND)


def observations(env: Any, seed: int, lanes: int, privileged: bool = False) -> tuple[list[str], Array]:
    """Names (D,) and observations (T N, D) of an episode in ``lanes`` lanes under the controller inside ``env``, of a
    ``privileged`` policy with the true parameters.

    Where there is none the paper's drives, or ``admittance`` where a policy is informed of what that one knows.
    """
    given = env.spec.kwargs
    law = {"law": "admittance" if given["informed"] else LAWS[0], "impedance": ResidualSettings.impedance}
    driven: Any = gymnasium.make_vec(env.spec.id, **{**given, **(law if given["law"] == NO_LAW else {}), "num_envs": lanes})
    observation, _ = driven.reset(seed=[seed + lane for lane in range(lanes)])
    zero, seen = np.zeros(driven.action_space.shape, dtype=np.float32), []
    for _ in range(driven.steps):
        seen.append(with_true_parameters(driven, observation) if privileged else observation.copy())
        observation, *_ = driven.step(zero)
    driven.close()
    return observation_names(driven, privileged), np.concatenate(seen).astype(np.float64)


def observation_names(env: Any, privileged: bool) -> list[str]:
    """What each number says that a policy observes in ``env``."""
    return [*env.observation_names, *(TRUE_NAMES if privileged else ())]
