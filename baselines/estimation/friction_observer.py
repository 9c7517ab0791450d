"""Pistons from position samples where the hand's force is known and their friction is not: candidates, weighed (Magill 1965).

An observer that believes one friction rests quietly on that friction alone. Softer bristles let a resting piston give way,
which it takes for noise; stiffer ones hold it and then let go. Here every piston has a bank of extended Kalman filters
(``bristle_filter``, ``maxwell_filter``), each with a friction of its own and with an unknown force f, the errors of mass,
pressures and levels:
    m a = L + Fu + f - friction(v, z),   f' = noise
Samples correct each filter, by where it believes the piston was when they were taken, and their innovations say how probable
it is (``friction_candidates.likelihood``). Position, speed and all that is unseen, f less friction, are the means of what the
filters say. A piston rests, creeps or slides as its candidates do; nothing else tells a rest, and no friction is fed forward.

While the target moves, friction along its way is known before it acts, and an observer that is given it (``observers``) errs
less than these candidates, which learn it from samples. So the law follows them while its target rests alone.

The last candidate has hardly any friction and a force that changes quickly. It explains a piston that does what no other
candidate expects, so that the others lose their weight for as long as that lasts.
"""

import math

from baselines.estimation import dry_friction
from baselines.estimation.hand import bristle_filter, cumulative_sums, maxwell_filter
from baselines.estimation.hand.bristle_filter import HOLDS, LEAST_SPEED, YIELDS, Law
from baselines.estimation.hand.bristled_pistons import LATE
from baselines.estimation.hand.friction_candidates import Bank, candidate, likelihood
from baselines.estimation.rows import AssumedParameters, Inputs
from birthsim_env.loop.rows import POSITION, Signals
from birthsim_env.loop.signals import Joints, PerChamber, Point
from birthsim_env.loop.stage import scratch
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array, Rig
from birthsim_env.physics.compiled.records import rows
from birthsim_env.physics.linkage import geometry, mechanics
from birthsim_env.physics.linkage.inverse_kinematics import piston_motion

BRISTLES = (1.0, 0.1, 0.3, 3.0, 10.0, 4.0, 1.0, 1.0, 0.3, 1.0)
LEVELS = (1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.4, 0.1, 0.05)
"""Stiffness of the bristles and level of friction of each candidate, in those believed; found by trial over the frictions of
``birthsim_env.parts.drawn.frictions``. LuGre, but for the next two."""

COULOMB, MAXWELL = 5, 6
"""Candidates: the paper's law (4), followed as a spring behind a damper, and generalised Maxwell slip."""

FORCE_NOISE, QUICK_NOISE = 1.0, 300.0
"""N2/s: density of the noise that drives f, and that of the last candidate; found by trial."""

UNSEEN = 0.1
"""Part of the variance of a piston's speed that is motion, which wears bristles down; that of ``inertial_force``."""

POWER = 0.2
"""gamma of a position sample: below 1, since innovations of successive samples are not independent; found by trial."""

CHANGES, WAITS = 2.0, 0.3
"""s: a friction is thought to change to any other so often, and nothing is weighed so long after a start; found by trial."""


class Found(Joints):
    """Means of what the candidates say."""

    unseen = rows("U1 U2", "N", "all that is unseen along the pistons")


@helper
def law_of(c: int, p: Rig) -> Law:
    """The law of candidate ``c`` in a rig as believed."""
    if c == COULOMB:
        return Law(BRISTLES[c] * p.s0, 0.0, 1.0, p.stribeck, YIELDS, 1.0, p.sign_speed)
    # Bristles of another stiffness keep the damping ratio of those believed.
    damping, breakaway = p.s1 * math.sqrt(BRISTLES[c]), HOLDS if c == MAXWELL else YIELDS
    return Law(BRISTLES[c] * p.s0, damping, p.static_ratio, p.stribeck, breakaway, 1.0, LEAST_SPEED)


@helper
def _begin(bank: Bank, joints: Joints, i: int, sample: Joints) -> None:
    """Starts lane ``i`` where ``sample`` has its pistons."""
    bank.since[i], bank.newest[i] = 0.0, 0.0
    for k in range(2):
        joints.position[k, i], joints.speed[k, i] = sample.position[k, i], sample.speed[k, i]
        cumulative_sums.begin(bank.sums, k, i)
        for c in range(len(BRISTLES)):
            candidate(bank, c).chance[k, i] = 1.0 / len(BRISTLES)


