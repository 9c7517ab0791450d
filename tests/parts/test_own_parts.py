"""A user's own reference and hand: functions, files and classes; what a hand is asked, and when."""

import math

import gymnasium
import numpy as np
import pytest

from baselines.named import known_options, split_options
from birthsim.command_line.worlds import with_options
from birthsim_env import Circle, UserForce
from birthsim_env.parts.own_parts import Through, trajectory_of

CIRCLE = "BirthSIM/Circle-v2"


def round_about(t):
    return 0.5 + 0.05 * math.cos(math.pi / 2 * t), 0.05 * math.sin(math.pi / 2 * t)


@pytest.mark.parametrize("from_file", [False, True])
def test_a_plain_position_becomes_a_trajectory_with_its_derivatives(from_file, tmp_path):
    """Polynomials of degree 5 through samples every h: derivative n is off by about h^(5 - n) |f^(5)|, most at the ends."""
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

class Still(birthsim_env.FixedTarget):
    pass
"""


def test_classes_and_functions_of_a_file(tmp_path):
    (tmp_path / "own.py").write_text(OWN, encoding="utf-8")
    env = gymnasium.make(CIRCLE, reference=f"{tmp_path}/own.py:along")
    _, info = env.reset(seed=0)
    np.testing.assert_allclose(info["target"], [0.5, 0.0], atol=1e-12)
    assert type(trajectory_of(f"{tmp_path}/own.py:Still", 1.0)).__name__ == "Still"


def test_a_name_carries_options_and_set_gives_them_to_those_that_have_them():
    gain = known_options("pid")[0]
    assert with_options(["pid", "backstepping"], [f"{gain}=3"]) == [f"pid[{gain}=3]", "backstepping"]
    assert with_options(["backstepping[sign_width=0.01]"], ["pneumatic_gain=80"]) == [
        "backstepping[sign_width=0.01,pneumatic_gain=80]"
    ]
    assert split_options("pid[bandwidth=60,valves=one,on=true]") == ("pid", {"bandwidth": 60.0, "valves": "one", "on": True})
    assert split_options("pid") == ("pid", {})


def test_a_hand_of_a_file_pushes_as_it_says_between_its_rows_too(tmp_path):
    (tmp_path / "push.csv").write_text("time,Fy,Fx\n0,0,10\n20,-2,10\n", encoding="utf-8")
    env = gymnasium.make(CIRCLE, user_force=f"{tmp_path}/push.csv", policy_period=1.0)
    env.reset(seed=0)
    np.testing.assert_allclose(env.step(np.zeros(4))[4]["user_force"], [10.0, -0.1])


class Spy(UserForce):
    """Remembers what it was asked and answers with what ``law`` makes of it."""

    def __init__(self, law, closed_loop=False):
        self.law, self.closed_loop, self.asked = law, closed_loop, []

    def force(self, time, position, velocity):
        self.asked.append((time.copy(), position.copy(), velocity.copy()))
        return self.law(time, position, velocity)


def wave(time, position, velocity):
    return np.stack([20 * np.sin(40 * time), 10 * np.cos(30 * time)], axis=1)


def test_an_open_force_is_asked_once_per_policy_step_with_its_control_instants():
    spy = Spy(wave)
    env = gymnasium.make("BirthSIM/Probe-v3", user_force=spy).unwrapped
    _, first = env.reset(seed=0)
    infos = [first] + [env.step(np.zeros(4))[4] for _ in range(5)]
    assert len(spy.asked) == 6
    for step, (time, position, velocity) in enumerate(spy.asked):
        np.testing.assert_allclose(time, 0.01 * step + 0.001 * np.arange(10)[:, None], atol=1e-12)
        np.testing.assert_array_equal(position[:, 0], infos[step]["position"])
        np.testing.assert_array_equal(velocity[:, 0], infos[step]["velocity"])
        np.testing.assert_allclose(infos[step]["user_force"], wave(time, None, None)[0, :, 0])
    # Every sample was held for its own control period: the plant alone, given the same samples, ends in the same state.
    again = gymnasium.make("BirthSIM/Probe-v3", user_force=Spy(wave), policy_period=0.001).unwrapped
    again.reset(seed=0)
    for _ in range(50):
        again.step(np.zeros(4))
    np.testing.assert_array_equal(env.simulation.plant.state, again.simulation.plant.state)


@pytest.mark.parametrize("sensors", ["ideal", "lab"])
def test_a_closed_loop_force_is_asked_every_control_period_with_the_present_motion(sensors):
    wall = 0.502

    def spring(time, position, velocity):
        push = np.minimum(wall - position[0], 0.0) * 3000.0 - 20.0 * velocity[0]
        return np.stack([push, np.zeros_like(push)])[None]

    spy = Spy(spring, closed_loop=True)
    env = gymnasium.make("BirthSIM/Probe-v3", user_force=spy, sensors=sensors).unwrapped
    env.reset(seed=0)
    motions = []
    for _ in range(30):
        # A valve that fills chamber P2 drives the end effector into the virtual wall.
        info = env.step((0.0, 0.0, 0.15, -0.15))[4]
        motions.append(env.simulation.plant.end_effector())
    assert len(spy.asked) == 301
    np.testing.assert_allclose([time.item() for time, _, _ in spy.asked], 0.001 * np.arange(301), atol=1e-12)
    np.testing.assert_array_equal([np.concatenate(motion) for _, *motion in spy.asked[10::10]], motions)
    np.testing.assert_allclose(info["user_force"], spring(None, *spy.asked[-1][1:])[0, :, 0])
    assert info["position"][0] > wall
    assert info["user_force"][0] < -1.0


def test_a_force_may_answer_with_one_array_that_it_fills_anew():
    buffer = np.zeros((10, 2, 1))

    def law(time, position, velocity):
        buffer[:, 0] = np.where(time > 0.4995, 30.0, 0.0)
        return buffer

    jumps = []
    for answer in (law, lambda *arguments: law(*arguments).copy()):
        env = gymnasium.make("BirthSIM/Probe-v3", user_force=Spy(answer))
        env.reset(seed=0)
        jumps.append([env.step(np.zeros(4))[4]["since_jump"] for _ in range(60)])
    np.testing.assert_array_equal(*jumps)
    assert jumps[0][49] == pytest.approx(0.0, abs=1e-9)
