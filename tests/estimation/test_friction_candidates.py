"""Candidates for friction: weights against Bayes' rule by hand, laws against steady friction, and which law a piston has."""

import math

import numpy as np
import pytest

from baselines.estimation.hand import bristle_filter, friction_candidates
from baselines.estimation.hand.friction_candidates import (
    BY_FORCE,
    BY_POSITION,
    CANDIDATES,
    CHANGES,
    CLIP,
    COULOMB,
    ELASTO_PLASTIC,
    FINE,
    LUGRE,
    MAXWELL,
    PRIOR,
    WAITS,
    Bank,
    Candidate,
    Seen,
)
from tests.estimation.test_bristle_filter import COULOMB as LEVEL
from tests.estimation.test_bristle_filter import MASS, PERIOD, RIG, STRIBECK, VISCOUS, P

LEFT_NOISE, SAMPLE_NOISE = 0.45, 1e-4


def bank_of(count=CANDIDATES):
    bank = Bank(friction_candidates.fresh_bank(count)[:, None])
    friction_candidates.begin(bank, 0)
    return bank


def candidate(bank, c):
    return Candidate(bank.candidates[c * Candidate.size : (c + 1) * Candidate.size])


def chances(bank):
    return friction_candidates.chances(bank.rows)[:, 1, 0]


def seen(**values):
    plain = {
        "position": 0.0, "speed": 0.0, "speed_noise": 5e-3, "load": 0.0, "own": 0.0, "mass": MASS, "level": LEVEL,
        "unexplained": 0.0, "unexplained_noise": LEFT_NOISE, "is_sampled": False, "sample": 0.0, "sample_noise": SAMPLE_NOISE,
    }  # fmt: skip
    return Seen(**{**plain, **values})


def follow(bank, told, new=False):
    return friction_candidates.follow(bank, 1, 0, told, 0.3, 0.1, P, PERIOD, new)


def test_they_begin_as_probable_as_assumed_and_one_alone_is_certain():
    assert chances(bank_of()) == pytest.approx(PRIOR)
    assert sum(PRIOR) == pytest.approx(1.0)
    assert chances(bank_of(1)) == [1.0]


def test_nothing_is_weighed_before_speeds_have_settled():
    bank = bank_of()
    for k in range(20):
        follow(bank, seen(unexplained=7.0 * (k % 2), is_sampled=True, sample=1e-3), new=k == 0)
    assert chances(bank) == pytest.approx(PRIOR)


@pytest.mark.parametrize("is_sampled", [False, True])
def test_weights_are_those_of_bayes_rule(is_sampled):
    bank, rng = bank_of(), np.random.default_rng(2)
    for k in range(50):  # so that candidates differ
        follow(bank, seen(load=6.0 * math.sin(0.3 * k), unexplained=rng.normal(), is_sampled=True, sample=2e-4), new=k == 0)
    bank.since[:] = WAITS + 1.0
    told = seen(load=2.0, unexplained=1.5, is_sampled=is_sampled, sample=3e-4)
    before, logarithms, frictions = chances(bank), np.zeros(CANDIDATES), np.zeros(CANDIDATES)
    copy = Bank(bank.rows.copy())
    for c in range(CANDIDATES):
        b, law = candidate(copy, c), friction_candidates.law_of(c, P)
        noises = (0.3, copy.sums.boost[1, 0], 0.1)
        friction_candidates._carry(b, c, 1, 0, told, law, noises, P, PERIOD, False)
        off, variance = bristle_filter.weigh(b, 1, 0, told.unexplained, LEFT_NOISE, b.grip[1, 0], law, P)
        variance += (FINE**2 - 1) * LEFT_NOISE**2
        logarithms[c] = -BY_FORCE / 2 * (math.log(variance) + min(off**2 / variance, CLIP))
        if is_sampled:
            off = told.sample - b.position[1, 0]
            variance = b.yy[1, 0] + SAMPLE_NOISE**2
            bristle_filter.correct(b, 1, 0, off, SAMPLE_NOISE)
            logarithms[c] += -BY_POSITION / 2 * (math.log(variance) + min(off**2 / variance, CLIP))
        frictions[c] = bristle_filter.drag(b, 1, 0, b.grip[1, 0], law, P)
    moved = (1 - PERIOD / CHANGES) * before + PERIOD / CHANGES * np.array(PRIOR)
    expected = moved * np.exp(logarithms)
    expected /= expected.sum()
    friction = follow(bank, told)
    assert chances(bank) == pytest.approx(expected, rel=1e-9)
    assert friction == pytest.approx(expected @ frictions, rel=1e-9)
    assert np.ptp(frictions) > 0.1


