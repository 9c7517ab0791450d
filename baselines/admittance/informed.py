"""What the admittance law knows, over N lanes, for a planner that commands by itself."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from baselines.admittance import knowledge
from baselines.admittance.rows import Beliefs, Known, Memory
from baselines.admittance.stage import inform
from baselines.controller import require_stiffness
from baselines.estimation import admittance, reference_friction, stages
from baselines.estimation.admittance import Compliance
from baselines.staged import LawStage, StagedController
from birthsim_env.loop.rows import HANDED
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array, Rig
from birthsim_env.physics.rig.parameters import Parameters


class Informed(StagedController):
    """After ``update`` with the signals of a control period, ``known`` and ``memory`` are what the law then knows.

    The planner writes its openings to ``memory.chambers.opening``. Arguments: the rig as believed, and for ``ideal`` and
    ``lab`` sensors the gains that ``knowledge.beliefs`` asks for.
    """

    def __init__(self, parameters: Parameters, gains: Mapping[str, Mapping[str, float]]) -> None:
        super().__init__(parameters)
        self._gains = gains

    def law_stages(self, sampled: bool) -> list[LawStage]:
        rig, gains = self.parameters, self._gains["lab" if sampled else "ideal"]
        self._fraction = gains["friction_fraction"]
        about = Beliefs.numbers(**knowledge.beliefs(rig, sampled, sampled, gains))
        return [LawStage(inform, about, knowledge.fresh_memory(rig, sampled))]

    def more_rows(self, lanes: int) -> list[tuple[Array, int]]:
        self.known = Known(np.zeros((Known.size, lanes)))
        return [(self.known.rows, HANDED)]

    def explain(self, measurement: Measurement, reference: Reference) -> None:
        require_stiffness(reference, 0.0)

    def update(self, measurement: Measurement, reference: Reference) -> None:
        """Take one control period's signals over N lanes. Raises ``ValueError`` as ``command`` does."""
        if self.run_stages(measurement, reference):
            self.explain(measurement, reference)

    @property
    def memory(self) -> Memory:
        """What the stage remembers."""
        return Memory(self._memories[0])

    def forecast(self, reference: Reference, ticks: NDArray[np.int64]) -> tuple[Array, Array]:
        """The motion's x, y (m), vx, vy (m/s), (M, 4, N), and the forces unseen along it, N, (M, 2, N), ``ticks`` (M,) periods
        after the last ``update``: friction follows the motion, what was observed besides stays."""
        known, memory, about = self.known, self.memory, Compliance(stages.compliance(self.parameters))
        lanes, steps = known.drag.shape[1], self.parameters.electronics.control_period * np.diff(ticks, prepend=0)
        ahead, drag = np.empty((len(ticks), 4, lanes)), np.empty((len(ticks), 2, lanes))
        admittance.forecast(memory.offset, reference, known.given.force, about, ticks, ahead)
        reference_friction.forecast(ahead, Rig(self._p), steps, memory.bristle, drag)
        return ahead, known.unseen - known.given.believed - self._fraction * drag
