"""Candidates for the friction of a piston, weighed by how well each explains what is measured (Magill 1965).

Each candidate is a filter (``bristle_filter``, ``maxwell_filter``) that believes a law of its own, at the levels of the rig as
described. An innovation e of variance S makes of the probability w of each
    w' = w L/sum(w L),   L = (S^-1/2 exp(-e^2/2S))^gamma
where gamma is below 1, because innovations of successive instants are not independent. A friction is thought to change to
another at the rate 1/``CHANGES``, so that no candidate is ever given up. Friction is the mean of what candidates say. The first
candidate is the friction as believed: its probability says how far that is to be trusted. Alone it is certain.

What makes the force quick is common to all: a test on the mean innovation of positions (``cumulative_sums``).
"""

import math
from typing import NamedTuple

import numpy as np

from baselines.estimation.hand import bristle_filter, cumulative_sums, maxwell_filter
from baselines.estimation.hand.bristle_filter import LEAST_SPEED, YIELDS, Law
from baselines.estimation.hand.cumulative_sums import CumulativeSums
from baselines.estimation.hand.maxwell_filter import Elements
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array, Rig
from birthsim_env.physics.compiled.records import Rows, part, row, rows

LUGRE, ELASTO_PLASTIC, COULOMB, MAXWELL = range(4)
"""Candidates: LuGre as believed, its elasto-plastic variant, the paper's law (4), generalised Maxwell slip."""

CANDIDATES = 4

PRIOR = (0.7, 0.1, 0.1, 0.1)
"""assumed: probabilities of the candidates before anything is measured."""

SPRING = 5e5
"""N/m; found by trial: (4), which has no bristles, is followed as a spring so stiff behind its damper. With 2e5 a hand of
20 kN/m is taken for friction."""

CHANGES, WAITS = 60.0, 0.4
"""s: a friction changes so rarely; and nothing is weighed so long after a start, while speeds settle. Found by trial."""

BY_FORCE, BY_POSITION = 0.1, 0.7
"""gamma of an innovation of the force, 1000 a second, and of a position sample; found by trial. With 0.3 and 1 candidates
change places within 0.2 s, and heads hunt."""

FINE = 0.3
"""What an innovation of the force is judged by, in the standard deviation that the filter assumes, which is large enough for
errors of the model of the pressures; at rest innovations are a third of that. Found by trial."""

CLIP = 9.0
"""assumed: no squared innovation counts for more, in units of its variance."""

DOUBTED = 0.05
"""assumed: below this probability the friction believed is said to be wrong."""


class Candidate(Elements):
    """What a candidate believes of both pistons, and how probable it is."""

    chance = rows("w1 w2", "1", "probability")


class Bank(Rows):
    """All candidates."""

    since = row("s", "since the start")
    newest = row("s", "time of the newest sample")
    sums = part(CumulativeSums, "test of the mean innovations")
    candidates = rows(0, "1", "``Candidate`` after ``Candidate``")


class Seen(NamedTuple):
    """What is measured of a piston in a period, SI units: where it is as observed, what acts on it, ``mass`` as it feels it;
    what acceleration, weight and chambers leave ``unexplained``; and a position ``sample`` as carried on to now, where it
    ``is_sampled``. Each ``noise`` is a standard deviation."""

    position: float
    speed: float
    speed_noise: float
    load: float
    own: float
    mass: float
    level: float
    unexplained: float
    unexplained_noise: float
    is_sampled: bool
    sample: float
    sample_noise: float


def fresh_bank(count: int) -> Array:
    """``Bank`` of a lane that starts, with the first ``count`` candidates."""
    return Bank.lane(candidates=np.zeros(count * Candidate.size))


def chances(bank: Array) -> Array:
    """Probabilities (C, 2, N) of the candidates for the friction of both pistons, from the rows of a ``Bank`` (M, N)."""
    each = bank[Bank.candidates.first :].reshape(-1, Candidate.size, bank.shape[1])
    return np.array(each[:, Candidate.chance.place])


