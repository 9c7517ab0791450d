"""Trajectories through points and functions: they stay between their points, and go smoothly from one to the other."""

import math

import gymnasium
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import PchipInterpolator

from birthsim_env import Parameters
from birthsim_env.parts.courses import HASTE, check_points
from birthsim_env.parts.own_parts import trajectory_of
from birthsim_env.parts.points import CLOSEST, Sampled, Through

CIRCLE = "BirthSIM/Circle-v2"
COORDINATES = st.sampled_from((0.4, 0.45, 0.5, 0.53)) | st.floats(-1.0, 1.0, allow_subnormal=False)
ROWS = st.lists(st.tuples(st.floats(1e-2, 50.0), COORDINATES, COORDINATES), min_size=2, max_size=12)
RAMP_AND_HOLD = [(0, 0.5), (1, 0.5), (2, 0.53), (3, 0.53), (4, 0.53), (5, 0.5), (6, 0.5)]


def through(rows, **options):
    rows = np.array(rows, dtype=float)
    return Through(rows[:, 0], np.column_stack([rows[:, 1], rows[:, 2] if rows.shape[1] > 2 else 0 * rows[:, 1]]), **options)


@settings(max_examples=100, deadline=None)
@given(ROWS)
def test_between_two_points_it_is_monotone_and_between_them_as_pchip(rows):
    """Not only the whole: every interval has the bounds of SciPy's monotone interpolation of degree 3."""
    times, points = np.cumsum([row[0] for row in rows]), np.array([row[1:] for row in rows])
    path, pchip = Through(times, points), PchipInterpolator(times, points)
    for first, last, a, b in zip(times, times[1:], points, points[1:], strict=False):
        instants = np.clip(np.linspace(first, last, 40), first, last)
        position, bounds = path.sample(instants)[:2].T, np.sort(pchip([first, last]), axis=0)
        assert (position >= bounds[0] - 1e-14).all()
        assert (position <= bounds[1] + 1e-14).all()
        assert (np.diff(position, axis=0) * np.sign(b - a) >= -1e-14).all()


@settings(max_examples=60, deadline=None)
@given(ROWS)
def test_position_velocity_and_acceleration_are_continuous_and_derivatives_of_each_other(rows):
    times, points = np.cumsum([row[0] for row in rows]), np.array([row[1:] for row in rows])
    path, h = Through(times, points), np.diff(times)
    way = np.abs(np.diff(points, axis=0)).max(axis=1) + 1e-6
    # The n-th derivative of an interval is some way / h^n; 1e-6 m stand for what rounding makes of a hold.
    sizes = np.repeat([way / h**order for order in range(4)], 2, axis=0)
    before, now = path.sample(np.nextafter(times[1:-1], -np.inf)), path.sample(times[1:-1])
    assert (np.abs(now - before)[:6] <= 1e-6 * np.maximum(sizes[:, :-1], sizes[:, 1:])[:6]).all()
    middle, step = times[:-1] + 0.3 * h, 1e-4 * h
    slope = (path.sample(middle + step) - path.sample(middle - step))[:6] / (2 * step)
    assert (np.abs(slope - path.sample(middle)[2:]) <= 1e-4 * sizes[2:]).all()


def test_a_hold_is_held_and_the_band_of_the_points_never_left():
    for rows in (RAMP_AND_HOLD, [(0, 0.5), (0.1, 0.505)], [(0, 0.5), (1, 0.5), (1.001, 0.501), (9, 0.501)]):
        path = through(rows)
        x = path.sample(np.linspace(-1.0, 10.0, 5001))[0]
        assert x.min() == min(row[1] for row in rows)
        assert x.max() <= max(row[1] for row in rows) + 1e-15
    held = through(RAMP_AND_HOLD).sample(np.linspace(2.0, 4.0, 101))
    np.testing.assert_array_equal(held[0], 0.53)
    assert not held[2:6].any()


