"""The residual environments: zero is exactly the law, and what an action may do is bounded, smooth and forgotten on reset."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env as gymnasium_check
from stable_baselines3.common.env_checker import check_env as stable_baselines_check

import agents
from agents.residual_env import ResidualEnv, ResidualVectorEnv
from agents.residual_law import ResidualSettings
from baselines.backstepping import BacksteppingController
from birthsim_env import Parameters
from birthsim_env.info import FIELDS
from birthsim_env.scenarios import SCENARIOS

assert agents  # importing it registers the ids
IDS = tuple(f"BirthSIM/{name.capitalize()}Residual-v0" for name in SCENARIOS)
CIRCLE, PROBE = "BirthSIM/CircleResidual-v0", "BirthSIM/ProbeResidual-v0"
RIG = Parameters()


def single(name=CIRCLE, **arguments) -> ResidualEnv:
    env = gymnasium.make(name, **arguments).unwrapped
    assert type(env) is ResidualEnv
    return env


def lanes(count=3, name=CIRCLE, **arguments) -> ResidualVectorEnv:
    env = gymnasium.make_vec(name, num_envs=count, **arguments)
    assert type(env) is ResidualVectorEnv
    return env


def random_actions(steps, count, seed=0):
    return np.random.default_rng(seed).uniform(-1, 1, (steps, count, 2)).astype(np.float32)


def by_hand(name, steps, seed, believed=lambda step: (0.0, 0.0), weight=False, periods=10, **arguments):
    """The base environment at 1 kHz, driven by the law from measurements; its state and info after every policy step.

    ``believed(step)`` is the force (2,), N, that the law is told about during policy step ``step``.
    """
    env = gymnasium.make(name.replace("Residual", ""), policy_period=1e-3, **arguments).unwrapped
    law = BacksteppingController(arguments.get("parameters"), weight_compensation=weight)
    env.reset(seed=seed)
    rows = []
    for step in range(steps):
        told = np.asarray(believed(step), dtype=np.float64)
        for _ in range(periods):
            _, _, terminated, truncated, info = env.step(law.command(env.measurement, env.reference, told))
        rows.append((env.simulation.plant.state.copy(), info, terminated, truncated))
    return rows


def assert_follows(env, actions, rows, seed):
    """The residual environment under ``actions`` goes, bit for bit, through ``rows`` of ``by_hand``."""
    env.reset(seed=seed)
    for action, (state, expected, terminated, truncated) in zip(actions, rows, strict=True):
        _, _, its_end, its_limit, info = env.step(action)
        np.testing.assert_array_equal(env.simulation.plant.state, state)
        assert (its_end, its_limit) == (terminated, truncated)
        for field in set(FIELDS) - {"impact_speed"}:
            np.testing.assert_array_equal(info[field], expected[field], err_msg=field)


@pytest.mark.parametrize("weight", [False, True])
@pytest.mark.parametrize("sensors", ["ideal", "lab"])
def test_zero_actions_are_bit_for_bit_the_law(sensors, weight):
    arguments = {"sensors": sensors, "randomize": True}
    rows = by_hand(CIRCLE, 300, 3, weight=weight, **arguments)
    env = single(weight_compensation=weight, **arguments)
    assert_follows(env, np.zeros((300, 2), np.float32), rows, seed=3)
    # It was no standstill: the pushes have begun.
    assert np.abs(rows[-1][0] - rows[0][0]).max() > 0.01


@pytest.mark.parametrize("name", IDS[1:])
def test_zero_actions_are_the_law_in_every_scenario_up_to_its_end(name):
    steps = 80
    rows = by_hand(name, steps, 0, duration=steps * 0.01)
    assert rows[-1][3]
    assert_follows(single(name, duration=steps * 0.01), np.zeros((steps, 2), np.float32), rows, seed=0)


def test_zero_actions_on_a_rig_of_ones_own_are_the_law_told_of_that_rig():
    rig = RIG.replace({"mechanics.mass": 4.5, "cylinder2.coulomb_friction": 22.0})
    rows = by_hand(CIRCLE, 60, 0, parameters=rig)
    assert_follows(single(parameters=rig), np.zeros((60, 2), np.float32), rows, seed=0)
    # The law's belief follows the rig: a law that believes in the default goes elsewhere.
    env, law = gymnasium.make("BirthSIM/Circle-v0", policy_period=1e-3, parameters=rig).unwrapped, BacksteppingController()
    env.reset(seed=0)
    for _ in range(600):
        env.step(law.command(env.measurement, env.reference))
    assert np.abs(env.simulation.plant.state - rows[-1][0]).max() > 1e-4


@pytest.mark.parametrize(
    ("authority", "smoothing", "period"), [(40.0, 0.3, 0.01), (15.0, 1.0, 0.01), (80.0, 0.1, 0.02), (25.0, 0.3, 0.001)]
)
def test_a_held_action_becomes_a_believed_force_through_the_low_pass(authority, smoothing, period):
    steps, periods, action = 40, round(1000 * period), np.array([0.75, -0.5], np.float32)

    def believed(step):
        return authority * action.astype(np.float64) * (1 - (1 - smoothing) ** (step + 1))

    rows = by_hand(CIRCLE, steps, 1, believed, periods=periods)
    env = single(authority=authority, smoothing=smoothing, policy_period=period)
    env.reset(seed=1)
    for state, expected, _, _ in rows:
        _, _, _, _, info = env.step(action)
        # The closed form and the recursion differ in rounding alone.
        np.testing.assert_allclose(info["position"], expected["position"], rtol=0, atol=1e-9)
        np.testing.assert_allclose(env.simulation.plant.state[6:14], state[6:14], rtol=1e-6)
    # The force is felt: the law alone goes elsewhere.
    law = by_hand(CIRCLE, steps, 1, periods=periods)
    assert np.abs(rows[-1][1]["position"] - law[-1][1]["position"]).max() > 1e-5


@pytest.fixture
def told(monkeypatch):
    """Every force (2, N) that a law inside was told about."""
    forces, command = [], BacksteppingController.command

    def spied(self, measurement, reference, believed_force=None):
        forces.append(believed_force.copy())
        return command(self, measurement, reference, believed_force)

    monkeypatch.setattr(BacksteppingController, "command", spied)
    return forces


def test_the_believed_force_never_exceeds_the_authority_and_holds_for_a_policy_period(told):
    env = lanes(4, authority=25.0)
    env.reset(seed=0)
    actions = np.sign(random_actions(50, 4, seed=4))
    actions[30:] = 1.0
    expected = np.zeros((2, 4))
    for action in actions:
        env.step(action)
    forces = np.array(told).reshape(50, 10, 2, 4)
    for k, action in enumerate(actions):
        expected += 0.3 * (25 * action.T - expected)
        np.testing.assert_allclose(forces[k], np.tile(expected, (10, 1, 1)), rtol=1e-12)
    assert np.abs(forces).max() <= 25
    assert forces[-1].min() > 24.9


def test_an_ended_lane_starts_its_next_episode_with_no_believed_force(told):
    # Lane 1 hits the end stop; the others go on with what they had been told.
    env = lanes(3, PROBE, authority=500.0, smoothing=0.5, duration=2.0)
    env.reset(seed=0)
    actions, ended = np.full((3, 2), 0.1, np.float32), None
    actions[1] = [-1.0, -1.0]
    for step in range(200):
        _, _, terminated, _, infos = env.step(actions)
        if ended is not None:
            break
        if terminated.any():
            np.testing.assert_array_equal(terminated, [False, True, False])
            ended = step
            assert infos["time"][1] == 0
            actions[1] = 0.0
    assert ended is not None
    np.testing.assert_allclose(told[10 * ended], [[50, -500, 50]] * 2, rtol=0.02)
    np.testing.assert_array_equal(told[-1][:, 1], 0.0)
    np.testing.assert_allclose(told[-1][:, [0, 2]], 50, rtol=0.02)


@pytest.mark.parametrize("sensors", ["ideal", "lab"])
def test_every_episode_of_a_lane_is_that_of_the_single_environment(sensors):
    arguments = {"sensors": sensors, "randomize": True, "duration": 0.4}
    env, actions = lanes(35, **arguments), random_actions(100, 35)
    chosen = (0, 1, 33)
    alone = {lane: single(**arguments) for lane in chosen}
    observation, _ = env.reset(seed=20)
    for lane in chosen:
        np.testing.assert_array_equal(alone[lane].reset(seed=20 + lane)[0], observation[lane])
    for k, action in enumerate(actions):
        observation, reward, terminated, truncated, infos = env.step(action)
        assert truncated.all() == (k % 40 == 39)
        for lane in chosen:
            row = alone[lane].step(action[lane])
            assert row[1:4] == (reward[lane], terminated[lane], truncated[lane])
            last = infos["final_obs"][lane] if truncated[lane] else observation[lane]
            np.testing.assert_array_equal(row[0], last)
            if truncated[lane]:
                np.testing.assert_array_equal(alone[lane].reset()[0], observation[lane])


def test_the_same_actions_twice_are_the_same_rollout_in_the_same_environment():
    env, actions, rollouts = lanes(2, sensors="lab", randomize=True), random_actions(30, 2), []
    for _ in range(2):
        rows = [env.reset(seed=9)[0]]
        rows += [env.step(action)[0] for action in actions]
        rollouts.append(np.array(rows))
    np.testing.assert_array_equal(*rollouts)


def test_observations_end_with_the_last_action_and_are_named_so():
    env = lanes(2)
    assert env.single_action_space == gymnasium.spaces.Box(-1, 1, (2,), np.float32)
    assert env.single_observation_space.shape == (22,) == (len(env.observation_names),)
    assert [name for name in env.observation_names if "believed force" in name] == list(env.observation_names[-2:])
    observation, _ = env.reset(seed=0)
    np.testing.assert_array_equal(observation[:, -2:], 0)
    actions = random_actions(1, 2)[0]
    observation, _, _, _, infos = env.step(actions)
    np.testing.assert_array_equal(observation[:, -2:], actions)
    np.testing.assert_allclose(infos["reward_action_change"], -0.05 * np.abs(actions).sum(axis=1), rtol=1e-6)


@pytest.mark.parametrize("sensors", ["ideal", "lab"])
@pytest.mark.parametrize("name", IDS)
def test_both_checkers_find_nothing_to_say(name, sensors, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    gymnasium_check(single(name, sensors=sensors, randomize=True, render_mode="rgb_array"))
    stable_baselines_check(single(name, sensors=sensors, randomize=True))


def test_importing_twice_registers_once():
    import importlib

    before = {name: spec for name, spec in gymnasium.registry.items() if "Residual" in name}
    assert set(before) == set(IDS)
    importlib.reload(agents)
    assert {name: spec for name, spec in gymnasium.registry.items() if "Residual" in name} == before


@pytest.mark.parametrize("make", [single, lanes])
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"action_mode": "flow"}, "action_mode = 'flow'; allowed: not given"),
        ({"action_mode": "valve"}, "action_mode = 'valve'; allowed: not given"),
        ({"valves": "one_valve"}, "valves = 'one_valve'; allowed: not given"),
        ({"authority": 0.0}, r"authority = 0\.0; allowed: more than 0, at most 500"),
        ({"authority": 500.1}, r"authority = 500\.1; allowed: more than 0, at most 500"),
        ({"authority": float("nan")}, "authority = nan; allowed: more than 0"),
        ({"authority": "40"}, "authority = '40'; allowed: more than 0"),
        ({"smoothing": 0.0}, r"smoothing = 0\.0; allowed: more than 0, at most 1"),
        ({"smoothing": 1.5}, r"smoothing = 1\.5; allowed: more than 0, at most 1"),
        ({"policy_period": 0.0105}, r"policy_period = 0\.0105; allowed: a multiple of the control period 0\.001 s"),
        ({"policy_period": -0.01}, r"policy_period = -0\.01; allowed: more than 0"),
        ({"policy_period": "fast"}, "policy_period = 'fast'; allowed: more than 0"),
        ({"sensors": "none"}, "sensors = 'none'; allowed: 'ideal', 'lab'"),
    ],
)
def test_what_cannot_be_is_refused_by_name(make, arguments, message):
    with pytest.raises(ValueError, match=message):
        make(**arguments)


def test_the_largest_settings_are_allowed():
    env = lanes(2, authority=500, smoothing=1, policy_period=1)
    env.reset(seed=0)
    assert np.isfinite(env.step(np.zeros((2, 2), np.float32))[0]).all()
    assert ResidualSettings(500, 1, 1).to_dict() == {
        "authority": 500, "smoothing": 1, "policy_period": 1, "weight_compensation": False,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("action", "message"),
    [
        ([[0, 0]], r"action has shape \(1, 2\); allowed: \(3, 2\)"),
        ([[0, 0], [0, 1.01], [0, 0]], r"action\[1\] = 1\.01 in lane 1; allowed: -1 to 1"),
        ([[0, 0], [0, 0], [np.nan, 0]], r"action\[0\] = nan in lane 2; allowed: -1 to 1"),
    ],
)
def test_wrong_actions_are_refused(action, message):
    env = lanes(3)
    env.reset(seed=0)
    with pytest.raises(ValueError, match=message):
        env.step(np.array(action))
