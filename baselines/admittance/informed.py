"""What the admittance law knows, over N lanes, for a planner that commands by itself."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from baselines.admittance import knowledge as at
from baselines.admittance.stage import inform
from baselines.controller import require_stiffness
from baselines.estimation import admittance, reference_friction
from baselines.staged import LawStage, StagedController
from birthsim_env.loop.rows import HANDED
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters


class Informed(StagedController):
    """``update`` takes the signals of a control period; ``known`` (KNOWN, N) and ``memory`` are then those of ``knowledge``.

    The planner writes its openings to ``memory[OPENED:JOINTS]``. Arguments: the rig as believed, and for ``ideal`` and ``lab``
    sensors the gains that ``knowledge.constants`` asks for.
    """

    def __init__(self, parameters: Parameters, gains: Mapping[str, Mapping[str, float]]) -> None:
        super().__init__(parameters)
        self._gains = gains

    def law_stages(self, sampled: bool) -> list[LawStage]:
        rig, gains = self.parameters, self._gains["lab" if sampled else "ideal"]
        self._fraction = gains["friction_fraction"]
        fresh = np.concatenate([at.fresh_memory(), at.pistons_memory(rig, sampled)])
        return [LawStage(inform, np.array([*at.constants(rig, sampled, sampled, gains), *self._p]), fresh)]

    def more_rows(self, lanes: int) -> list[tuple[Array, int]]:
        self.known: Array = np.zeros((at.KNOWN, lanes))
        return [(self.known, HANDED)]

    def explain(self, measurement: Measurement, reference: Reference) -> None:
        """Raise the error of the first lane whose stiffness is not positive definite."""
        require_stiffness(reference, 0.0)

    def update(self, measurement: Measurement, reference: Reference) -> None:
        """Take one control period's signals over N lanes. Raises ``ValueError`` as ``command`` does."""
        if self.run_stages(measurement, reference, (None, None, None)):
            self.explain(measurement, reference)

    @property
    def memory(self) -> Array:
        """What the stage remembers, (M, N)."""
        return self._memories[0]

    def forecast(self, reference: Reference, ticks: NDArray[np.int64]) -> tuple[Array, Array]:
        """The motion's x, y (m), vx, vy (m/s), (M, 4, N), and the forces unseen along it, N, (M, 2, N), ``ticks`` (M,) periods
        after the last ``update``: friction follows the motion, what was observed besides stays."""
        known, memory, mechanics = self.known, self.memory, self.parameters.mechanics
        period, count = self.parameters.electronics.control_period, known.shape[1]
        ahead, drag = np.empty((len(ticks), 4, count)), np.empty((len(ticks), 2, count))
        admittance.forecast(
            memory[at.OFFSET : at.FRESH], reference.rows, known[at.FORCE : at.BELIEVED], mechanics.mass,
            admittance.DAMPING_RATIO, period, ticks, ahead,
        )  # fmt: skip
        steps = period * np.diff(ticks, prepend=0)
        reference_friction.forecast(ahead, self._p, steps, memory[at.BRISTLES : at.SPOOLS], drag)
        return ahead, known[at.UNSEEN : at.DRAG] - known[at.BELIEVED : at.UNSEEN] - self._fraction * drag
