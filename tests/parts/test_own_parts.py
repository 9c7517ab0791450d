"""A user's own reference and hand: functions, files and classes; CSV files, whose heading says which column is which."""

import math

import gymnasium
import numpy as np
import pytest

from baselines.commands.worlds import with_options
from baselines.registry import known_options, split_options
from birthsim_env import Circle, UserForce
from birthsim_env.parts.columns import columns, csv_file
from birthsim_env.parts.own_parts import COURSE, FORCE, Through, trajectory_of

CIRCLE = "BirthSIM/Circle-v1"


def round_about(t):
    return 0.5 + 0.05 * math.cos(math.pi / 2 * t), 0.05 * math.sin(math.pi / 2 * t)


@pytest.mark.parametrize("from_file", [False, True])
def test_a_plain_position_becomes_a_trajectory_with_its_derivatives(from_file, tmp_path):
    """A spline of degree 5 through samples every h: derivative n is off by about h^(6 - n) |f^(6)|, most at the ends."""
    if from_file:
        rows = [(t, *round_about(t)) for t in np.linspace(0, 8, 801)]
        np.savetxt(tmp_path / "circle.csv", rows, "%.17g", ",", header="time,x,y", comments="")
    own = trajectory_of(str(tmp_path / "circle.csv") if from_file else round_about, 8.0)
    true = Circle()
    true.prepare(1), true.begin(0, None)
    for t in (0.0, 0.0123, 3.3337, 7.999, 8.0):
        error = np.abs(own.sample(np.array([t])) - true.sample(np.array([t])))[:, 0]
        assert (error.reshape(4, 2).max(axis=1) < (1e-11, 1e-9, 1e-6, 1e-3)).all()
    after = own.sample(np.array([9.0]))[:, 0]
    np.testing.assert_allclose(after[:2], round_about(8.0), atol=1e-12)
    assert not after[2:].any(), "at rest beyond the end"


@pytest.mark.parametrize("count", range(2, 8))
def test_few_points_are_met(count):
    rng = np.random.default_rng(count)
    times, points = np.cumsum(rng.uniform(0.5, 1, count)), rng.uniform(0.4, 0.6, (count, 2))
    path = Through(times, points)
    for t, point in zip(times, points, strict=True):
        np.testing.assert_allclose(path.sample(np.array([t]))[:2, 0], point, atol=1e-12)


def pushing(time):
    return 5.0 * time, -3.0


def spring(time, position, velocity):
    return 800.0 * (0.55 - position[0]) - 2.0 * velocity[0], 0.0


def with_a_default(time, size=4.0):
    return size, -3.0


class PerLane(UserForce):
    """The same as one force per lane."""

    closed_loop = True

    def force(self, time, position, velocity):
        return np.stack(np.broadcast_arrays(*spring(time, position, velocity)))


@pytest.mark.parametrize("hand", [pushing, with_a_default, spring, PerLane])
def test_a_function_or_a_force_per_lane_is_a_hand(hand):
    env = gymnasium.make_vec(CIRCLE, num_envs=2, user_force=hand)
    env.reset(seed=0)
    for _ in range(20):
        info = env.step(np.zeros((2, 4)))[4]
        for lane in range(2):
            given = (info["time"][lane], info["position"][lane], info["velocity"][lane])
            expected = spring(*given) if hand in (spring, PerLane) else hand(given[0])
            np.testing.assert_allclose(info["user_force"][lane], expected, rtol=1e-12)


OWN = """
import birthsim_env

def along(t):
    return 0.5 + 0.01 * t, 0.0

class Still(birthsim_env.Hold):
    pass
"""


def test_classes_and_functions_of_a_file(tmp_path):
    (tmp_path / "own.py").write_text(OWN, encoding="utf-8")
    env = gymnasium.make(CIRCLE, reference=f"{tmp_path}/own.py:along")
    _, info = env.reset(seed=0)
    np.testing.assert_allclose(info["target"], [0.5, 0.0], atol=1e-12)
    assert type(trajectory_of(f"{tmp_path}/own.py:Still", 1.0)).__name__ == "Still"


def test_set_goes_to_those_that_have_it():
    gain = known_options("pid")[0]
    assert with_options(["pid", "backstepping"], [f"{gain}=3"]) == [f"pid[{gain}=3]", "backstepping"]
    assert with_options(["backstepping[sign_width=0.01]"], ["pneumatic_gain=80"]) == [
        "backstepping[sign_width=0.01,pneumatic_gain=80]"
    ]
    with pytest.raises(ValueError, match=r"--set 'gain=3'; allowed for pid: .*; shut-valves: nothing"):
        with_options(["pid", "shut-valves"], ["gain=3"])
    with pytest.raises(ValueError, match=r"--set 'gain'; allowed: GAIN=VALUE"):
        with_options(["pid"], ["gain"])


