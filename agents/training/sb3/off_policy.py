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
"""How many policy steps are remembered."""

CRITIC = [128, 128]
"""Units of the critics' layers; assumed."""

FOLLOWED = 0.02
"""Fraction by which target critics approach their critics at an update; assumed. It is four times that of Stable-Baselines3,
because there are few updates per step."""

RANDOM = 20
"""Steps of every lane under random actions before learning begins; assumed."""


class OffPolicy(ByStableBaselines):
    """After every step of all lanes come ``gradient_steps`` updates, each from ``batch`` past steps: an update for
    every lanes / gradient_steps policy steps.

    The coefficient of the entropy is 1 at the beginning, as in Stable-Baselines3, so that a policy stays near the controller
    until its critics have learned. In a trial with a coefficient of 0.1, the error became 1.6 times that of the controller
    within 1,250 updates, and with 0.01 it became 4 to 9 times that.
    """

    hyperparameters = MappingProxyType({"lanes": 64, "batch": 256, "gradient_steps": 8})
    """An update for every 8 steps was found by trial: on a short stiffness test 3,000 updates reduced the controller's error by
    a fifth, whereas 470 updates, one for every 32 of 15,000 steps, did not reduce it. The batch is Stable-Baselines3's."""

    def between(self, settings: TrainingSettings) -> int:
        return settings.lanes

    def remembering(self, settings: TrainingSettings) -> dict[str, Any]:
        """Arguments that SAC and TQC have in common."""
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
        """Begin with the spread of ``log_std`` everywhere; later it depends on the observation."""
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
