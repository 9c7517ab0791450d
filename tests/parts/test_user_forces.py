"""The user's hand as the scenarios have it: the profiles against the design's figures, and refusals by name."""

import gymnasium
import numpy as np
import pytest

from baselines.bench.feasibility import required_strength_ratio
from birthsim_env import ForceProfile
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.parts.hands.pulls import Pulls
from birthsim_env.parts.hands.steps import AlternatingSteps
from birthsim_env.parts.hands.vacuum import VacuumPulls
from birthsim_env.parts.scenarios import find_scenario


def course(force, seconds, seed=0, step=0.001):
    """Times (K,) and forces (K, 2) of one lane."""
    force.prepare(1)
    force.begin(0, stream(seed, 0, "user_force"))
    times = np.arange(round(seconds / step) + 1) * step
    return times, force.force(times[:, None], np.zeros((2, 1)), np.zeros((2, 1)))[:, :, 0]


def at(times, rows, instant):
    return rows[np.argmin(np.abs(times - instant))]


def plateaus(times, size):
    """(start, end) of every stretch over which ``size`` keeps its value above zero."""
    steady = (np.abs(np.diff(size)) < 1e-9) & (size[1:] > 1e-9)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], steady.astype(int), [0]])))
    return [(times[a], times[min(b, len(times) - 1)]) for a, b in edges.reshape(-1, 2) if b - a > 5]


def test_the_circle_is_pushed_by_30_newtons_in_two_identical_halves():
    """One axis at a time: a ramp of 0.1 s up, the hold, a ramp of 0.1 s down."""
    times, rows = course(find_scenario("circle").nominal()[1], 16.0)
    expected = np.zeros_like(rows)
    for start, end, push in ((1, 2, (30, 0)), (3, 4, (-30, 0)), (5, 6, (0, 30)), (6.9, 7.7, (0, -30))):
        expected += np.outer(np.interp(times % 8.0, (start, start + 0.1, end, end + 0.1), (0, 1, 1, 0)), push)
    np.testing.assert_allclose(rows, expected, atol=1e-9)


@pytest.mark.parametrize("seed", range(8))
def test_varied_pushes_of_the_circle_stay_within_10_and_40_newtons(seed):
    times, rows = course(find_scenario("circle").varied()[1], 16.0, seed)
    peaks = np.abs([at(times, rows, half + t).sum() for half in (0, 8) for t in (1.5, 3.5, 5.5, 7.3)])
    assert 10 <= peaks.min() < peaks.max() <= 40
    assert len(set(peaks.round(9))) == 8


def test_the_probe_rests_for_three_seconds_ramps_over_one_and_holds():
    times, rows = course(find_scenario("probe").nominal()[1], 7.0)
    np.testing.assert_allclose(rows[:, 0], np.clip(times - 3.0, 0, 1) * 20.0, atol=1e-9)
    np.testing.assert_array_equal(rows[:, 1], 0.0)
    ends = np.array([course(find_scenario("probe").varied()[1], 7.0, seed, step=1.0)[1][-1] for seed in range(200)])
    sizes, turns = np.hypot(*ends.T), np.degrees(np.arctan2(ends[:, 1], ends[:, 0]))
    assert 5 <= sizes.min() < 7
    assert 38 < sizes.max() <= 40
    assert set((turns.round(6) % 360).tolist()) == {0.0, 90.0, 180.0, 270.0}


FORCEPS = [("nominal", 0, (175, 175), (70, 70)), *(("varied", seed, (150, 200), (45, 100)) for seed in range(6))]


@pytest.mark.parametrize(("kind", "seed", "sizes", "rates"), FORCEPS)
def test_forceps_pulls_are_ramped_held_and_released(kind, seed, sizes, rates):
    times, rows = course(getattr(find_scenario("forceps"), kind)()[1], 15.0, seed)
    size = np.hypot(*rows.T)
    held = plateaus(times, size)
    assert len(held) == 2
    previous = 0.0
    for start, end in held:
        top = at(times, size, (start + end) / 2)
        assert sizes[0] - 1e-9 <= top <= sizes[1] + 1e-9
        assert end - start == pytest.approx(2.0, abs=0.003)
        begin = times[(times < start) & (size == 0)].max()
        assert rates[0] * 0.99 <= top / (start - begin) <= rates[1] * 1.01
        assert begin >= (previous + 1.19 if previous else 0.99)
        # Released within 0.3 s, along one line throughout: within 20 degrees of x.
        assert at(times, size, end + 0.15) == pytest.approx(top / 2, rel=0.02)
        assert at(times, size, end + 0.302) == 0.0
        pulled = rows[(times > begin) & (times < end + 0.3) & (size > 1)]
        angles = np.degrees(np.arctan2(pulled[:, 1], pulled[:, 0]))
        assert np.ptp(angles) < 1e-6
        assert np.abs(angles).max() <= 20.0
        previous = end + 0.3
    assert np.abs(rows[times > previous + 0.01]).max() == 0.0


