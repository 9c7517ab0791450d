"""Reference trajectories: derivatives that fit together, paths that end where geometry says, what is unreachable refused."""

import math

import gymnasium
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from birthsim_env import Circle, Hold, Parameters, Path, Trajectory
from birthsim_env.parts.courses import check_drawn
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.parts.scenarios import SCENARIOS, environment_id
from birthsim_env.physics.geometry import end_effector
from studies.fuzz.odd_rigs import odd_rig

RIG = Parameters()
RADIUS = {"least": 0.3, "most": 0.7}
"""m. Distances from pivot 2 that cylinder 2 reaches: k2 +- half its stroke."""


def prepared(trajectory, lanes=1, seed=0):
    trajectory.prepare(lanes)
    for lane in range(lanes):
        trajectory.begin(lane, stream(seed + lane, 0, "reference"))
    return trajectory


def sampled(trajectory, times):
    """(8, len(times)) of lane 0, one instant per call."""
    return np.stack([trajectory.sample(np.array([t]))[:, 0] for t in np.atleast_1d(times)], axis=1)


def assert_consistent(trajectory, times, step=1e-4):
    """Every derivative row is the central difference of the rows before it, to 1e-5 of its largest value."""
    before, at, after = (sampled(trajectory, times + shift) for shift in (-step, 0.0, step))
    for row in range(6):
        slope = (after[row] - before[row]) / (2 * step)
        size = max(np.abs(at[row + 2]).max(), 1e-6)
        np.testing.assert_allclose(at[row + 2], slope, atol=1e-5 * size + 1e-9 / step, err_msg=f"row {row + 2}")


BUILT_IN = [(name, kind) for name in SCENARIOS for kind in ("nominal", "varied")]


@pytest.mark.parametrize(("name", "kind"), BUILT_IN)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_derivatives_of_every_scenario_fit_together(name, kind, seed):
    scenario = SCENARIOS[name]
    trajectory = prepared(getattr(scenario, kind)()[0], seed=seed)
    times = np.linspace(0.003, scenario.duration - 0.003, 1201)
    if isinstance(trajectory, Path):
        # Documented steps: of jerk at start and end, and of acceleration where the line meets the arc.
        start, length, arc = trajectory._own[:2, 0], trajectory._own[3, 0], trajectory._own[5, 0] != 0
        gone = np.linalg.norm(sampled(trajectory, times)[:2].T - start, axis=1)
        edges = [trajectory.begins, trajectory.ends] + ([times[np.argmax(gone > length)]] if arc else [])
        times = times[np.abs(times[:, None] - edges).min(axis=1) > 0.03]
    assert_consistent(trajectory, times)


@given(
    st.floats(-3.2, 3.2), st.floats(0.0, 0.1), st.floats(0.04, 0.1), st.floats(-2.0, 2.0), st.floats(0.5, 5.0), st.floats(0, 2)
)  # fmt: skip
def test_a_path_ends_where_line_and_arc_lead(heading, length, radius, angle, lasts, begins):
    path = prepared(Path((0.5, 0.01), heading, length, radius, angle, begins, begins + lasts))
    forward, left = np.exp(1j * heading), 1j * np.exp(1j * heading)
    corner = 0.5 + 0.01j + length * forward
    # The arc turns about a centre to the left for positive angles, to the right for negative ones.
    centre = corner + math.copysign(radius, angle) * left
    end = centre + (corner - centre) * np.exp(1j * angle)
    rows = sampled(path, [0.0, begins, begins + lasts, begins + lasts + 1.0])
    reached = rows[0] + 1j * rows[1]
    np.testing.assert_allclose(reached, [0.5 + 0.01j, 0.5 + 0.01j, end, end], atol=1e-12)
    np.testing.assert_allclose(rows[2:], 0.0, atol=1e-9)


@given(st.floats(0.05, 0.95), st.sampled_from([-1.3, 0.9]))
def test_a_path_covers_its_length_at_minimum_jerk_and_heads_along_it(u, angle):
    path = prepared(Path((0.5, 0.0), 0.3, 0.05, 0.06, angle, 0.0, 4.0))
    total = 0.05 + 0.06 * abs(angle)
    x, y, vx, vy, ax, ay = sampled(path, [4.0 * u])[:6, 0]
    gone = total * (10 * u**3 - 15 * u**4 + 6 * u**5)
    speed = total * 30 * u**2 * (1 - u) ** 2 / 4.0
    turned = math.copysign(max(gone - 0.05, 0.0) / 0.06, angle)
    assert math.hypot(vx, vy) == pytest.approx(speed, rel=1e-9)
    assert math.atan2(vy, vx) == pytest.approx(0.3 + turned, abs=1e-9)
    curvature = math.copysign(1 / 0.06, angle) if gone > 0.05 else 0.0
    assert vx * ay - vy * ax == pytest.approx(curvature * speed**3, abs=1e-12)
    if gone <= 0.05:
        assert (x, y) == pytest.approx((0.5 + gone * math.cos(0.3), gone * math.sin(0.3)), abs=1e-12)


@pytest.mark.parametrize(("period", "radius"), [(4.0, 0.05), (-4.0, 0.05), (2.5, 0.03)])
def test_a_circle_closes_keeps_its_radius_and_its_sense(period, radius):
    circle = prepared(Circle((0.5, -0.01), radius, period))
    times = np.linspace(0.0, abs(period), 33)
    rows = sampled(circle, times)
    np.testing.assert_allclose(rows[:, 0], rows[:, -1], atol=1e-9)
    np.testing.assert_allclose(rows[:2, 0], (0.5 + radius, -0.01), atol=1e-12)
    np.testing.assert_allclose(np.hypot(rows[0] - 0.5, rows[1] + 0.01), radius)
    np.testing.assert_allclose(np.hypot(rows[2], rows[3]), 2 * math.pi * radius / abs(period))
    assert rows[1, 8] == pytest.approx(-0.01 + math.copysign(radius, period))


