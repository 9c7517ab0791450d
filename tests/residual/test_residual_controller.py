"""The residual from measurements: bit for bit what the environments do inside."""

import gymnasium
import numpy as np
import pytest

from agents.policy.controller import ResidualController
from agents.policy.files import save_policy
from agents.residual.settings import ResidualSettings
from baselines.named import make_controller
from birthsim_env import Parameters
from tests.residual.policies import policy

OTHER = {"mechanics.mass": 4.0, "geometry.d3": 0.36}
SETTINGS = {
    "fixed": ResidualSettings(),
    "another rig": ResidualSettings(),
    "on an admittance": ResidualSettings("admittance-backstepping", authority=20.0),
    "variable_kp": ResidualSettings("backstepping-frozen", "variable_kp", policy_period=0.02),
    "variable": ResidualSettings("backstepping-weight", "variable", time_constant=0.01),
    "no law": ResidualSettings("none"),
    "without a force sensor": ResidualSettings("admittance[force_sensor=false]", authority=40.0, force_sensor=False),
    "with a memory": ResidualSettings("backstepping-force-first", force_sensor=False),
}


@pytest.mark.parametrize("sensors", ["ideal", "lab"])
@pytest.mark.parametrize("name", SETTINGS)
def test_the_controller_does_bit_for_bit_what_the_environment_does_inside(tmp_path, name, sensors):
    settings, rig = SETTINGS[name], Parameters().replace(OTHER if name == "another rig" else {})
    # Valves that a policy drives at random soon slam the pistons into their stops: gently, then.
    reach = 0.05 if settings.law == "none" else 0.5
    squashed, cells = settings.impedance == "variable", 7 if settings.law == "backstepping-force-first" else 0
    stored = policy(settings, hidden=(12,), squashed=squashed, cells=cells, reach=reach)
    save_policy(stored, tmp_path)
    controller, steps, lanes = ResidualController(rig, tmp_path), 60, 5
    arguments = {"sensors": sensors, "randomize": True, "num_envs": lanes, "parameters": rig}
    inside = gymnasium.make_vec("BirthSIM/CircleResidual-v2", **arguments, **settings.to_dict())
    outside = gymnasium.make_vec("BirthSIM/Circle-v2", policy_period=1e-3, **arguments)
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
        plain = gymnasium.make_vec("BirthSIM/Circle-v2", policy_period=1e-3, **arguments)
        law = make_controller(settings.law, rig)
        plain.reset(seed=11)
        for _ in range(10 * steps):
            plain.step(law.command(plain.measurement, plain.reference).T)
        assert np.abs(plain.simulation.plant.state - inside.simulation.plant.state)[:2].max() > 1e-6


def test_any_function_is_a_policy(tmp_path):
    env = gymnasium.make_vec("BirthSIM/Circle-v2", num_envs=3, policy_period=1e-3)
    stored = policy(ResidualSettings(policy_period=0.02), reach=0.5)
    save_policy(stored, tmp_path)
    given = ResidualController(None, lambda seen: stored.network.actions(seen).astype(float), stored.settings)
    folder = ResidualController(policy=tmp_path)
    env.reset(seed=5)
    for _ in range(50):
        openings = folder.command(env.measurement, env.reference)
        np.testing.assert_array_equal(given.command(env.measurement, env.reference), openings)
        env.step(openings.T)
    with pytest.raises(ValueError, match=r"policy gives actions \(3, 5\); allowed: \(3, 2\)"):
        ResidualController(None, lambda seen: np.zeros((3, 5))).command(env.measurement, env.reference)
    with pytest.raises(ValueError, match=r"settings = ResidualSettings\(.*\) beside policy = .*; allowed: beside a function"):
        ResidualController(None, tmp_path, stored.settings)