def test_a_ramp_between_holds_is_a_minimum_jerk_passage():
    u = np.linspace(0.0, 1.0, 21)
    position = through(RAMP_AND_HOLD).sample(1.0 + u)[0]
    np.testing.assert_allclose(position, 0.5 + 0.03 * u**3 * (10 - 15 * u + 6 * u**2), atol=1e-15)


@pytest.mark.parametrize("shift", [0.0, 0.0037])
def test_points_of_a_smooth_motion_are_followed_within_what_the_band_allows(shift):
    """An extreme between two rows is cut to the higher one, a h^2 / 8 at most; its speed is off by a h."""
    h, w = 0.01, math.pi / 2
    times = np.arange(0.0, 8.0 + h / 2, h)
    angle, fine = w * (times + shift), np.linspace(0.0, 8.0, 7919)
    path = Through(times, np.column_stack([0.5 + 0.05 * np.cos(angle), 0.05 * np.sin(angle)]))
    own, true = path.sample(fine), w * (fine + shift)
    assert np.abs(own[0] - 0.5 - 0.05 * np.cos(true)).max() < 0.05 * w * w * h * h / 8
    assert np.abs(own[2] + 0.05 * w * np.sin(true)).max() < 0.05 * w * w * h


def test_rows_that_end_within_the_episode_come_to_rest_smoothly():
    path = through([(1.0, 0.5), (2.0, 0.52), (3.0, 0.54)], episode=8.0)
    at_ends = path.sample(np.array([1.0, 3.0]))
    np.testing.assert_array_equal(at_ends[2:6], 0.0)
    np.testing.assert_allclose(at_ends[0], [0.5, 0.54])
    moving = through([(0.0, 0.5), (2.0, 0.52), (4.0, 0.54), (9.0, 0.6)], episode=8.0).sample(np.zeros(1))
    assert moving[2, 0] == pytest.approx(0.01, rel=0.1), "rows that begin with the episode may begin in motion"


REFUSED = [
    ([], np.empty((0, 2)), "times = []"),
    ([0.0], [[0.5, 0.0]], "times = [0.0]"),
    (3.0, [[0.5, 0.0]], "times = 3.0"),
    ("ab", [[0.5, 0.0]] * 2, "times = 'ab'"),
    ([0, math.nan], [[0.5, 0.0]] * 2, "times[1] = nan"),
    ([0, 10**400], [[0.5, 0.0]] * 2, "times = "),
    ([0, 1e300], [[0.5, 0.0]] * 2, "times[1] = 1e+300"),
    ([0, 0], [[0.5, 0.0]] * 2, "times[1] = 0 after 0 s"),
    ([0, 2, 1], [[0.5, 0.0]] * 3, "times[2] = 1 after 2 s"),
    ([1e9, 1e9 + 1e-12], [[0.5, 0.0]] * 2, "times[1] = 1000000000 after"),
    ([0, CLOSEST / 2], [[0.5, 0.0]] * 2, "times[1]"),
    ([0, 1], [[0.5, math.inf]] * 2, "positions[0, 1] = inf"),
    ([0, 1], [[0.5, 1e300]] * 2, "positions[0, 1] = 1e+300"),
    ([0, 1], [0.5, 0.0], "positions has shape (2,)"),
    ([0, 1, 2], [[0.5, 0.0]] * 2, "positions has shape (2, 2)"),
]


@pytest.mark.parametrize(("times", "positions", "words"), REFUSED)
def test_points_that_are_none_are_refused(times, positions, words):
    with pytest.raises(ValueError, match="; allowed: ") as caught:
        Through(times, positions)
    assert words in str(caught.value)


