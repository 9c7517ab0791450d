"""The single environment keeps Gymnasium's contract: checkers, registration, spaces, ends of episodes, actions, frames."""

import itertools

import gymnasium
import numpy as np
import pytest

from birthsim_env import FixedTarget, ForceProfile, Parameters
from birthsim_env.drawing.rendering import Renderer
from birthsim_env.env import BirthSIMEnv
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.control_model import active_flow
from birthsim_env.reward import REWARD_TERMS

SECONDS = {"circle": 16, "probe": 7, "descent": 24, "forceps": 15, "dystocia": 16, "vacuum": 24}
IDS = tuple(environment_id(name) for name in SECONDS)
CIRCLE, PROBE = IDS[0], IDS[1]
FACES = tuple(itertools.product(("valve", "flow"), ("two_valves", "one_valve"), ("ideal", "lab")))


def make(name=CIRCLE, **arguments):
    env = gymnasium.make(name, **arguments).unwrapped
    assert isinstance(env, BirthSIMEnv)
    return env


def run(env, actions, seed=0):
    """Observations and infos of an episode that starts from ``seed``, those of ``reset`` first."""
    rows = [env.reset(seed=seed), *(env.step(action)[::4] for action in actions)]
    observations, infos = zip(*rows, strict=True)
    return np.array(observations), infos


def random_actions(count, size, reach=0.2, seed=0):
    return np.random.default_rng(seed).uniform(-reach, reach, (count, size)).astype(np.float32)


@pytest.mark.parametrize("face", FACES)
def test_spaces_and_names_have_the_size_of_the_valve_layout(face):
    env = make(action_mode=face[0], valves=face[1], sensors=face[2])
    size = 4 if face[1] == "two_valves" else 2
    assert env.action_space == gymnasium.spaces.Box(-1.0, 1.0, (size,), np.float32)
    assert env.observation_space == gymnasium.spaces.Box(-10.0, 10.0, (20 + size,), np.float32)
    assert len(env.observation_names) == 20 + size
    assert all(name.startswith("last action") for name in env.observation_names[20:])


EPISODES = [*((name, None, 0.05, 20 * seconds) for name, seconds in zip(IDS, SECONDS.values(), strict=True))]
EPISODES += [(CIRCLE, *one) for one in ((0.2, 0.01, 20), (0.2, 0.001, 200), (0.21, 0.03, 7), (0.5, 0.25, 2))]


@pytest.mark.parametrize(("name", "duration", "period", "steps"), EPISODES)
def test_an_episode_is_truncated_exactly_at_its_end(name, duration, period, steps):
    # Holding still needs a hand on the valves: keep the episode alive without any force of the user.
    env = make(name, duration=duration, policy_period=period, user_force=ForceProfile(), reference=FixedTarget((0.5, 0.0)))
    env.reset(seed=0)
    ends = [env.step(np.zeros(4))[2:4] for _ in range(steps)]
    assert ends == [(False, False)] * (steps - 1) + [(False, True)]
    assert env.simulation.time[0] == pytest.approx(steps * period)


@pytest.mark.parametrize("push", [(0, 0, 1, -1), (0, 0, -1, 1), (1, -1, 0, 0), (-1, 1, 0, 0)])
def test_running_into_an_end_stop_terminates(push):
    # With sensors that look at every control period the step is integrated in ten parts; the collision is the same.
    env, fine = make(PROBE), make(PROBE, sensors="lab")
    env.reset(seed=0), fine.reset(seed=0)
    for _ in range(200):
        _, reward, terminated, truncated, info = env.step(push)
        again = fine.step(push)
        np.testing.assert_allclose(again[4]["impact_speed"], info["impact_speed"], rtol=1e-6)
        assert again[2] == terminated
        if terminated:
            break
        assert info["impact_speed"].max() <= 0.1
    assert (terminated, truncated) == (True, False)
    cylinder = 0 if push[0] else 1
    assert info["impact_speed"][cylinder] > 0.1
    assert info["impact_speed"][1 - cylinder] == 0.0
    assert abs(info["piston_position"][cylinder]) > 0.98 * (0.1, 0.2)[cylinder]
    assert reward == pytest.approx(sum(info[term] for term in REWARD_TERMS))
    assert 0.0 <= reward <= 1.0


def test_termination_and_the_end_of_time_never_coincide():
    env = make(PROBE)
    env.reset(seed=0)
    steps = 0
    while not env.step((0, 0, 1, -1))[2]:
        steps += 1
    short = make(PROBE, duration=0.01 * (steps + 1))
    short.reset(seed=0)
    for _ in range(steps):
        short.step((0, 0, 1, -1))
    assert short.step((0, 0, 1, -1))[2:4] == (True, False)
    many = gymnasium.make_vec(PROBE, num_envs=2, max_episode_steps=steps + 1)
    many.reset(seed=0)
    for _ in range(steps + 1):
        _, _, terminated, truncated, _ = many.step(np.array([(0, 0, 1, -1), (0, 0, 0, 0)]))
    assert (*terminated, *truncated) == (True, False, False, True)


def test_reset_starts_on_the_target_or_where_it_is_told_to():
    env = make(randomize=True)
    _, info = env.reset(seed=4)
    target = env.reference
    np.testing.assert_allclose(info["tracking_error"], 0.0, atol=1e-12)
    np.testing.assert_allclose(info["velocity"], target.velocity, atol=1e-12)
    _, info = env.reset(seed=4, options={"position": (0.48, 0.03)})
    np.testing.assert_allclose(info["position"], (0.48, 0.03), atol=1e-12)
    np.testing.assert_array_equal(info["velocity"], 0.0)
    np.testing.assert_array_equal(env.reference.rows, target.rows)
    info = env.step(np.zeros(4))[4]
    np.testing.assert_allclose(info["position"], (0.48, 0.03), atol=5e-4)


