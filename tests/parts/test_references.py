"""Reference trajectories: derivatives that fit together, paths that end where geometry says, what is unreachable refused."""

import math

import gymnasium
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from birthsim_env import Circle, FixedTarget, Parameters, Path, Trajectory
from birthsim_env.parts.courses import check_drawn
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.parts.position_steps import PositionSteps
from birthsim_env.parts.scenarios import environment_id, find_scenario, scenarios_for
from birthsim_env.physics.linkage.geometry import end_effector
from birthsim_env.registry import names
from tests.fuzz.rigs import odd_rig

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


BUILT_IN = [(name, kind) for name in names("scenario") for kind in ("nominal", "varied")]


@pytest.mark.parametrize(("name", "kind"), BUILT_IN)
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_derivatives_of_every_scenario_fit_together(name, kind, seed):
    scenario = find_scenario(name)
    trajectory = prepared(getattr(scenario, kind)()[0], seed=seed)
    times = np.linspace(0.003, scenario.duration - 0.003, 1201)
    if isinstance(trajectory, Path):
        # Documented steps: of jerk at start and end, and of acceleration where the line meets the arc.
        start, length, arc = trajectory._own[:2, 0], trajectory._own[3, 0], trajectory._own[5, 0] != 0
        gone = np.linalg.norm(sampled(trajectory, times)[:2].T - start, axis=1)
        edges = [trajectory.begins, trajectory.ends] + ([times[np.argmax(gone > length)]] if arc else [])
        times = times[np.abs(times[:, None] - edges).min(axis=1) > 0.03]
    if isinstance(trajectory, PositionSteps):  # steps of jerk where a move starts and ends
        edges = np.add.outer(trajectory.starts, [0.0, trajectory.lasts]).ravel()
        times = times[np.abs(times[:, None] - edges).min(axis=1) > 0.001]
    assert_consistent(trajectory, times)


LINES_AND_ARCS = {
    "heading": st.floats(-3.2, 3.2), "length": st.floats(0.0, 0.1), "radius": st.floats(0.04, 0.1), "angle": st.floats(-2, 2),
    "begins": st.floats(0, 2), "lasts": st.floats(0.5, 5.0), "u": st.floats(-0.2, 1.2),
}  # fmt: skip


@given(**LINES_AND_ARCS)
def test_a_path_is_a_line_and_an_arc_at_minimum_jerk(heading, length, radius, angle, begins, lasts, u):
    path = prepared(Path((0.5, 0.01), heading, length, radius, angle, begins, begins + lasts))
    s = min(max(u, 0.0), 1.0)
    gone = (length + radius * abs(angle)) * (10 * s**3 - 15 * s**4 + 6 * s**5)
    forward = np.exp(1j * heading)
    # The arc turns about a centre to the left for positive angles, to the right for negative ones.
    corner, aside = 0.5 + 0.01j + length * forward, math.copysign(radius, angle) * 1j * forward
    turned = corner + aside - aside * np.exp(1j * math.copysign((gone - length) / radius, angle))
    rows = sampled(path, [begins + u * lasts])[:, 0]
    assert complex(*rows[:2]) == pytest.approx(turned if gone > length else 0.5 + 0.01j + gone * forward, abs=1e-12)
    if s != u:
        np.testing.assert_allclose(rows[2:], 0.0, atol=1e-9)


@pytest.mark.parametrize(("period", "radius"), [(4.0, 0.05), (-4.0, 0.05), (2.5, 0.03)])
def test_a_circle_has_its_radius_and_its_sense(period, radius):
    circle, times = prepared(Circle((0.5, -0.01), radius, period)), np.linspace(0.0, abs(period), 33)
    turned = 2 * math.pi * times / period
    place = 0.5 + radius * np.cos(turned), -0.01 + radius * np.sin(turned)
    np.testing.assert_allclose(sampled(circle, times)[:2], place, atol=1e-12)
    assert_consistent(circle, times)


def boundary_margin(x, y):
    """Distance (m) by which points (x, y) lie inside the workspace, from its boundary drawn with the DIRECT model."""
    radius, angle = np.hypot(x, y), np.arctan2(y, x)
    tilt = [math.atan2(*end_effector((end, 0.0), RIG)[::-1]) for end in (-0.1, 0.1)]
    along, across = (RADIUS["most"] - radius, radius - RADIUS["least"]), (max(tilt) - angle, angle - min(tilt))
    return np.stack([*along, *(radius * aside for aside in across)]).min(axis=0)


@pytest.mark.parametrize("kind", ["nominal", "varied"])
def test_descent_is_ten_centimetres_of_line_and_the_arc_of_the_design(kind):
    lanes = 300 if kind == "varied" else 1
    path = prepared(getattr(find_scenario("descent"), kind)()[0], lanes)
    length, radius, angle = path._own[3], path._own[4], np.degrees(path._own[5])
    np.testing.assert_allclose(length, 0.10)
    for values, low, high in ((radius, 0.06, 0.08), (angle, 70.0, 90.0)):
        assert low <= values.min() <= values.max() <= high
        assert kind == "nominal" or np.ptp(values) > 0.97 * (high - low)
    # Measured on the path itself: its length, and the turn of its heading at the end.
    times = np.linspace(0.0, 24.0, 1501)
    points = np.stack([path.sample(np.full(lanes, t))[:2] for t in times])
    walked = np.linalg.norm(np.diff(points, axis=0), axis=1).sum(axis=0)
    np.testing.assert_allclose(walked, 0.10 + radius * np.radians(angle), rtol=1e-4)
    assert boundary_margin(points[:, 0], points[:, 1]).min() > 0.0


@pytest.mark.parametrize("name", names("scenario"))
def test_every_varied_draw_is_reachable_all_the_way(name):
    lanes, scenario = 500, find_scenario(name)
    trajectory = prepared(scenario.varied()[0], lanes, seed=1000)
    points = np.stack([trajectory.sample(np.full(lanes, t))[:2] for t in np.linspace(0, scenario.duration, 400)])
    assert boundary_margin(points[:, 0], points[:, 1]).min() > 0.0


class Wave(Trajectory):
    """What a user writes: a sine about the centre."""

    def prepare(self, num_envs):
        self.phase = np.zeros(num_envs)

    def begin(self, lane, rng):
        self.phase[lane] = rng.uniform(0, 1)

    def sample(self, time):
        rows = np.zeros((8, len(time)))
        rows[::2] = [0.04 * np.sin(time + self.phase + order * math.pi / 2) for order in range(4)]
        rows[0] += 0.5
        return rows


def test_a_users_own_trajectory_serves_one_lane_and_many():
    assert_consistent(prepared(Wave()), np.linspace(0.1, 6, 50))
    many = gymnasium.make_vec("BirthSIM/Probe-v3", num_envs=3, reference=Wave())
    one = gymnasium.make("BirthSIM/Probe-v3", reference=Wave())
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


@pytest.mark.parametrize("scenario", scenarios_for(Parameters()))
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
    trajectory = FixedTarget(((0.4, 0.6), (-0.1, 0.06)))
    trajectory.prepare(3)
    trajectory.begin(1, np.random.default_rng(0))
    before = trajectory.sample(np.zeros(3))
    check_drawn(trajectory, 5.0, Parameters())
    np.testing.assert_array_equal(trajectory.sample(np.zeros(3)), before)