def tops_of(scenario, kind="nominal", seed=0):
    """N. What is held of each pull; at the end nothing is left."""
    times, rows = course(getattr(find_scenario(scenario), kind)()[1], find_scenario(scenario).duration, seed, step=0.01)
    size = np.hypot(*rows.T)
    assert size[-1] == 0.0
    return [at(times, size, (a + b) / 2) for a, b in plateaus(times, size)]


def test_dystocia_pulls_are_those_of_clinicians():
    np.testing.assert_allclose(tops_of("dystocia"), (84, 122, 163))
    tops = np.array([tops_of("dystocia", "varied", seed) for seed in range(20)])
    assert tops.shape == (20, 3)
    assert 75 <= tops.min() <= tops.max() <= 163


@pytest.mark.slow
def test_vacuum_pulls_are_those_of_births_as_far_as_the_rig_holds_them():
    np.testing.assert_allclose(tops_of("vacuum"), (176, 225, 241))
    tops = np.array([tops_of("vacuum", "varied", seed) for seed in range(100)])
    assert tops.shape == (100, 3)
    assert 5 <= tops.min() < 20
    assert tops.max() == pytest.approx(225.0)
    # 34 % of 300 pulls are above 216 N: within three standard deviations of a binomial draw.
    assert abs(np.mean(tops > 216) - 0.34) < 3 * np.sqrt(0.34 * 0.66 / 300)
    fractions = np.array([0.0, 0.33, 0.66, 0.67, 1.0])
    expected = (5.0, 110.5, 216.0, 216 + 236 * 0.01 / 0.34, 225.0)
    np.testing.assert_allclose([VacuumPulls((f,), 70.0).peak(f, None) for f in fractions], expected)


@pytest.mark.parametrize("randomize", [False, True])
def test_the_rig_can_hold_every_vacuum_pull(randomize):
    env = gymnasium.make_vec("BirthSIM/Vacuum-v1", num_envs=200, randomize=randomize)
    env.reset(seed=0)
    assert required_strength_ratio(env).max() < (0.95 if randomize else 0.98)


def contractions_of(kind, seed=0):
    """Size, N, share of the pushes and their number, of both: sin^2, and over its middle half the pushes, each a sin^2."""
    rows, u = course(getattr(find_scenario("descent"), kind)()[1], 24.0, seed, step=0.01)[1], np.arange(1200) / 1200
    np.testing.assert_array_equal(rows[:, 1], 0.0)
    assert rows[-1, 0] == 0.0
    for pull in rows[:2400, 0].reshape(2, 1200):
        fits = []
        for pushes in (4, 5):
            waves = np.sin(np.pi * np.stack([u, pushes * np.clip(2 * u - 0.5, 0, 1)], axis=1)) ** 2
            (slow, fast), rest = np.linalg.lstsq(waves, pull, rcond=None)[:2]
            fits.append((rest.item(), slow + fast, fast / (slow + fast), pushes))
        rest, *found = min(fits)
        assert rest < 1200 * (2e-3 * found[0]) ** 2, "straight lines between knots"
        yield found


def test_contractions_of_40_to_125_newtons_have_4_or_5_pushes():
    sizes, shares, pushes = np.array([one for seed in range(40) for one in contractions_of("varied", seed)]).T
    assert 40 <= sizes.min() < 50 < 115 < sizes.max() <= 125
    np.testing.assert_allclose(shares, 0.25, atol=0.102)
    assert set(pushes) == {4, 5}
    np.testing.assert_allclose([one[:2] for one in contractions_of("nominal")], [(80.0, 0.25)] * 2, rtol=1e-2)


def test_a_profile_is_linear_between_knots_and_constant_outside():
    times, rows = course(ForceProfile([(0.5, 10, 0), (1.0, 0, -20), (1.0, 5, 5), (2.0, 5, 5)]), 3.0, step=0.125)
    expected = [(10, 0), (10, 0), (5, -10), (5, 5), (5, 5), (5, 5)]
    np.testing.assert_allclose([at(times, rows, t) for t in (0.0, 0.5, 0.75, 1.0, 1.5, 3.0)], expected)
    assert np.abs(course(ForceProfile(), 2.0)[1]).max() == 0.0


def test_every_push_of_the_circle_is_a_jump_however_small():
    """2 N over 0.1 s change by 20 N/s, less than a forceps' pull of 45 N/s, which is none."""
    for force, jumps in ((AlternatingSteps(amplitude=2.0), True), (Pulls((90.0,), rate=45.0), False)):
        env = gymnasium.make("BirthSIM/Circle-v2", user_force=force)
        env.reset(seed=0)
        since = [env.step(np.zeros(env.action_space.shape))[4]["since_jump"] for _ in range(115)]
        assert since[98] == pytest.approx(0.99)
        assert since[-1] == pytest.approx(0.05 if jumps else 1.15, abs=2e-3)