@pytest.mark.parametrize("name", IDS)
def test_chambers_start_in_balance_at_the_stiffness_asked_for(name):
    env = make(name, randomize="scenario", user_force=ForceProfile())
    for seed in range(5):
        _, info = env.reset(seed=seed)
        np.testing.assert_allclose(info["pneumatic_stiffness"], info["pneumatic_stiffness_setpoint"], rtol=1e-9)
        accelerations = env.simulation.plant.derivatives(env.simulation.plant.state, np.zeros((4, 1)), np.zeros((2, 1)))[[1, 3]]
        # Nothing but the centrifugal terms of a motion that has already begun.
        assert np.abs(accelerations).max() < 0.05


def test_a_longer_policy_period_holds_the_action_over_the_same_plant():
    fine, coarse = make(policy_period=0.001), make(policy_period=0.01)
    actions = random_actions(30, 4)
    many, few = run(fine, np.repeat(actions, 10, axis=0))[0], run(coarse, actions)[0]
    np.testing.assert_array_equal(many[::10, :20], few[:, :20])


def test_one_valve_is_two_valves_with_opposite_openings():
    actions = random_actions(300, 2, reach=0.5)
    both = np.stack([actions[:, 0], -actions[:, 0], actions[:, 1], -actions[:, 1]], axis=1)
    one, two = run(make(valves="one_valve"), actions)[0], run(make(), both)[0]
    np.testing.assert_array_equal(one[:, :20], two[:, :20])


@pytest.mark.parametrize("valves", ["two_valves", "one_valve"])
@pytest.mark.parametrize("crossing", [1e-4, 0.03])
def test_a_commanded_flow_is_what_the_chambers_get(valves, crossing):
    """Or less of it, where it is so small that it crosses the overlap: below the ``crossing`` of each of two edges."""
    # A fast spool: pressures move on while it lags, which is the only other difference between wish and flow.
    rig = Parameters().replace({"valves.time_constant": 2e-4, "mechanics.mass": 2.5, "valves.crossing": crossing})
    unit = 3.9e-9 * 7.0e5 * 1.185
    env, tried = make(PROBE, action_mode="flow", valves=valves, parameters=rig, duration=1.0), 0
    for wish in np.random.default_rng(0).uniform(-0.1, 0.1, (6, env.action_space.shape[0])):
        env.reset(seed=0, options={"position": (0.58, -0.12)})  # far from mid stroke, where the transform is no difference
        for _ in range(3):
            info = env.step(wish)[4]
        assert np.abs(info["opening"]).max() < 0.9
        flows = env.simulation.plant.mass_flows()[:, 0]
        net = flows[:4] - flows[4:]
        if valves == "one_valve":
            half, y = np.array([0.1, 0.2]), info["piston_position"]
            net = active_flow(net[0::2], net[1::2], half + y, half - y)
        whole = np.abs(wish) > 2 * crossing
        tried += whole.sum()
        np.testing.assert_allclose(net[whole], wish[whole] * unit, rtol=0.02, atol=2e-3 * unit)
        share = (net / unit)[~whole] * np.sign(wish[~whole])
        assert np.all((share > -2e-3) & (share < np.abs(wish[~whole]) + 2e-3))
    assert tried >= 6


def test_frames_are_pictures_and_a_window_shows_nothing_else(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = make(render_mode="rgb_array", picture_size=(1280, 960))
    env.reset(seed=0)
    first = env.render()
    assert (first.shape, first.dtype) == ((960, 1280, 3), np.uint8)
    for _ in range(60):
        env.step((0.0, 0.0, 0.1, -0.1))
    assert not np.array_equal(env.render(), first)
    window = make(render_mode="human")
    window.reset(seed=0)
    assert window.step(np.zeros(4))[0].shape == (24,)
    assert window.render() is None
    window.close(), window.close(), env.close()
    lanes = gymnasium.make_vec(CIRCLE, num_envs=2, render_mode="rgb_array", picture_size=(400, 300))
    lanes.reset(seed=0)
    assert [(frame.shape, frame.dtype) for frame in lanes.render()] == [((300, 400, 3), np.uint8)] * 2
    lanes.close(), lanes.close()
    assert make().render() is gymnasium.make_vec(CIRCLE, num_envs=2).render() is None


@pytest.mark.parametrize(("period", "rate"), [(0.001, 1000), (0.01, 100), (0.03, 33), (0.04, 25)])
def test_a_recording_plays_in_real_time_at_a_whole_rate(period, rate):
    for env in (make(policy_period=period), gymnasium.make_vec(CIRCLE, num_envs=2, policy_period=period)):
        assert env.metadata["render_fps"] == rate
        assert isinstance(env.metadata["render_fps"], int)


@pytest.mark.parametrize(("period", "frames", "rate"), [(0.001, 3, 50.0), (0.01, 3, 50.0), (0.04, 2, 25.0)])
def test_the_window_shows_real_time_and_no_more_than_50_frames_a_second(period, frames, rate, monkeypatch):
    shown = []
    monkeypatch.setattr(Renderer, "show", lambda self, scene, rate: shown.append((scene.time, rate)))
    env = make(policy_period=period, render_mode="human")
    env.reset(seed=0)
    for _ in range(round(0.04 / period)):
        env.step(np.zeros(4))
    assert shown == [pytest.approx((k / rate, rate)) for k in range(frames)]
