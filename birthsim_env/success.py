"""What counts as success: an episode that goes on to its end and stays within a millimetre of the compliant target."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from birthsim_env.parts.signals import Mask, compliance
from birthsim_env.physics.compilation import kernel
from birthsim_env.physics.lanes import Array

SETTLED = 0.5
"""s after a jump of force or setpoint (or the start) from which an error counts as settled."""

SUCCESS_ERROR = 1e-3
"""m, root mean square distance from the compliant target; assumed: a quarter of the paper's law's."""


@kernel
def _add(
    motion: Array, reference: Array, force: Array, since: Array, failed: NDArray[np.bool_], tally: Array,
    success: NDArray[np.bool_],
) -> None:  # fmt: skip
    for i in range(since.shape[0]):
        given = compliance(force[0, i], force[1, i], reference[8, i], reference[9, i], reference[14, i])
        x, y = motion[0, i] - reference[0, i] - given[0], motion[1, i] - reference[1, i] - given[1]
        settled = since[i] >= SETTLED
        for row, counts in ((0, True), (2, settled)):
            if counts:
                tally[row, i] += x * x + y * y
                tally[row + 1, i] += 1.0
        row = 2 if tally[3, i] > 0.0 else 0
        success[i] = not failed[i] and math.sqrt(tally[row, i] / tally[row + 1, i]) < SUCCESS_ERROR


class Success:
    """Whether the episodes of N lanes are successful so far, ``now`` (N,).

    The error is the root mean square over the policy steps ``SETTLED`` s and more after a jump, or over all of them before
    there is such a step. An episode that has failed is none.
    """

    def __init__(self, lanes: int) -> None:
        self._tally: Array = np.zeros((4, lanes))
        self.now: NDArray[np.bool_] = np.zeros(lanes, dtype=np.bool_)

    def begin(self, lanes: Mask) -> None:
        """Start anew in the lanes of a mask (N,)."""
        self._tally[:, lanes] = 0.0
        self.now = self.now & ~lanes

    def add(self, motion: Array, reference: Array, force: Array, since: Array, failed: NDArray[np.bool_]) -> None:
        """Take one policy step: motion (4, N), reference rows, user force (2, N) N, s since a jump and who has failed (N,)."""
        self.now = np.empty_like(failed)
        _add(motion, reference, force, since, failed, self._tally, self.now)
