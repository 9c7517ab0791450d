"""PPO of Stable-Baselines3 on the residual environments."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecNormalize
from tqdm import tqdm

import agents
from agents.policy_files import Policy, save_policy
from agents.policy_network import PolicyNetwork
from agents.residual_law import ResidualSettings
from agents.sb3_adapter import SB3VecEnv
from agents.validation import SEED_SPACING, TRAINING_SEED, Score, validate

__all__ = ["TrainingSettings", "train"]
assert agents  # importing it registers the residual environments


@dataclass(frozen=True)
class TrainingSettings:
    """PPO's settings and the experiment around it; the learning rate falls linearly to a tenth."""

    environment: str = "BirthSIM/CircleResidual-v0"
    steps: int = 3_000_000
    seed: int = 0
    sensors: str = "ideal"
    randomize: bool | str = True
    lanes: int = 128
    rollout: int = 64
    batch: int = 2048
    epochs: int = 6
    learning_rate: float = 1e-3
    discount: float = 0.98
    gae_lambda: float = 0.95
    log_std: float = -1.5
    hidden: tuple[int, int] = (64, 64)
    validation_lanes: int = 64
    validations: int = 12


def train(settings: TrainingSettings, residual: ResidualSettings, folder: Path, parameters: Any = None) -> dict[str, Any]:
    """Train one residual policy and write it to ``folder``; returns what was reached.

    The policy that is best on the validation worlds (pooled error and its 95 % tail together) is the one that is kept,
    written whenever it improves, so that an interrupt (Ctrl-C) loses nothing but the unfinished part.
    """
    torch.set_num_threads(1)
    arguments = {
        "sensors": settings.sensors,
        "randomize": settings.randomize,
        "parameters": parameters,
        "authority": residual.authority,
        "smoothing": residual.smoothing,
        "weight_compensation": residual.weight_compensation,
        "policy_period": residual.policy_period,
    }
    env = SB3VecEnv(gymnasium.make_vec(settings.environment, num_envs=settings.lanes, **arguments))
    checks = gymnasium.make_vec(settings.environment, num_envs=settings.validation_lanes, **arguments)
    normalized = VecNormalize(env, gamma=settings.discount)
    model = PPO(
        "MlpPolicy",
        normalized,
        seed=settings.seed,
        n_steps=settings.rollout,
        batch_size=settings.batch,
        n_epochs=settings.epochs,
        learning_rate=lambda remaining: settings.learning_rate * (0.1 + 0.9 * remaining),
        gamma=settings.discount,
        gae_lambda=settings.gae_lambda,
        policy_kwargs={
            "net_arch": {"pi": list(settings.hidden), "vf": list(settings.hidden)},
            "activation_fn": torch.nn.Tanh,
            "log_std_init": settings.log_std,
        },
        device="cpu",
    )
    normalized.seed(TRAINING_SEED + SEED_SPACING * settings.seed)
    # The mean action starts at zero: the return at step 0 is the law's.
    torch.nn.init.zeros_(_output_layer(model).weight)
    torch.nn.init.zeros_(_output_layer(model).bias)
    callback = _KeepBest(settings, residual, checks, folder)
    try:
        model.learn(settings.steps, callback=callback)
    except KeyboardInterrupt:
        print(f"interrupted after {model.num_timesteps} steps: the best policy so far is kept in {folder}/")
    finally:
        callback.close()
        env.close()
        checks.close()
    return callback.reached()


def _output_layer(model: PPO) -> torch.nn.Linear:
    layer = model.policy.action_net
    assert isinstance(layer, torch.nn.Linear)
    return layer


def network_of(model: PPO, normalized: VecNormalize) -> PolicyNetwork:
    """The deterministic part of a PPO policy with its normalisation, as plain arrays."""

    def array(tensor: torch.Tensor) -> NDArray[np.float32]:
        # A copy: the model goes on training in its own memory.
        return np.array(tensor.detach().cpu().numpy(), dtype=np.float32, order="C")

    hidden: Any = model.policy.mlp_extractor
    linear = [layer for layer in hidden.policy_net if isinstance(layer, torch.nn.Linear)]
    layers = tuple((array(layer.weight), array(layer.bias)) for layer in [*linear, _output_layer(model)])
    statistics: Any = normalized.obs_rms
    return PolicyNetwork(statistics.mean.copy(), statistics.var.copy(), layers)


class _KeepBest(BaseCallback):
    """Validates at equal intervals, keeps the best policy on disk and shows progress with the improvement on the law."""

    def __init__(self, settings: TrainingSettings, residual: ResidualSettings, env: Any, folder: Path) -> None:
        super().__init__()
        self._settings, self._residual, self._env, self._folder = settings, residual, env, folder
        self._every = settings.steps / settings.validations
        self._started = time.perf_counter()
        self._bar = tqdm(total=settings.steps, desc="training", unit=" steps", unit_scale=True)
        self._curve: list[dict[str, float]] = []
        self._best = np.inf
        self._due = 0.0
        zero = np.zeros((env.num_envs, 2), dtype=np.float32)
        self._law = validate(env, lambda _: zero)

    def _on_rollout_start(self) -> None:
        # After an update and not inside a rollout: every validated policy is one that PPO has finished with.
        if self.num_timesteps >= self._due:
            self._due = min(self._due + self._every, float(self._settings.steps))
            self._check()

    def _on_rollout_end(self) -> None:
        self._bar.update(self.num_timesteps - self._bar.n)

    def _on_step(self) -> bool:
        return True

    def _on_training_end(self) -> None:
        self._check()

    def _check(self) -> None:
        network = network_of(self.model, self.training_env)  # type: ignore[arg-type]
        score = validate(self._env, network.actions)
        seconds = time.perf_counter() - self._started
        self._curve.append(
            {
                "steps": self.num_timesteps,
                "seconds": seconds,
                "pooled_mm": score.pooled,
                "tail_mm": score.tail,
                "lost": score.lost,
            }
        )
        better = 100 * (1 - score.pooled / self._law.pooled)
        self._bar.set_postfix_str(f"error {score.pooled:.2f} mm, law {self._law.pooled:.2f} mm, {better:+.0f} % better")
        if score.pooled + score.tail < self._best:
            self._best = score.pooled + score.tail
            self._kept = score
            training = {**asdict(self._settings), "law_mm": self._law.pooled, "curve": self._curve}
            save_policy(Policy(network, self._settings.environment, self._residual, training), self._folder)

    def close(self) -> None:
        """Finish the progress bar."""
        self._bar.close()

    def reached(self) -> dict[str, Any]:
        """Validation figures of the law and of the kept policy, and the learning curve."""

        def figures(score: Score) -> dict[str, float]:
            return {"pooled_mm": score.pooled, "tail_mm": score.tail, "lost": score.lost}

        return {"law": figures(self._law), "policy": figures(self._kept), "curve": self._curve}
