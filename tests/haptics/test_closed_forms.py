"""Every estimator of what a hand feels, on ports whose answer is known: mass, damper and spring, and a spring that is late."""

import math
from itertools import pairwise

import numpy as np
import pytest

from baselines.impedance import DeclaredMotion, mass_spring_damper
from lab.studies.haptics import backdriving, release
from lab.studies.haptics.backdriving import beyond_spring, guiding_hand
from lab.studies.haptics.impedance import (
    bandwidth,
    last_before,
    noticeable_differences,
    passivity_shortage,
    port_damping,
    unnoticed_up_to,
)
from lab.studies.haptics.multisine import (
    FREQUENCIES,
    FUNDAMENTAL,
    SECONDS,
    SETTLING,
    impedance_felt,
    measured_part,
    multisine_hand,
)
from lab.studies.haptics.own_error import declared_offset, error_size, pure_spring_offset
from lab.studies.haptics.recording import record
from lab.studies.haptics.release import PULL, flight, pulling_hand
from lab.studies.haptics.worlds import resting
from lab.studies.stability.maps import push_and_release
from tests.oracles.ideal_ports import IdealPort, impedance, stiffest

MASS, STIFFNESS = 3.0, 2000.0
DAMPING = 2 * 0.9 * math.sqrt(MASS * STIFFNESS)
HELD_FORCE = (2 * math.pi * FREQUENCIES.max() * 2.5e-4) ** 2 / 24
"""Relative loss of a sine of 30 Hz that is held for 0.25 ms: 9e-5."""
LIGHT, LATE, DRAG = 0.3, 0.05, 85.0
"""kg, s and N s/m with a spring of 2000 N/m: stable when free, and active at low frequencies, since K T = 100 N s/m."""


def several(*values):
    return np.array(values)


@pytest.fixture(scope="module")
def ideal():
    direction = np.array([[1.0, 0.6], [0.0, 0.8]])
    port = IdealPort(several(MASS, MASS), several(DAMPING, DAMPING), several(STIFFNESS, STIFFNESS), target=several(0.5, 0.0))
    return record(port, multisine_hand(direction, several(10.0, 10.0), 1), SECONDS), direction


@pytest.fixture(scope="module")
def late():
    direction = np.array([[1.0], [0.0]])
    port = IdealPort(several(LIGHT), several(DRAG), several(STIFFNESS), LATE)
    return record(port, multisine_hand(direction, several(10.0), 1), SECONDS), direction


def test_a_mass_a_spring_and_a_damper_are_felt_as_they_are(ideal):
    np.testing.assert_allclose(np.linalg.norm(ideal[0].force, axis=1).max(axis=0), 10.0, rtol=1e-3)
    felt, truth = impedance_felt(*ideal), impedance(FREQUENCIES, MASS, DAMPING, STIFFNESS)[:, None]
    assert np.abs(felt / truth - 1).max() < 2 * HELD_FORCE
    assert bandwidth(felt, np.repeat(truth, 2, axis=1), FREQUENCIES).tolist() == [FREQUENCIES[-1]] * 2
    assert noticeable_differences(felt, truth).max() < 2 * HELD_FORCE / 0.15
    np.testing.assert_allclose(port_damping(felt, FREQUENCIES), DAMPING, rtol=3e-4 * STIFFNESS / DAMPING)
    assert passivity_shortage(felt, FREQUENCIES).max() == 0


def test_an_ideal_impedance_has_no_error_of_its_own_and_gives_no_energy(ideal):
    recording, direction = ideal
    reference = resting([(0.5, 0.0)] * 2, [STIFFNESS] * 2)
    begin = SETTLING / FUNDAMENTAL
    own = declared_offset(mass_spring_damper(reference, MASS, 0.9), recording.force, 1e-3)
    motion = np.sqrt(((recording.position - reference.position) ** 2).sum(axis=1).mean(axis=0))
    # The force that a straight line replaces: (w dt)^2/12 with 1 ms at 30 Hz is 3e-3, of a line that hardly moves the mass.
    assert (error_size(recording, reference, own, begin, SECONDS) < 1e-3 * motion).all()
    spring = error_size(recording, reference, pure_spring_offset(reference, recording.force), begin, SECONDS)
    part = measured_part(recording)
    turns = np.exp(-2j * np.pi * FREQUENCIES[:, None] * part.time)
    lines = 2 / len(part.time) * turns @ np.einsum("tin,in->tn", part.force, direction)
    missing = 1 / impedance(FREQUENCIES, MASS, DAMPING, STIFFNESS) - 1 / STIFFNESS
    np.testing.assert_allclose(spring, np.sqrt((np.abs(missing[:, None] * lines) ** 2).sum(axis=0) / 2), rtol=1e-3)
    assert recording.energy.max() < 1e-12


def test_where_an_impedance_would_be_agrees_with_its_matrix_exponential():
    """Under forces that change from policy step to policy step, with coupled and unequal stiffness."""
    reference = resting([(0.5, 0.0)] * 2, [5000.0, 1000.0])
    reference.stiffness[1], reference.stiffness_coupling[0] = (2000.0, 4500.0), 300.0
    impedance = mass_spring_damper(reference, MASS, 0.9)
    force = np.random.default_rng(0).standard_normal((100, 2, 2)).cumsum(axis=0)
    motion, found = DeclaredMotion(2), [np.zeros((2, 2))]
    for before, after in pairwise(force):
        motion.advance(impedance, before, after, 0.01)
        found.append(motion.offset[:2])
    # (w h)^4/120 of a substep of 2 ms at 41 rad/s.
    np.testing.assert_allclose(found, declared_offset(impedance, force, 0.01), atol=4e-7 * np.abs(found).max())