def test_a_name_carries_options():
    assert split_options("pid[bandwidth=60,valves=one,on=true]") == ("pid", {"bandwidth": 60.0, "valves": "one", "on": True})
    assert split_options("pid") == ("pid", {})


PUSH = {
    "in order": ("time,Fx,Fy\n0,1,-2\n1,3,-4\n", ""),
    "no heading": ("0,1,-2\n1,3,-4\n", ""),
    "turned": ("time,Fy,Fx\n0,-2,1\n1,-4,3\n", ""),
    "with units and more": ("marker,Fy [N],TIME (s),fx(N)\n7,-2,0,1\n8,-4,1,3\n", ""),
    "as NumPy writes it": ("# Fx, time, Fy\n1,0,-2\n3,1,-4\n", ""),
    "a remark before": ("# my hand\n\ntime,Fx,Fy\n0,1,-2\n# break\n1,3,-4\n", ""),
    "other names": ("t,a,b,c\n0,9,-2,1\n1,9,-4,3\n", ":t,c,b"),
}


@pytest.mark.parametrize(("text", "names"), PUSH.values(), ids=PUSH)
def test_a_heading_names_the_columns_in_any_order(text, names, tmp_path):
    (tmp_path / "push.csv").write_text(text, encoding="utf-8")
    found = columns("user_force", csv_file(f"{tmp_path}/push.csv{names}"), FORCE, tuple(FORCE))
    np.testing.assert_array_equal(found, [[0.0, 1.0, -2.0], [1.0, 3.0, -4.0]])


WRONG = {
    "milliseconds": ("time_ms,Fx,Fy\n0,1,2\n1,1,2\n", "", "'time'"),
    "another unit": ("time (ms),Fx,Fy\n0,1,2\n1,1,2\n", "", "'time' in ms, not in s"),
    "kilonewtons": ("time,Fx [kN],Fy\n0,1,2\n1,1,2\n", "", "'Fx' in kN, not in N"),
    "twice": ("time,Fx,Fx,Fy\n0,1,2,3\n1,1,2,3\n", "", "'Fx' 2 times"),
    "semicolons": ("time;Fx;Fy\n0;1;2\n1;1;2\n", "", "separated by commas"),
    "too few names": ("t,a,b\n0,1,2\n1,1,2\n", ":t,a", "one for each of"),
    "a name that is not there": ("t,a,b\n0,1,2\n1,1,2\n", ":t,a,d", "'d' 0 times"),
    "names without a heading": ("0,1,2\n1,1,2\n", ":t,a,b", "t, a, b"),
    "a short line": ("time,Fx,Fy\n0,1,2\n1,1\n", "", "line 3"),
    "time that goes back": ("Fx,time,Fy\n0,1,2\n1,0.5,2\n", "", "line 3"),
}


@pytest.mark.parametrize(("text", "names", "allowed"), WRONG.values(), ids=WRONG)
def test_what_a_file_does_not_say_is_refused(text, names, allowed, tmp_path):
    (tmp_path / "push.csv").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match="user_force = ") as caught:
        columns("user_force", csv_file(f"{tmp_path}/push.csv{names}"), FORCE, tuple(FORCE))
    assert allowed in str(caught.value)
    assert "allowed: " in str(caught.value)


def test_a_stiffness_needs_no_course_beside_it_once_it_is_named(tmp_path):
    (tmp_path / "own.csv").write_text("stiffness,time\n1000,0\n2000,1\n", encoding="utf-8")
    file = csv_file(tmp_path / "own.csv")
    np.testing.assert_array_equal(columns("stiffness", file, COURSE, ("time", "stiffness")), [[0, 1000], [1, 2000]])
    assert csv_file("own.py:Name") is None
    assert csv_file(3.0) is None


def test_a_hand_of_a_file_pushes_as_it_says_between_its_rows_too(tmp_path):
    (tmp_path / "push.csv").write_text("time,Fy,Fx\n0,0,10\n20,-2,10\n", encoding="utf-8")
    env = gymnasium.make(CIRCLE, user_force=f"{tmp_path}/push.csv", policy_period=1.0)
    env.reset(seed=0)
    np.testing.assert_allclose(env.step(np.zeros(4))[4]["user_force"], [10.0, -0.1])
