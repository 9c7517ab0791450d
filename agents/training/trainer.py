"""Trains one residual policy: builds worlds and model, learns, keeps the best, and goes on where a killed training stopped."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium
import torch
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.vec_env import VecNormalize

from agents.policy.files import WEIGHTS
from agents.residual.settings import LAWS, ResidualSettings
from agents.training.algorithms import make_model, unchecked_distributions
from agents.training.checkpoint import NAME as CHECKPOINT
from agents.training.checkpoint import load_checkpoint
from agents.training.configuration import TrainingSettings
from agents.training.events import EVENTS, events_in
from agents.training.monitor import Monitor, described
from agents.training.privileged import Privileged
from agents.training.sb3_adapter import SB3VecEnv
from agents.training.shifted_reward import ShiftedReward
from agents.training.validation import SEED_SPACING, TRAINING_SEED

__all__ = ["train"]


def train(
    settings: TrainingSettings, residual: ResidualSettings, folder: Path, parameters: Any = None, position: int = 0
) -> dict[str, Any]:
    """Train one residual policy and write it to ``folder``; returns what was reached.

    The policy that is best on the validation worlds is kept (pooled error and its 95 % tail together). It is written whenever
    it improves. A checkpoint is written at every validation, ``settings.validations`` times. Where ``folder`` has one the
    training goes on from there, and ends with the same policy as one that was never killed. ``position`` is the row of its
    progress bar.

    Raises ``ValueError`` for a checkpoint that is damaged or of other settings, for a folder with a policy and without its
    checkpoint, and where no validation world is within the rig's strength.
    """
    if not (folder / CHECKPOINT).exists():
        for name in (WEIGHTS, "training.json"):
            if (folder / name).exists():
                raise ValueError(f"{str(folder)!r} has {name} but not its {CHECKPOINT}; allowed: another folder")
    torch.set_num_threads(1)
    arguments = {
        "sensors": settings.sensors, "randomize": settings.randomize, "parameters": parameters, **residual.to_dict(),
        "autoreset_mode": AutoresetMode.SAME_STEP,
    }  # fmt: skip
    env = SB3VecEnv(gymnasium.make_vec(settings.environment, num_envs=settings.lanes, **arguments), staggered=True)
    checks = gymnasium.make_vec(settings.environment, num_envs=settings.validation_lanes, **arguments)
    paper = None
    if settings.until < 100:
        law = {**arguments, **ResidualSettings(law=LAWS[0], policy_period=residual.policy_period).to_dict()}
        paper = gymnasium.make_vec(settings.environment, num_envs=settings.validation_lanes, **law)
    seen = Privileged(env) if settings.privileged else env
    # Survival is paid one per 10 ms; without a discount below one there is no value to shift.
    paid = ShiftedReward(seen, residual.policy_period / 0.01, settings.discount) if settings.discount < 1 else seen
    normalized = VecNormalize(paid, gamma=settings.discount)
    model = make_model(settings, normalized, str(folder / EVENTS))
    normalized.seed(TRAINING_SEED + SEED_SPACING * settings.seed)
    past = load_checkpoint(folder, model, normalized, described(settings, residual, env.env.simulation.parameters))
    done = model.num_timesteps
    if past is not None:
        print(f"seed {settings.seed}: {min(done, settings.steps):,} of {settings.steps:,} steps are there and are kept")
    callback = Monitor(settings, residual, checks, folder, past, env, position, paper)
    try:
        if done < settings.steps and not callback.enough:
            with events_in(folder / EVENTS), unchecked_distributions():
                model.learn(settings.steps - done, callback=callback, reset_num_timesteps=past is None, tb_log_name="run")
    except KeyboardInterrupt:
        if (folder / CHECKPOINT).exists():
            callback.keep()
            print(f"interrupted after {model.num_timesteps} steps: policy and checkpoint are kept in {folder}/")
        raise
    finally:
        callback.close()
        for worlds in (env, checks, paper):
            if worlds is not None:
                worlds.close()
    return callback.reached()
