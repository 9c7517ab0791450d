"""What Stable-Baselines3 logs, in the events of a training."""

from __future__ import annotations

from stable_baselines3.common.logger import TensorBoardOutputFormat
from torch.utils.tensorboard import SummaryWriter


class Logged(TensorBoardOutputFormat):
    """Writes with the ``writer`` of a training's events, in whose files validations are too."""

    def __init__(self, writer: SummaryWriter) -> None:
        self.writer, self._is_closed = writer, False