@pytest.mark.slow
def test_a_late_spring_is_felt_late(late):
    felt, truth = impedance_felt(*late)[:, 0], impedance(FREQUENCIES, LIGHT, DRAG, STIFFNESS, LATE)
    assert np.abs(felt / truth - 1).max() < 3e-3
    declared = impedance(FREQUENCIES, LIGHT, DRAG, STIFFNESS)
    ratio = truth / declared
    within = (np.abs(np.abs(ratio) - 1) <= 0.1) & (np.abs(np.degrees(np.angle(ratio))) <= 10)
    assert within[0]
    assert not within.all()
    expected = FREQUENCIES[np.argmin(within) - 1]
    assert bandwidth(felt[:, None], declared[:, None], FREQUENCIES).tolist() == [expected]


def test_a_late_spring_gives_the_energy_that_its_phase_says(late):
    """Re(Fu/v) = b - K sin(wT)/w; over whole periods the port gives half of -|v|^2 Re(Fu/v) per second and line."""
    recording, direction = late
    felt, w = impedance_felt(recording, direction), 2 * np.pi * FREQUENCIES
    exact = DRAG - STIFFNESS * np.sin(w * LATE) / w
    assert exact[0] < -14
    np.testing.assert_allclose(port_damping(felt, FREQUENCIES)[:, 0], exact, atol=3e-3 * np.abs(felt[:, 0]).max() / w[-1] + 0.5)
    np.testing.assert_allclose(passivity_shortage(felt, FREQUENCIES)[0, 0], -exact[0], rtol=0.01)
    part = measured_part(recording)
    turns = np.exp(-2j * np.pi * FREQUENCIES[:, None] * part.time)
    speed = 2 / len(part.time) * np.abs(turns @ part.velocity[:, 0, 0])
    given = recording.energy[-1, 0] - part.energy[0, 0]
    assert given == pytest.approx(-(SECONDS - SETTLING / FUNDAMENTAL) / 2 * (speed**2 * exact).sum(), rel=0.02)


def test_noticeable_differences_are_those_of_compliance():
    """15 % more compliant is one; the last line is that before the first miss."""
    declared = np.full((3, 1), 2000.0 + 0j)
    felt = declared / np.array([[1.15], [1.0], [1.30]])
    np.testing.assert_allclose(noticeable_differences(felt, declared)[:, 0], [1, 0, 2], atol=1e-12)
    assert unnoticed_up_to(felt * (1 + 1e-9), declared, several(1.0, 2.0, 3.0)).tolist() == [2.0]
    assert last_before(np.array([[False], [True]]), several(1.0, 2.0)).tolist() == [0.0]


@pytest.mark.parametrize("ratio", [0.2, 0.6])
def test_a_pull_let_go_swings_past_its_target(ratio):
    """Overshoot F/K exp(-pi z/(1 - z^2)^(1/2)), largest speed F/K w exp(-z w t) where tan((1 - z^2)^(1/2) w t) = ..."""
    mass, stiffness = 30.0, 4000.0
    w, damped = math.sqrt(stiffness / mass), math.sqrt(1 - ratio**2)
    port = IdealPort(several(mass), several(2 * ratio * math.sqrt(mass * stiffness)), several(stiffness))
    found = flight(record(port, pulling_hand(PULL), release.FREE + release.AFTER), np.zeros((2, 1)))
    # 10 ms of release are 0.12 of a radian: a few parts in a thousand, and the swing's decay meanwhile.
    size = PULL / stiffness
    assert found["overshoot"][0] == pytest.approx(size * math.exp(-math.pi * ratio / damped), rel=0.03)
    assert found["speed"][0] == pytest.approx(size * w * math.exp(-ratio / damped * math.atan2(damped, ratio)), rel=0.01)


def test_moved_slowly_a_damper_is_all_that_a_spring_adds():
    """1 N at 10 mm/s for 100 N s/m, along any direction; a hand of 4000 N/m leads a spring of 500 N/m at 8/9 of its speed."""
    direction = np.array([[1.0, 0.6], [0.0, 0.8]])
    port = IdealPort(several(3.0, 3.0), several(100.0, 100.0), several(500.0, 0.0))
    recording = record(port, guiding_hand(np.zeros((2, 2)), direction), backdriving.SECONDS)
    for lane, stiffness in enumerate((500.0, 0.0)):
        mean, most = beyond_spring(recording, np.zeros((2, 2)), direction, stiffness)
        expected = backdriving.GUIDE / (backdriving.GUIDE + stiffness)
        assert mean[lane] == pytest.approx(expected, rel=2e-3)
        assert most[lane] == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("hand", [0.0, 5000.0])
def test_a_late_spring_is_stable_up_to_its_border(hand):
    """The border of stability in closed form, a fifth below and above it."""
    mass, drag, delay = 2.0, 60.0, 0.01
    border = stiffest(mass, drag, delay, hand)
    stiffness = border * several(0.8, 1.2)
    port = IdealPort(np.full(2, mass), np.full(2, drag), stiffness, delay)
    verdict = push_and_release(port, np.zeros((2, 2)), np.full(2, hand), np.zeros(2))
    assert verdict.stable.tolist() == [True, False]
    assert verdict.energy[1] > verdict.energy[0]
