"""A user's own reference and hand: functions, files and classes; options of controllers."""

import math

import gymnasium
import numpy as np
import pytest

from baselines.commands.worlds import with_options
from baselines.registry import known_options, make_controller, split_options
from birthsim_env import Circle, Parameters, UserForce
from birthsim_env.parts.own_parts import Through, hand_of, trajectory_of

CIRCLE = "BirthSIM/Circle-v1"


def round_about(t):
    return 0.5 + 0.05 * math.cos(math.pi / 2 * t), 0.05 * math.sin(math.pi / 2 * t)


@pytest.mark.parametrize("from_file", [False, True])
def test_a_plain_position_becomes_a_trajectory_with_its_derivatives(from_file, tmp_path):
    """A spline of degree 5 through samples every h: derivative n is off by about h^(6 - n) |f^(6)|, most at the ends."""
    times = np.linspace(0, 8, 801)
    if from_file:
        lines = ["time,x,y", *(f"{t!r},{x!r},{y!r}" for t, (x, y) in ((float(t), round_about(t)) for t in times))]
        (tmp_path / "circle.csv").write_text("\n".join(lines), encoding="utf-8")
    own = trajectory_of(str(tmp_path / "circle.csv") if from_file else round_about, 8.0)
    true = Circle()
    true.prepare(1), true.begin(0, None)
    for t in (0.0, 0.0123, 3.3337, 7.999, 8.0):
        error = np.abs(own.sample(np.array([t])) - true.sample(np.array([t])))[:, 0]
        assert error[:2].max() < 1e-11
        assert error[2:4].max() < 1e-9
        assert error[4:6].max() < 1e-6
        assert error[6:].max() < 1e-3
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


def test_the_environment_takes_them_as_it_takes_its_own():
    env, own = gymnasium.make(CIRCLE), gymnasium.make(CIRCLE, reference=round_about)
    env.reset(seed=0), own.reset(seed=0)
    for _ in range(100):
        one, other = env.step(np.zeros(4)), own.step(np.zeros(4))
        np.testing.assert_allclose(one[4]["target"], other[4]["target"], atol=1e-9)


def pushing(time):
    return 5.0 * time, -3.0


def spring(time, position, velocity):
    return 800.0 * (0.55 - position[0]) - 2.0 * velocity[0], 0.0


class PerLane(UserForce):
    """The same as one force per lane."""

    closed_loop = True

    def force(self, time, position, velocity):
        return np.stack(np.broadcast_arrays(*spring(time, position, velocity)))


@pytest.mark.parametrize("hand", [pushing, spring, PerLane])
def test_a_function_or_a_force_per_lane_is_a_hand(hand):
    env = gymnasium.make_vec(CIRCLE, num_envs=2, user_force=hand)
    _, info = env.reset(seed=0)
    for _ in range(20):
        _, _, _, _, info = env.step(np.zeros((2, 4)))
        for lane in range(2):
            given = (info["time"][lane], info["position"][lane], info["velocity"][lane])
            expected = pushing(given[0]) if hand is pushing else spring(*given)
            np.testing.assert_allclose(info["user_force"][lane], expected, rtol=1e-12)


def test_a_force_profile_of_a_file(tmp_path):
    path = tmp_path / "push.csv"
    path.write_text("# measured on a Sunday\n0, 0, 0\n1.0, 10, -4\n\n2.0, 0, 0\n", encoding="utf-8")
    hand = hand_of(path, varied=False)
    hand.prepare(1), hand.begin(0, np.random.default_rng(0))
    found = hand.force(np.array([[0.5], [1.0], [1.75], [3.0]]), None, None)[:, :, 0]
    np.testing.assert_allclose(found, [[5, -2], [10, -4], [2.5, -1], [0, 0]])


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


def test_a_name_carries_options():
    assert split_options("pid[bandwidth=60,valves=one,on=true]") == ("pid", {"bandwidth": 60.0, "valves": "one", "on": True})
    assert split_options("pid") == ("pid", {})
    stiff, soft = (make_controller(name, Parameters()) for name in ("backstepping[pneumatic_gain=80]", "backstepping"))
    assert type(stiff) is type(soft)
    assert "pneumatic_gain" in known_options("backstepping")


def test_set_goes_to_those_that_have_it():
    gain = known_options("pid")[0]
    assert with_options(["pid", "backstepping"], [f"{gain}=3"]) == [f"pid[{gain}=3]", "backstepping"]
    assert with_options(["pid"], []) == ["pid"]
    assert with_options(["backstepping[sign_width=0.01]"], ["pneumatic_gain=80"]) == [
        "backstepping[sign_width=0.01,pneumatic_gain=80]"
    ]
    with pytest.raises(ValueError, match=r"--set 'gain=3'; allowed for pid: .*; shut-valves: nothing"):
        with_options(["pid", "shut-valves"], ["gain=3"])
    with pytest.raises(ValueError, match=r"--set 'gain'; allowed: GAIN=VALUE"):
        with_options(["pid"], ["gain"])


def with_a_default(time, size=4.0):
    return size, 0.0


def test_what_a_function_needs_says_how_it_is_asked():
    assert hand_of(with_a_default, varied=False).closed_loop is False
    assert hand_of(spring, varied=False).closed_loop is True
