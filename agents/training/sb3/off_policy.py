"""Algorithms that remember past steps and learn from those drawn at random: SAC and TQC."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from agents.training.sb3.algorithm import ByStableBaselines

if TYPE_CHECKING:
    from agents.training.configuration import TrainingSettings
    from agents.training.sb3.networks import Parts

REMEMBERED = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")
"""Arrays in which past steps are remembered."""

BUFFER = 300_000
"""Policy steps that are remembered."""

CRITIC = [128, 128]
"""Units of the critics' layers; assumed."""

FOLLOWED = 0.02
"""How far target critics follow their critics at an update; assumed. It is four times what Stable-Baselines3 has, because there
are few updates to a step."""

RANDOM = 20
"""Steps of all lanes under random actions, before anything is learned; assumed."""


class OffPolicy(ByStableBaselines):
    """After every step of all lanes ``gradient_steps`` updates, each from ``batch`` past steps: lanes/gradient_steps policy
    steps to an update.

    Entropy is worth 1 at the beginning, as in Stable-Baselines3, so that a policy stays near the controller until its critics
    have learned. Within 1,250 updates of a trial it became 1.6 times as bad as the controller with 0.1, and 4 to 9 times with
    0.01.
    """

    hyperparameters = MappingProxyType({"lanes": 64, "batch": 256, "gradient_steps": 8})
    """Found by trial: an update to 8 steps. On a short stiffness test 3,000 took a fifth off the controller's error, and
    470, in 15,000 steps with an update to 32, nothing. The batch is Stable-Baselines3's."""

    def between(self, settings: TrainingSettings) -> int:
        return settings.lanes

    def remembering(self, settings: TrainingSettings) -> dict[str, Any]:
        """Arguments that they have in common."""
        from agents.training.sb3.networks import activation

        return {
            "train_freq": 1,
            "gradient_steps": settings.gradient_steps,
            "buffer_size": BUFFER,
            "learning_starts": RANDOM * settings.lanes,
            "tau": FOLLOWED,
            "policy_kwargs": {**activation(settings), "net_arch": {"pi": list(settings.hidden), "qf": CRITIC}},
        }

    def parts(self, policy: Any) -> Parts:
        from agents.training.sb3.networks import Parts

        return Parts(policy.actor.latent_pi, policy.actor.mu, squashed=True)

    def begin(self, policy: Any, settings: TrainingSettings) -> None:
        """With the spread of ``log_std`` everywhere, which the observation shifts later."""
        from agents.training.sb3.networks import begin_at

        super().begin(policy, settings)
        begin_at(policy.actor.log_std, settings.log_std)

    def carried(self, model: Any) -> dict[str, Any]:
        """The steps that are remembered; the next one is written at ``pos``."""
        buffer = model.replay_buffer
        arrays = {name: getattr(buffer, name)[: buffer.size()] for name in REMEMBERED}
        return {"pos": int(buffer.pos), "full": bool(buffer.full), **arrays}

    def carry(self, model: Any, carried: Any) -> None:
        from agents.training.checkpoint import require_array
        from birthsim_env.physics.rig.values import shown

        if carried is None:
            raise ValueError("memory: there for algorithms that remember past steps, and for no others")
        buffer, pos, full = model.replay_buffer, carried["pos"], carried["full"]
        if type(pos) is not int or type(full) is not bool or not 0 <= pos < buffer.buffer_size:
            raise ValueError(f"memory: pos is {shown(pos)}, full is {shown(full)}; allowed: a position of {buffer.buffer_size}")
        for name in REMEMBERED:
            own = getattr(buffer, name)
            require_array(f"memory/{name}", carried[name], (buffer.buffer_size if full else pos, *own.shape[1:]))
            own[: len(carried[name])] = carried[name]
        buffer.pos, buffer.full = pos, full