@pytest.mark.parametrize("speed", [0.1, -0.1, 0.02])
def test_all_laws_slide_with_the_friction_of_their_level(speed):
    """Fc + (Fs - Fc)/(1 + (v/vs)^2) + Fv v, and for (4) Fc + Fv v."""
    for c in range(CANDIDATES):
        law = friction_candidates.law_of(c, P)
        b = candidate(bank_of(), c)
        level = LEVEL * (1.0 + (law.static_ratio - 1.0) / (1.0 + (speed / STRIBECK) ** 2))
        told = seen(speed=speed, speed_noise=3e-5, load=math.copysign(level, speed) + VISCOUS * speed)
        for k in range(600):
            friction_candidates._carry(b, c, 1, 0, told, law, (0.0, 0.0, 0.0), P, PERIOD, k == 0)
        found = bristle_filter.drag(b, 1, 0, b.grip[1, 0], law, P)
        assert found == pytest.approx(math.copysign(level, speed) + VISCOUS * speed, rel=0.01)
        assert law.static_ratio == (1.0 if c == COULOMB else RIG.friction.static_ratio)


def test_without_bristles_a_slow_piston_is_held_in_proportion_to_its_speed():
    law, speed = friction_candidates.law_of(COULOMB, P), 0.3 * RIG.friction.sign_speed
    b = candidate(bank_of(), COULOMB)
    told = seen(speed=speed, speed_noise=1e-7, load=0.3 * LEVEL)
    for k in range(600):
        friction_candidates._carry(b, COULOMB, 1, 0, told, law, (0.0, 0.0, 0.0), P, PERIOD, k == 0)
    assert bristle_filter.drag(b, 1, 0, 1.0, law, P) == pytest.approx(0.3 * LEVEL + VISCOUS * speed, rel=0.02)


def plant(kind, v, z):
    """z', or the force of (4) where there is no z, of a piston as an independent plain model has it."""
    s0 = RIG.friction.bristle_stiffness
    level = LEVEL * (1.0 + (RIG.friction.static_ratio - 1.0) / (1.0 + (v / STRIBECK) ** 2))
    q = z * s0 / level * (1.0 if v > 0 else -1.0)
    s = min(max((q - RIG.friction.breakaway_ratio) / (1 - RIG.friction.breakaway_ratio), 0.0), 1.0)
    alpha = {LUGRE: 1.0, ELASTO_PLASTIC: s * s * (3 - 2 * s)}[kind]
    return v - alpha * abs(v) * z * s0 / level


@pytest.mark.parametrize("kind", [LUGRE, COULOMB])
def test_the_law_that_moves_a_piston_is_found(kind):
    """A load that turns round makes a piston slide and stick; a speed and what is left unexplained are measured with noise."""
    rng, bank, s0, s1 = np.random.default_rng(5), bank_of(), RIG.friction.bristle_stiffness, RIG.friction.bristle_damping
    y, v, z = 0.0, 0.0, 0.0
    for k in range(6000):
        time, load = k * PERIOD, 0.0
        for part in range(20):  # steps of 50 us
            load = 18.0 * math.sin(2 * math.pi * 0.6 * (time + part * PERIOD / 20))
            if kind == COULOMB:
                drag = LEVEL * max(-1.0, min(1.0, v / RIG.friction.sign_speed)) + VISCOUS * v
            else:
                rate = plant(kind, v, z)
                drag = s0 * z + s1 * rate + VISCOUS * v
                z += PERIOD / 20 * rate
            v += PERIOD / 20 * (load - drag) / MASS
            y += PERIOD / 20 * v
        told = seen(
            position=y, speed=v + 1e-4 * rng.standard_normal(), load=load, unexplained=-drag + 0.1 * rng.standard_normal(),
            is_sampled=k % 4 == 0, sample=y + SAMPLE_NOISE * rng.standard_normal(),
        )  # fmt: skip
        bank.since[:] += PERIOD
        follow(bank, told, new=k == 0)
    assert chances(bank)[kind] > 0.9
    assert chances(bank)[MAXWELL] < 0.1
