"""What counts as success: an episode that goes on to its end and stays within a millimetre of the compliant target."""

import math

from birthsim_env.loop.rows import World
from birthsim_env.loop.signals import Reference, compliance
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, row

SETTLED = 0.5
"""s after a jump of force or setpoint (or the start) from which an error counts as settled."""

SUCCESS_ERROR = 1e-3
"""m, root mean square distance from the compliant target; assumed: a quarter of the paper's law's."""


class Tally(Rows):
    """Of an episode so far."""

    squares = row("m2", "sum of the squared distances from the compliant target")
    steps = row("1", "policy steps")
    settled_squares = row("m2", "the same, of settled steps")
    settled_steps = row("1", "settled policy steps")


@helper
def add(world: World, reference: Reference, failed: Array, tally: Tally, success: Array, n: int) -> None:
    """Takes one policy step: carries ``tally`` on and writes ``success`` (N,), 1 where an episode is successful so far.

    The error is the root mean square over the policy steps ``SETTLED`` s and more after a jump, or over all of them before
    there is such a step. An episode that has ``failed`` (N,) is none.
    """
    for i in range(n):
        kx, ky, kxy = reference.stiffness[0, i], reference.stiffness[1, i], reference.stiffness_coupling[i]
        given_x, given_y = compliance(world.force[0, i], world.force[1, i], kx, ky, kxy)
        x = world.motion.position[0, i] - reference.position[0, i] - given_x
        y = world.motion.position[1, i] - reference.position[1, i] - given_y
        tally.squares[i] += x * x + y * y
        tally.steps[i] += 1.0
        if world.since_jump[i] >= SETTLED:
            tally.settled_squares[i] += x * x + y * y
            tally.settled_steps[i] += 1.0
        any_settled = tally.settled_steps[i] > 0.0
        squares = tally.settled_squares[i] if any_settled else tally.squares[i]
        steps = tally.settled_steps[i] if any_settled else tally.steps[i]
        success[i] = 1.0 if failed[i] == 0.0 and math.sqrt(squares / steps) < SUCCESS_ERROR else 0.0