def test_points_of_a_file_that_are_none_name_it(tmp_path):
    (tmp_path / "far.csv").write_text("time,x,y\n0,0.5,0\n1,500,0\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"reference = '.*far.csv': positions\[1, 0\] = 500; allowed: -10 to 10 \(m\)"):
        trajectory_of(tmp_path / "far.csv", 16.0)


def test_whole_numbers_and_lists_are_points():
    path = Through([0, 1, 3], [[0, 1], [0, 2], [0, 2]])
    np.testing.assert_array_equal(path.sample(np.array([1.0, 2.0]))[:2], [[0, 0], [2, 2]])


def test_a_jump_too_fast_for_the_rig_names_its_rows_and_the_way_out(tmp_path):
    (tmp_path / "jump.csv").write_text("time,x,y\n0,0.5,0\n1,0.5,0\n1.001,0.52,0\n8,0.52,0\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"rows 2 and 3") as caught:
        gymnasium.make(CIRCLE, reference=str(tmp_path / "jump.csv"))
    words = (
        "reference = ",
        "jump.csv",
        "(0.5, 0) m at 1 s",
        "(0.52, 0) m at 1.001 s",
        "20 m/s",
        "allowed: up to 1.89 m/s",
        "0.011 s",
    )
    assert all(word in str(caught.value) for word in words), caught.value
    # With as much time as it says, the same way is one that the rig is asked to go; as it is where the episode ends before.
    check_points("reference", through([(0, 0.5), (1, 0.5), (1.0107, 0.52), (8, 0.52)]), 16.0, Parameters())
    check_points("reference", through([(0, 0.5), (1, 0.5), (1.001, 0.52), (8, 0.52)]), 0.5, Parameters())


def test_the_speed_that_points_may_ask_for_is_that_of_air_through_a_choked_valve():
    rig = Parameters()
    exhausted = rig.valves.sonic_conductance * 1.185 * 287.05 * 293.15 / rig.cylinder2.area_n
    for factor, refused in ((0.999, False), (1.001, True)):
        path = through([(0, 0.5), (0.01, 0.5 + HASTE * factor * exhausted * 0.01)])
        if refused:
            with pytest.raises(ValueError, match="piston 2"):
                check_points("reference", path, 1.0, rig)
        else:
            check_points("reference", path, 1.0, rig)


def test_a_point_out_of_reach_names_its_row_where_the_episode_gets_there():
    rows = [(0, 0.5), (1, 0.5), (2, 1.5), (8, 0.52)]
    with pytest.raises(ValueError, match=r"reference at 2 s \(row 3\): position = \(1.5, 0\) m is unreachable; allowed"):
        check_points("reference", through(rows), 16.0, Parameters())
    check_points("reference", through(rows), 0.5, Parameters())


def step(time):
    return 0.5 + 0.02 * (time > 1.003), 0.0


def square(time):
    return 0.5, 0.01 * math.copysign(1.0, math.sin(3.0 * time))


@pytest.mark.parametrize(
    ("function", "words"), [(step, "from (0.5, 0) m at 1 s to (0.52, 0) m at 1.01 s,"), (square, "more places")]
)
def test_a_function_with_a_step_is_warned_of_and_stays_between_its_values(function, words):
    with pytest.warns(UserWarning, match="reference: the function steps") as caught:
        path = trajectory_of(function, 4.0)
    assert len(caught) == 1
    assert words in str(caught[0].message)
    values = np.array([function(t) for t in np.arange(0, 4, 0.001)])
    own = path.sample(np.linspace(0.0, 4.0, 20001))[:2]
    # A polynomial through its values alone would swing a tenth of the step beyond them.
    assert (own.min(axis=1) >= values.min(axis=0) - 1e-4).all()
    assert (own.max(axis=1) <= values.max(axis=0) + 1e-4).all()
    check_points("reference", path, 4.0, Parameters())


def test_a_smooth_function_passes_its_values_where_it_does(recwarn):
    path = Sampled(lambda time: np.array([0.5 + 0.05 * math.cos(1.57 * (time - 0.003)), 0.0]), 4.0)
    assert path.sample(np.array([0.003]))[0, 0] == pytest.approx(0.55, abs=1e-11)
    assert not recwarn


@pytest.mark.parametrize("frequency", [60.0, 100.0, 200.0, 400.0])
def test_a_sine_that_is_zero_at_every_value_is_seen_between_them(frequency: float) -> None:
    with pytest.warns(UserWarning, match="reference: the function steps"):
        Sampled(lambda t: np.array([0.5 + 0.01 * np.sin(2 * np.pi * frequency * t), 0.0]), 2.0)