@helper
def _follow(
    bank: Bank,
    k: int,
    i: int,
    told: tuple[float, float, float, float],
    level: float,
    is_sampled: bool,
    sample: float,
    age: float,
    noise: float,
    start: tuple[float, float],
    p: Rig,
    period: float,
    new: bool,
) -> tuple[float, float, float]:
    """Carries piston ``k`` of lane ``i`` on by a period: its position, m, speed, m/s, and what is unseen, N.

    ``told`` are the force, N, and the acceleration without any, m/s2, that act on the piston, the answer to a force, 1/kg, and
    its viscous friction, N s/m; ``level`` is Coulomb friction, N; ``sample`` was taken an ``age``, s, ago, with its ``noise``,
    m; a ``new`` lane starts at the position and speed of ``start``.
    """
    (load, own, answer, viscous), weighs, count = told, bank.since[i] > WAITS, len(BRISTLES)
    total, position, speed, unseen, off = 0.0, 0.0, 0.0, 0.0, 0.0
    for c in range(count):
        b, law, density = candidate(bank, c), law_of(c, p), QUICK_NOISE if c == count - 1 else FORCE_NOISE
        b.level[k, i] = LEVELS[c] * level
        if new:
            bristle_filter.begin(b, k, i, start[0], start[1], -load - own / answer, noise, law, p)
            maxwell_filter.begin(b, k, i, law, p)
        boost, before = bank.sums.boost[k, i], b.speed[k, i]
        if c == MAXWELL:
            maxwell_filter.predict(b, k, i, load, own, answer, density, boost, law, p, period)
        else:
            bristle_filter.predict(b, k, i, load, own, answer, density, boost, UNSEEN, law, p, period)
        chance = b.chance[k, i] + (period / CHANGES * (1.0 / count - b.chance[k, i]) if weighs else 0.0)
        if is_sampled:
            innovation = sample - bristle_filter.position_ago(b, k, i, (b.speed[k, i] - before) / period, age)
            variance = bristle_filter.correct(b, k, i, innovation, noise, age, answer)
            chance *= likelihood(innovation, variance, POWER) if weighs else 1.0
            off += chance * innovation / math.sqrt(variance)
        b.chance[k, i] = chance
        total += chance
        position += chance * b.position[k, i]
        speed += chance * b.speed[k, i]
        unseen += chance * (b.push[k, i] + viscous * b.speed[k, i] - bristle_filter.drag(b, k, i, b.grip[k, i], law, p))
    for c in range(count):
        candidate(bank, c).chance[k, i] /= total
    if is_sampled:
        cumulative_sums.take(bank.sums, k, i, off / total)
    cumulative_sums.fade(bank.sums, k, i, period)
    return position / total, speed / total, unseen / total


@helper
def observe(
    bank: Bank,
    signals: Signals,
    joints: Joints,
    pressures: Array,
    levels: Array,
    inputs: Inputs,
    assumed: AssumedParameters,
    found: Found,
    fresh: Array,
) -> None:
    """Carries ``bank`` on by one control period and writes what it has ``found``.

    ``joints`` are the pistons as known, from which their levers follow, ``pressures`` (4, N) in Pa, ``levels`` (2, N) friction
    in units of that believed; ``inputs.believed`` is not read.
    """
    p, period, air = assumed.rig, assumed.period, PerChamber(pressures)
    sample = Joints(scratch(Joints.size))
    piston_motion(signals.rows[POSITION : POSITION + Point.size], p, sample.rows, fresh.shape[0])
    for i in range(fresh.shape[0]):
        new = fresh[i] > 0.0
        if new:
            _begin(bank, joints, i, sample)
        is_sampled = signals.position_time[i] > bank.newest[i]
        bank.since[i] += period
        bank.newest[i] = signals.position_time[i]
        age, inverse_mass = signals.time[i] - signals.position_time[i], inputs.inverse_mass[i]
        r4, r2, w, s2, _, kappa, sine, cosine = geometry.pose(
            joints.position[0, i], joints.position[1, i], p.k1, p.k2, p.d_squares, p.d_product, p.sin_gamma3, p.cos_gamma3
        )
        v1, v2, fx, fy = joints.speed[0, i], joints.speed[1, i], inputs.force[0, i], inputs.force[1, i]
        own1 = mechanics.acceleration1(0.0, v1, v2, r2, r4, w, s2, kappa, sine, inverse_mass, p.gravity)
        own2 = mechanics.acceleration2(0.0, v1, r2, r4, s2, cosine, inverse_mass, p.gravity)
        load1 = mechanics.piston_force(air.p1[i], air.n1[i], p.area_p1, p.area_n1, p.atmosphere)
        load2 = mechanics.piston_force(air.p2[i], air.n2[i], p.area_p2, p.area_n2, p.atmosphere)
        load1 += mechanics.user_force1(fx, fy, kappa, sine, cosine)
        load2 += mechanics.user_force2(fx, fy, sine, cosine)
        for k in range(2):
            v, lever = joints.speed[k, i], kappa if k == 0 else 1.0
            answer = inverse_mass / (lever * lever)
            told = (load1, own1, answer, p.fv1) if k == 0 else (load2, own2, answer, p.fv2)
            level = levels[k, i] * dry_friction.level_at(k, air.rows, i, p)
            noise = inputs.noise[i] / lever + LATE * abs(v)
            where, start = sample.position[k, i], (joints.position[k, i], v)
            position, speed, left = _follow(bank, k, i, told, level, is_sampled, where, age, noise, start, p, period, new)
            found.position[k, i], found.speed[k, i], found.unseen[k, i] = position, speed, left