@helper
def count_of(bank: Bank) -> int:
    """How many candidates there are."""
    return int(bank.candidates.shape[0] // Candidate.size)


@helper
def candidate(bank: Bank, c: int) -> Candidate:
    """Candidate ``c``."""
    return Candidate(bank.candidates[c * Candidate.size : (c + 1) * Candidate.size])


@helper
def law_of(c: int, p: Rig) -> Law:
    """The law of candidate ``c`` in a rig as described."""
    if c == COULOMB:
        return Law(SPRING, 0.0, 1.0, p.stribeck, YIELDS, 1.0, p.sign_speed)
    breakaway = p.breakaway if c == ELASTO_PLASTIC else bristle_filter.HOLDS if c == MAXWELL else YIELDS
    steepness = p.steepness if c == ELASTO_PLASTIC else 1.0
    return Law(p.s0, p.s1, p.static_ratio, p.stribeck, breakaway, steepness, LEAST_SPEED)


@helper
def likelihood(innovation: float, variance: float, power: float) -> float:
    """L of an innovation and its variance, but for a factor that all candidates share."""
    return exact.exp(-0.5 * power * (exact.log(variance) + min(innovation * innovation / variance, CLIP)))


@helper
def begin(bank: Bank, i: int) -> None:
    """Starts lane ``i``."""
    bank.since[i], count = 0.0, count_of(bank)
    for k in range(2):
        cumulative_sums.begin(bank.sums, k, i)
        for c in range(count):
            candidate(bank, c).chance[k, i] = PRIOR[c] if count > 1 else 1.0


@helper
def _carry(
    b: Candidate,
    c: int,
    k: int,
    i: int,
    seen: Seen,
    law: Law,
    noises: tuple[float, float, float],
    p: Rig,
    period: float,
    new: bool,
) -> None:
    """Carries piston ``k`` of candidate ``c`` on by a period; ``noises``: push_noise, boost, unseen of ``predict``."""
    (push_noise, boost, unseen), answer = noises, 1.0 / seen.mass
    b.level[k, i] = seen.level
    if new:
        push = -seen.load - seen.own * seen.mass
        bristle_filter.begin(b, k, i, seen.position, seen.speed, push, seen.sample_noise, law, p)
        maxwell_filter.begin(b, k, i, law, p)
    if c == MAXWELL:
        maxwell_filter.predict(b, k, i, seen.load, seen.own, answer, push_noise, boost, law, p, period)
    else:
        bristle_filter.predict(b, k, i, seen.load, seen.own, answer, push_noise, boost, unseen, law, p, period)
    bristle_filter.gauge(b, k, i, seen.speed, seen.speed_noise)


@helper
def follow(bank: Bank, k: int, i: int, seen: Seen, push_noise: float, unseen: float, p: Rig, period: float, new: bool) -> float:
    """Carries piston ``k`` of lane ``i`` on by one period; its friction, N. ``begin`` comes before, where it is ``new``."""
    count, sums = count_of(bank), bank.sums
    weighs = count > 1 and bank.since[i] > WAITS
    noises = (push_noise, sums.boost[k, i], unseen)
    total, friction, off = 0.0, 0.0, 0.0
    for c in range(count):
        b, law = candidate(bank, c), law_of(c, p)
        _carry(b, c, k, i, seen, law, noises, p, period, new)
        chance, noise = b.chance[k, i], seen.unexplained_noise
        innovation, variance = bristle_filter.weigh(b, k, i, seen.unexplained, noise, b.grip[k, i], law, p)
        if weighs:
            chance += period / CHANGES * (PRIOR[c] - chance)
            chance *= likelihood(innovation, variance - (1.0 - FINE * FINE) * noise * noise, BY_FORCE)
        if seen.is_sampled:
            innovation = seen.sample - b.position[k, i]
            variance = bristle_filter.correct(b, k, i, innovation, seen.sample_noise)
            if weighs:
                chance *= likelihood(innovation, variance, BY_POSITION)
            off += chance * innovation / math.sqrt(variance)
        b.chance[k, i] = chance
        total += chance
        friction += chance * bristle_filter.drag(b, k, i, b.grip[k, i], law, p)
    for c in range(count):
        candidate(bank, c).chance[k, i] /= total
    if seen.is_sampled:
        cumulative_sums.take(sums, k, i, off / total)
    cumulative_sums.fade(sums, k, i, period)
    return friction / total
