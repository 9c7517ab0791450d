"""Backstepping that renders any symmetric positive definite stiffness matrix, where (18) keeps only the diagonal of J^T K J."""

from pathlib import Path
from typing import ClassVar

import numpy as np

from baselines.backstepping import cartesian_law
from baselines.backstepping.controller import PNEUMATIC_GAIN, SIGN_WIDTH
from baselines.backstepping.impedance import cartesian_impedance
from baselines.backstepping.stiffest import require_softer, stiffness_range
from baselines.controller import require_stiffness
from baselines.estimation.stages import pistons
from baselines.impedance import Impedance
from baselines.staged import ControllerStage, StagedController
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import is_within, limits, shown
from birthsim_env.registry import register


@register(
    controller="backstepping-cartesian",
    about="The paper's law in Cartesian coordinates: stiffness along x and y may be coupled.",
    order=15,
)
class CartesianBackstepping(StagedController):
    """The law of ``cartesian_law``: weight compensated, force before pneumatic stiffness, no force sensor.

    Arguments as in ``BacksteppingController``. Raises ``ValueError`` for those that are not positive.
    """

    COMMAND_OPTIONS: ClassVar[tuple[str, ...]] = ()
    reads_force = False

    def __init__(
        self,
        parameters: Parameters | str | Path | None = None,
        pneumatic_gain: float = PNEUMATIC_GAIN,
        sign_width: float = SIGN_WIDTH,
    ) -> None:
        for name, value in (("pneumatic_gain", pneumatic_gain), ("sign_width", sign_width)):
            if not is_within(value, least=1e-6, most=1e6):
                raise ValueError(f"{name} = {shown(value)}; allowed: a positive number{limits(least=1e-6, most=1e6)}")
        super().__init__(parameters)
        rig = self.parameters
        # With 3 C <= D/m the loop of ``cartesian_law`` has no positive stiffness of its own.
        least_gain = max(rig.cylinder1.viscous_friction, rig.cylinder2.viscous_friction) / (3 * rig.mechanics.mass)
        self._least_stiffness = rig.mechanics.mass * (least_gain**2 + 2) / 3
        self._constants = cartesian_law.Constants.numbers(
            pneumatic_gain=pneumatic_gain, sign_width=sign_width, least_stiffness=self._least_stiffness, rig=self._p
        )

    def declared_impedance(self, reference: Reference) -> Impedance:
        """What the gain matrices render to slow pushes at the reference pose, over N lanes."""
        require_stiffness(reference, self._least_stiffness)
        return cartesian_impedance(reference, self.parameters)

    def controller_stages(self, sampled: bool) -> list[ControllerStage]:
        law = ControllerStage(cartesian_law.control, self._constants, np.zeros(0))
        return [stiffness_range(self.parameters, sampled), pistons(self.parameters, sampled, informed=False), law]

    def explain(self, measurement: Measurement, reference: Reference) -> None:
        """Raise the error of the first lane whose stiffness is too large, or, a few 10 N/m, too soft for positive gains."""
        require_softer(reference, self.parameters, measurement.sampled)
        require_stiffness(reference, self._least_stiffness)
