"""The law with a residual: a policy tells it about forces on the pistons that it does not know of.

An action in [-1, 1] per cylinder, times the authority in N, passes a first-order low-pass at the policy rate and is added to
what the law believes acts on the piston. Zero actions are exactly the law.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from baselines.backstepping import BacksteppingController
from birthsim_env.lanes import Array
from birthsim_env.parameters import Parameters
from birthsim_env.plant import Plant
from birthsim_env.signals import Mask, Measurement, Reference


@dataclass(frozen=True)
class ResidualSettings:
    """What a residual may do.

    ``authority`` (N) bounds the believed force: 100 N, since the weight of 2 kg more than believed is 40 to 57 N along
    cylinder 1 and friction comes on top; ``smoothing`` in (0, 1] is the share of a new action that the low-pass lets
    through per policy step (0.3 per 10 ms is a lag of about 28 ms: without it single lanes oscillate); ``policy_period`` (s);
    ``weight_compensation`` of the law underneath. Raises ``ValueError`` for values outside these limits.
    """

    authority: float = 100.0
    smoothing: float = 0.3
    policy_period: float = 0.01
    weight_compensation: bool = False

    def __post_init__(self) -> None:
        for name, low, high in (("authority", 0.0, 500.0), ("smoothing", 0.0, 1.0), ("policy_period", 0.0, 1.0)):
            value = getattr(self, name)
            if not (isinstance(value, (int, float)) and low < value <= high):
                raise ValueError(f"{name} = {value!r}; allowed: more than {low:g}, at most {high:g}")

    def to_dict(self) -> dict[str, Any]:
        """As JSON takes it."""
        return asdict(self)


class ResidualLaw:
    """Backstepping with a residual over N lanes; ``size`` lanes are made room for at the first ``accept``."""

    def __init__(self, parameters: Parameters, settings: ResidualSettings) -> None:
        self.settings = settings
        self._law = BacksteppingController(parameters, weight_compensation=settings.weight_compensation)
        self._believed: Array = np.zeros((2, 0))

    def reset(self, lanes: Mask | None = None) -> None:
        """Forget the past of all lanes, or of those where ``lanes`` (N,) is True."""
        self._law.reset(lanes)
        if lanes is None:
            self._believed = np.zeros((2, 0))
        elif self._believed.shape[1]:
            self._believed[:, lanes] = 0.0

    def accept(self, actions: Array) -> None:
        """Take the actions (2, N) of a policy step."""
        if self._believed.shape[1] != actions.shape[1]:
            self._believed = np.zeros(actions.shape)
        self._believed += self.settings.smoothing * (self.settings.authority * actions - self._believed)

    def command(self, measurement: Measurement, reference: Reference) -> Array:
        """Spool openings (4, N) of one control period."""
        return self._law.command(measurement, reference, self._believed)


class ResidualActuation:
    """``ResidualLaw`` as an actuation of the environments: the law runs inside, at the control rate."""

    size = 2
    names = ("believed force on cylinder 1, unit of the authority", "believed force on cylinder 2, unit of the authority")
    every_period = True

    def __init__(self, parameters: Parameters, settings: ResidualSettings) -> None:
        self._law = ResidualLaw(parameters, settings)

    def begin(self, lanes: Mask) -> None:
        self._law.reset(lanes)

    def accept(self, actions: Array) -> None:
        self._law.accept(actions)

    def openings(self, plant: Plant, measurement: Measurement, reference: Reference) -> Array:
        return self._law.command(measurement, reference)
