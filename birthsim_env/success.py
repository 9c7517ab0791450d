"""What counts as success: an episode that goes on to its end and stays within a millimetre of the compliant target."""

from __future__ import annotations

import math

from birthsim_env.loop.signals import compliance
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array

SETTLED = 0.5
"""s after a jump of force or setpoint (or the start) from which an error counts as settled."""

SUCCESS_ERROR = 1e-3
"""m, root mean square distance from the compliant target; assumed: a quarter of the paper's law's."""


@helper
def add(
    motion: Array, reference: Array, force: Array, since: Array, failed: Array, tally: Array, success: Array
) -> None:  # fmt: skip
    """Takes one policy step: carries ``tally`` (4, N) on and writes ``success`` (N,), 1 where an episode is successful so far.

    The error is the root mean square over the policy steps ``SETTLED`` s and more after a jump (``since`` (N,), s), or over all
    of them before there is such a step. An episode that has ``failed`` (N,) is none.
    """
    for i in range(since.shape[0]):
        given = compliance(force[0, i], force[1, i], reference[8, i], reference[9, i], reference[14, i])
        x, y = motion[0, i] - reference[0, i] - given[0], motion[1, i] - reference[1, i] - given[1]
        settled = since[i] >= SETTLED
        for row, counts in ((0, True), (2, settled)):
            if counts:
                tally[row, i] += x * x + y * y
                tally[row + 1, i] += 1.0
        row = 2 if tally[3, i] > 0.0 else 0
        good = failed[i] == 0.0 and math.sqrt(tally[row, i] / tally[row + 1, i]) < SUCCESS_ERROR
        success[i] = 1.0 if good else 0.0
