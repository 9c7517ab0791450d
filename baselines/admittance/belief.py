"""What the law believes of the rig in each lane, and how it goes over to a rig that it is told while it runs.

A lane that is told another rig goes over to it by a first-order low-pass, all parameters side by side,
    believed' = (told - believed)/TIME
so that no opening jumps. What it had learned of the former rig is told anew with it: the level of friction goes back to 1 in
the same way, and a mass that is not learned is the one believed.
"""

from baselines.admittance.rows import Constants, Memory
from baselines.estimation.rows import AssumedParameters
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array, Rig
from birthsim_env.physics.compiled.records import Rows, row, rows

TIME = 0.05
"""s; assumed: quicker than what a hand notices, slower than the loop, whose slowest pole is at some 35 1/s."""

ARRIVED = 1e-3
"""1; assumed: with so much left of the way, a lane counts as having come to what it was told."""

RIG = Constants.model.first + AssumedParameters.rig.first
"""Where the rig begins among the constants."""


class Belief(Rows):
    """What a lane believes."""

    told = rows(Rig.size, "SI", "rig that it is told")
    rig = rows(Rig.size, "SI", "rig that it believes in")
    news = row("1", "1 when it is told, and from then on what is left of the way")


def fresh(rig: Array) -> Array:
    """``Belief`` of a lane that begins with a rig (PARAMETERS,)."""
    return Belief.lane(told=rig, rig=rig)


@helper
def believe(belief: Belief, i: int, memory: Memory, constants: Constants, own: Constants, eager: float) -> float:
    """Carries the belief of lane ``i`` on by one period, and writes to ``own`` what of the ``constants`` follows from it.

    ``memory`` is that of the law; with ``eager`` below 1 it goes over more slowly. Returns what is left of the way."""
    left = 1.0 - eager * (1.0 - exact.exp(-constants.model.period / TIME))
    for k in range(Constants.size):
        own.rows[k] = constants.rows[k]
    for k in range(Rig.size):
        told = belief.told[k, i]
        belief.rig[k, i] = told + left * (belief.rig[k, i] - told)
        own.rows[RIG + k] = belief.rig[k, i]
    own.compliance.rows[0] = own.model.rig.mass
    if belief.news[i] > ARRIVED:
        belief.news[i] *= left
        for k in range(2):
            memory.friction.level[k, i] = 1.0 + left * (memory.friction.level[k, i] - 1.0)
    if constants.learns_mass == 0.0:
        memory.inertia.mass[i] = own.model.rig.mass
    return left
