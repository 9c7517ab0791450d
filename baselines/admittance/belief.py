"""What the law believes of the rig in each lane, and how it goes over to a rig that it is told while it runs.

A lane that is told another rig goes over to it by a first-order low-pass, all parameters side by side,
    believed' = (told - believed)/TIME
so that no opening jumps. What it had learned of the former rig is told anew with it: the level of friction goes back to 1 in
the same way, and a mass that is not learned is the one believed.

Each period changes what pressures, weight and hand explain of a piston's acceleration. The observers of what they do not
explain would find that change only after a while, and until then the law would act against it. So it is carried over to them:
    d' = d + a(former rig) - a(rig)
and as a force to the candidates for the friction. Where the rig is the one that was believed, this adds zero.
"""

from baselines.admittance.rows import Constants, Memory
from baselines.estimation.disturbance_observer import accelerations
from baselines.estimation.hand.friction_candidates import Bank, candidate, count_of
from baselines.estimation.rows import AssumedParameters, Inputs
from birthsim_env.loop.rows import Seen
from birthsim_env.loop.stage import scratch
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
def _explained(i: int, seen: Seen, memory: Memory, mass: float, own: Constants) -> tuple[float, float, float]:
    """What pressures, weight and hand explain of the accelerations of both pistons with a ``mass``, m/s2; and kappa."""
    inputs = Inputs(scratch(Inputs.size))
    for axis in range(2):
        found = memory.hand.force[axis, i] if own.weighed > 0.0 else 0.0
        inputs.force[axis, i] = seen.user_force[axis, i] if own.force_sensor > 0.0 else found
        inputs.believed[axis, i] = 0.0
    inputs.inverse_mass[i] = 1.0 / mass
    return accelerations(memory.joints, i, memory.chambers.pressure, inputs, own.model.rig)


@helper
def believe(
    belief: Belief, i: int, seen: Seen, memory: Memory, bank: Bank, constants: Constants, own: Constants, eager: float
) -> float:
    """Carries the belief of lane ``i`` on by one period, and writes to ``own`` what of the ``constants`` follows from it.

    ``memory`` and ``bank`` are those of the law; with ``eager`` below 1 it goes over more slowly. Returns what is left of the
    way."""
    left = 1.0 - eager * (1.0 - exact.exp(-constants.model.period / TIME))
    for k in range(Constants.size):
        own.rows[k] = constants.rows[k]
    for k in range(Rig.size):
        own.rows[RIG + k] = belief.rig[k, i]
    mass, former = memory.inertia.mass[i], own.model.rig.mass
    before1, before2, _ = _explained(i, seen, memory, mass, own)
    for k in range(Rig.size):
        told = belief.told[k, i]
        belief.rig[k, i] = told + left * (belief.rig[k, i] - told)
        own.rows[RIG + k] = belief.rig[k, i]
    own.compliance.rows[0] = own.model.rig.mass
    if memory.fresh[i] == 0.0:
        mass *= own.model.rig.mass / former
        now1, now2, kappa = _explained(i, seen, memory, mass, own)
        memory.pistons.disturbance[0, i] += before1 - now1
        memory.pistons.disturbance[1, i] += before2 - now2
        if constants.weighs_friction > 0.0:
            for c in range(count_of(bank)):
                candidate(bank, c).push[0, i] += (before1 - now1) * mass * kappa * kappa
                candidate(bank, c).push[1, i] += (before2 - now2) * mass
    if belief.news[i] > ARRIVED:
        belief.news[i] *= left
        for k in range(2):
            memory.friction.level[k, i] = 1.0 + left * (memory.friction.level[k, i] - 1.0)
    if constants.learns_mass == 0.0:
        memory.inertia.mass[i] = own.model.rig.mass
    return left
