"""A user's own force: when it is asked, what it is told, and how wrong answers are refused, in one lane and in many."""

import gymnasium
import numpy as np
import pytest

from birthsim_env import UserForce

PROBE = "BirthSIM/Probe-v2"


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
    env = gymnasium.make(PROBE, user_force=spy).unwrapped
    _, first = env.reset(seed=0)
    infos = [first] + [env.step(np.zeros(4))[4] for _ in range(5)]
    assert len(spy.asked) == 6
    for step, (time, position, velocity) in enumerate(spy.asked):
        np.testing.assert_allclose(time, 0.01 * step + 0.001 * np.arange(10)[:, None], atol=1e-12)
        np.testing.assert_array_equal(position[:, 0], infos[step]["position"])
        np.testing.assert_array_equal(velocity[:, 0], infos[step]["velocity"])
        np.testing.assert_allclose(infos[step]["user_force"], wave(time, None, None)[0, :, 0])
    # Every sample was held for its own control period: the plant alone, given the same samples, ends in the same state.
    again = gymnasium.make(PROBE, user_force=Spy(wave), policy_period=0.001).unwrapped
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
    env = gymnasium.make(PROBE, user_force=spy, sensors=sensors).unwrapped
    env.reset(seed=0)
    plant, states = env.simulation.plant, []
    for _ in range(30):
        # A valve that fills chamber P2 drives the end effector into the virtual wall.
        info = env.step((0.0, 0.0, 0.15, -0.15))[4]
        states.append((env.simulation.time[0], *plant.end_effector()[:, 0]))
    assert len(spy.asked) == 301
    np.testing.assert_allclose([time.item() for time, _, _ in spy.asked], 0.001 * np.arange(301), atol=1e-12)
    for k, (time, *motion) in enumerate(states):
        asked = spy.asked[10 * (k + 1)]
        np.testing.assert_allclose(asked[0].item(), time)
        np.testing.assert_array_equal(np.concatenate(asked[1:])[:, 0], motion)
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
        env = gymnasium.make(PROBE, user_force=Spy(answer))
        env.reset(seed=0)
        jumps.append([env.step(np.zeros(4))[4]["since_jump"] for _ in range(60)])
    np.testing.assert_array_equal(*jumps)
    assert jumps[0][49] == pytest.approx(0.0, abs=1e-9)