def test_hold_stays():
    rows = sampled(prepared(Hold((0.45, 0.02))), np.linspace(0, 9, 30))
    np.testing.assert_array_equal(rows[:2].T - (0.45, 0.02), np.zeros((30, 2)))
    np.testing.assert_array_equal(rows[2:], 0.0)


def boundary_margin(x, y):
    """Distance (m) by which points (x, y) lie inside the workspace, from its boundary drawn with the DIRECT model."""
    radius, angle = np.hypot(x, y), np.arctan2(y, x)
    tilt = [math.atan2(*end_effector((end, 0.0), RIG)[::-1]) for end in (-0.1, 0.1)]
    along, across = (RADIUS["most"] - radius, radius - RADIUS["least"]), (max(tilt) - angle, angle - min(tilt))
    return np.stack([*along, *(radius * aside for aside in across)]).min(axis=0)


@pytest.mark.parametrize("kind", ["nominal", "varied"])
def test_descent_is_ten_centimetres_of_line_and_the_arc_of_the_design(kind):
    lanes = 300 if kind == "varied" else 1
    path = prepared(getattr(SCENARIOS["descent"], kind)()[0], lanes)
    own = path._own
    length, radius, angle = own[3], own[4], np.degrees(own[5])
    np.testing.assert_allclose(length, 0.10)
    limits = {"radius": (radius, 0.06, 0.08), "angle": (angle, 70.0, 90.0)}
    for name, (values, low, high) in limits.items():
        assert low <= values.min(), name
        assert values.max() <= high, name
        if kind == "varied":
            assert np.ptp(values) > 0.97 * (high - low), name
    # Measured on the path itself: its length, and the turn of its heading at the end.
    times = np.linspace(0.0, 24.0, 1501)
    points = np.stack([path.sample(np.full(lanes, t))[:2] for t in times])
    walked = np.linalg.norm(np.diff(points, axis=0), axis=1).sum(axis=0)
    np.testing.assert_allclose(walked, 0.10 + radius * np.radians(angle), rtol=1e-4)
    assert boundary_margin(points[:, 0], points[:, 1]).min() > 0.0


@pytest.mark.parametrize("name", SCENARIOS)
def test_every_varied_draw_is_reachable_all_the_way(name):
    lanes, scenario = 500, SCENARIOS[name]
    trajectory = prepared(scenario.varied()[0], lanes, seed=1000)
    points = np.stack([trajectory.sample(np.full(lanes, t))[:2] for t in np.linspace(0, scenario.duration, 400)])
    assert boundary_margin(points[:, 0], points[:, 1]).min() > 0.0


class Lissajous(Trajectory):
    """What a user writes: two sines about the centre."""

    def prepare(self, num_envs):
        self.phase = np.zeros(num_envs)

    def begin(self, lane, rng):
        self.phase[lane] = rng.uniform(0, 1)

    def sample(self, time):
        rows = []
        for order in range(4):
            turn = order * math.pi / 2
            rows += [0.04 * np.sin(time + self.phase + turn), 0.02 * 2**order * np.sin(2 * time + turn)]
        return np.array(rows) + np.array([0.5, 0, 0, 0, 0, 0, 0, 0])[:, None]


def test_a_users_own_trajectory_serves_one_lane_and_many():
    assert_consistent(prepared(Lissajous()), np.linspace(0.1, 6, 50))
    many = gymnasium.make_vec("BirthSIM/Probe-v2", num_envs=3, reference=Lissajous())
    one = gymnasium.make("BirthSIM/Probe-v2", reference=Lissajous())
    _, infos = many.reset(seed=20)
    one.reset(seed=22)
    np.testing.assert_allclose(infos["tracking_error"], 0.0, atol=1e-12)
    for _ in range(20):
        (rows, *_, infos), (row, *_) = many.step(np.zeros((3, 4))), one.step(np.zeros(4))
        np.testing.assert_array_equal(rows[2], row)
    phases = np.array([stream(20 + lane, 0, "reference").uniform(0, 1) for lane in range(3)])
    np.testing.assert_allclose(infos["target"][:, 0], 0.5 + 0.04 * np.sin(0.2 + phases))


LATE = (116, 243)
"""Seeds of odd rigs whose first episodes were reachable, and later ones not."""


def made(name, seed):
    """An environment of an odd rig that has begun, or in words why there is none."""
    rig = Parameters.from_dict(odd_rig(seed))
    try:
        env = gymnasium.make_vec(name, num_envs=64, parameters=rig, randomize="scenario", autoreset_mode="SameStep")
        env.reset(seed=0)
    except ValueError as error:
        return str(error)
    return env


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_an_odd_rig_that_is_taken_reaches_every_later_episode(scenario):
    found = [made(environment_id(scenario), seed) for seed in (*LATE, *range(24))]
    words = [one for one in found if isinstance(one, str)]
    assert all("of one that can be drawn: position" in one or "can carry" in one for one in words)
    taken = [one for one in found if not isinstance(one, str)]
    assert taken
    for env in taken:
        for _ in range(8):
            env.reset()


def test_a_trajectory_that_is_checked_stays_as_it_was():
    trajectory = Hold(((0.4, 0.6), (-0.1, 0.06)))
    trajectory.prepare(3)
    trajectory.begin(1, np.random.default_rng(0))
    before = trajectory.sample(np.zeros(3))
    check_drawn(trajectory, 5.0, Parameters())
    np.testing.assert_array_equal(trajectory.sample(np.zeros(3)), before)
