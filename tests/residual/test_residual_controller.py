"""The residual from measurements: bit for bit what the environments do inside, in one lane and many, and what it forgets."""

import gymnasium
import numpy as np
import pytest

from agents.policy.controller import ResidualController
from agents.policy.files import Policy, load_policy, save_policy
from agents.policy.network import PolicyNetwork
from agents.residual.law import observation_names
from agents.residual.settings import ResidualSettings
from baselines.registry import make_controller
from birthsim_env import Parameters
from birthsim_env.observation import SIZE
from tests.residual.policies import policy

CIRCLE, PROBE = "BirthSIM/CircleResidual-v1", "BirthSIM/ProbeResidual-v2"


SETTINGS = {
    "fixed": ResidualSettings(),
    "on an admittance": ResidualSettings("admittance-backstepping", authority=20.0),
    "variable_kp": ResidualSettings("backstepping-frozen", "variable_kp", policy_period=0.02),
    "variable": ResidualSettings("backstepping-weight", "variable", time_constant=0.01),
    "no law": ResidualSettings("none"),
    "without a force sensor": ResidualSettings("admittance-sensorless", authority=40.0, force_sensor=False),
    "with a memory": ResidualSettings("backstepping-force-first", force_sensor=False),
}


@pytest.mark.parametrize("sensors", ["ideal", "lab"])
@pytest.mark.parametrize("settings", SETTINGS.values(), ids=SETTINGS)
def test_the_controller_does_bit_for_bit_what_the_environment_does_inside(tmp_path, settings, sensors):
    # Valves that a policy drives at random soon slam the pistons into their stops: gently, then.
    reach = 0.05 if settings.law == "none" else 0.5
    squashed, cells = settings.impedance == "variable", 7 if settings.law == "backstepping-force-first" else 0
    stored = policy(settings, hidden=(12,), squashed=squashed, cells=cells, reach=reach)
    save_policy(stored, tmp_path)
    controller, steps, lanes = ResidualController(policy=tmp_path), 60, 5
    arguments = {"sensors": sensors, "randomize": True, "num_envs": lanes}
    inside = gymnasium.make_vec(CIRCLE, **arguments, **settings.to_dict())
    outside = gymnasium.make_vec("BirthSIM/Circle-v1", policy_period=1e-3, **arguments)
    observation, _ = inside.reset(seed=11)
    outside.reset(seed=11)
    act = stored.network.acting()
    for _ in range(steps):
        actions = act(observation)
        observation, _, terminated, _, info = inside.step(actions)
        for _ in range(round(1000 * settings.policy_period)):
            _, _, _, _, its = outside.step(controller.command(outside.measurement, outside.reference).T)
        np.testing.assert_array_equal(outside.simulation.plant.state, inside.simulation.plant.state)
        np.testing.assert_array_equal(its["tracking_error"], info["tracking_error"])
        assert not terminated.any()
    assert np.ptp(actions, axis=0).max() > 0.1 * reach, "it says different things in different worlds"
    # It is not the law alone that went there.
    if settings.law != "none":
        plain = gymnasium.make_vec("BirthSIM/Circle-v1", policy_period=1e-3, **arguments)
        law = make_controller(settings.law, Parameters())
        plain.reset(seed=11)
        for _ in range(10 * steps):
            plain.step(law.command(plain.measurement, plain.reference).T)
        assert np.abs(plain.simulation.plant.state - inside.simulation.plant.state)[:2].max() > 1e-6


def test_the_controller_believes_in_the_rig_that_it_is_given(tmp_path):
    rig = Parameters().replace({"mechanics.mass": 4.0, "geometry.d3": 0.36})
    stored = policy(ResidualSettings(), reach=0.5)
    save_policy(stored, tmp_path)
    inside = gymnasium.make_vec(PROBE, num_envs=2, parameters=rig)
    observation, _ = inside.reset(seed=1)
    states = []
    for believed in (rig, None):
        outside = gymnasium.make_vec("BirthSIM/Probe-v2", num_envs=2, policy_period=1e-3, parameters=rig)
        controller = ResidualController(believed, tmp_path)
        outside.reset(seed=1)
        for _ in range(200):
            outside.step(controller.command(outside.measurement, outside.reference).T)
        states.append(outside.simulation.plant.state)
    for _ in range(20):
        observation, *_ = inside.step(stored.network.actions(observation))
    np.testing.assert_array_equal(states[0], inside.simulation.plant.state)
    assert not np.array_equal(*states)


def network(bias) -> PolicyNetwork:
    """A policy whose actions follow the tracking error, plus a constant."""
    inputs = len(observation_names(ResidualSettings()))
    weight = np.zeros((2, inputs), np.float32)
    weight[0, 1], weight[1, 0] = 0.5, -0.5
    return PolicyNetwork(np.zeros(inputs), np.ones(inputs), ((weight, np.array(bias, np.float32)),))


@pytest.fixture
def steering(tmp_path):
    """Folder of a policy that follows the tracking error and leans on cylinder 2."""
    save_policy(Policy(network((0.0, 0.4)), CIRCLE, ResidualSettings(policy_period=0.02), {}), tmp_path)
    return tmp_path


def test_any_function_is_a_policy(steering):
    env = gymnasium.make_vec("BirthSIM/Circle-v1", num_envs=3, policy_period=1e-3)
    stored = load_policy(steering)
    given = ResidualController(None, lambda seen: stored.network.actions(seen).astype(float), stored.settings)
    folder = ResidualController(policy=steering)
    env.reset(seed=5)
    for _ in range(50):
        openings = folder.command(env.measurement, env.reference)
        np.testing.assert_array_equal(given.command(env.measurement, env.reference), openings)
        env.step(openings.T)
    with pytest.raises(ValueError, match=r"policy gives actions \(3, 5\); allowed: \(3, 2\)"):
        ResidualController(None, lambda seen: np.zeros((3, 5))).command(env.measurement, env.reference)
    with pytest.raises(ValueError, match=r"settings = ResidualSettings\(.*\) beside policy = .*; allowed: beside a function"):
        ResidualController(None, steering, stored.settings)


class Asked:
    """The policy of a folder as a function, and every observation (N, D) that it was asked with."""

    def __init__(self, folder):
        stored = load_policy(folder)
        self.network, self.seen = stored.network, []
        self.controller = ResidualController(None, self, stored.settings)

    def __call__(self, observations):
        self.seen.append(observations)
        return self.network.actions(observations)


LAST = slice(SIZE, SIZE + 2)
SMOOTH, SHARE = slice(SIZE + 2, SIZE + 4), slice(SIZE + 4, SIZE + 6)


def test_the_policy_is_asked_once_per_policy_period(steering):
    env = gymnasium.make_vec("BirthSIM/Circle-v1", num_envs=2, policy_period=1e-3)
    policy = Asked(steering)
    controller, asked = policy.controller, policy.seen
    env.reset(seed=0)
    for _ in range(41):
        env.step(controller.command(env.measurement, env.reference).T)
    assert len(asked) == 3
    np.testing.assert_array_equal(asked[0][:, LAST], 0)
    np.testing.assert_array_equal(asked[0][:, SHARE], 1)
    first = policy.network.actions(asked[0])
    np.testing.assert_array_equal(asked[1][:, LAST], first)
    np.testing.assert_allclose(asked[1][:, SMOOTH], (1 - np.exp(-20 / 28)) * first, rtol=1e-6)
