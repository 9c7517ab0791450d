"""BirthSIM/Rail-v0: one axis in spaces, rewards and metrics, at any inclination; what is not for one cylinder says so."""

import math
import re

import gymnasium
import numpy as np
import pytest

import birthsim
from baselines.bench.metrics import NOT_OF_A_RAIL, UNITS
from birthsim_env.parts.hands.user_forces import ForceProfile, Ramp
from birthsim_env.parts.references import FixedTarget, Sine
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from tests.console import ROOT

EXAMPLES = ROOT / "examples"
TILT = math.radians(35.0)
RIG = Parameters().replace({"linkage.kind": "rail", "linkage.inclination": TILT})
ALONG = np.array([math.cos(TILT), math.sin(TILT)])


def rolled(env, actions):
    """Observations, rewards and infos of an episode seeded 3."""
    observation, info = env.reset(seed=3)
    found = [(observation, 0.0, info)]
    for action in actions:
        observation, reward, *_, info = env.step(action)
        found.append((observation, reward, info))
    return found


def test_it_is_made_without_arguments_and_has_one_axis():
    env = gymnasium.make("BirthSIM/Rail-v0")
    names = env.get_wrapper_attr("observation_names")
    assert env.observation_space.shape == (len(names),) == (12,)
    assert env.action_space.shape == (2,)
    said = [name.replace("(17)", "").replace("1 half", "half").partition(",")[0] for name in names]
    assert not [name for name in said if "1" in name or name.endswith((" x", " y"))]
    assert gymnasium.make("BirthSIM/Rail-v0", valves="one_valve").action_space.shape == (1,)
    assert gymnasium.make("BirthSIM/Rail-v0", action_mode="flow").action_space.shape == (2,)


def test_no_entry_of_an_observation_is_constant():
    actions = np.random.default_rng(0).uniform(-0.4, 0.4, (900, 2)).astype(np.float32)
    env = birthsim.make("BirthSIM/Rail-v0", parameters=RIG)
    assert np.all(np.ptp([one[0] for one in rolled(env, actions)], axis=0) > 0)


def test_what_is_seen_is_the_truth_along_the_rail():
    actions = np.random.default_rng(1).uniform(-0.3, 0.3, (150, 2)).astype(np.float32)
    env = birthsim.make("BirthSIM/Rail-v0", parameters=RIG)
    observation, _, info = rolled(env, actions)[-1]
    area, rod = math.pi / 4 * 0.025**2, math.pi / 4 * 0.010**2
    pressed = info["pressure"][2] * area - info["pressure"][3] * (area - rod) - 101300.0 * rod
    push = float(info["user_force"] @ ALONG)
    assert push == pytest.approx(30.0)
    expected = [
        float(info["tracking_error"] @ ALONG) / 0.01, float(info["velocity"] @ ALONG) / 0.2, info["piston_position"][1] / 0.2,
        (pressed + push) / 200.0, info["pneumatic_stiffness"][1] / 2500.0, info["pneumatic_stiffness_setpoint"][1] / 2500.0,
        info["stiffness_setpoint"][0] / 5000.0, push / 50.0,
    ]  # fmt: skip
    np.testing.assert_allclose(observation[:8], expected, rtol=2e-6)
    np.testing.assert_array_equal(observation[10:], actions[-1])
    distance = 0.5 + info["piston_position"][1]
    np.testing.assert_allclose(info["position"], distance * ALONG, atol=1e-12)


@pytest.mark.parametrize("kind", ["", "Residual"])
def test_a_lane_has_the_bits_of_a_single_environment(kind):
    env = birthsim.make(f"BirthSIM/Rail{kind}-v0", parameters=RIG, randomize=True)
    worlds = birthsim.make_vec(f"BirthSIM/Rail{kind}-v0", 2, parameters=RIG, randomize=True)
    actions = np.random.default_rng(2).uniform(-0.3, 0.3, (40, 2, *env.action_space.shape)).astype(np.float32)
    single = rolled(env, actions[:, 1])
    observation, _ = worlds.reset(seed=[7, 3])
    lanes = [(observation, np.zeros(2))]
    lanes += [worlds.step(action)[:2] for action in actions]
    for (own, paid, _), (observations, rewards) in zip(single, lanes, strict=True):
        np.testing.assert_array_equal(own, observations[1])
        assert paid == rewards[1]


def test_the_reward_knows_no_inclination():
    """Without gravity a rail is the same at any inclination; its one axis is paid once."""
    paid = []
    for tilt in (0.0, 35.0, 90.0):
        rig = RIG.replace({"linkage.inclination": math.radians(tilt), "mechanics.gravity": 0.0})
        env = birthsim.make("BirthSIM/Rail-v0", parameters=rig)
        paid.append([reward for _, reward, _ in rolled(env, np.full((200, 2), 0.05, np.float32))])
    np.testing.assert_allclose(paid[1:], [paid[0]] * 2, rtol=1e-6)


def test_a_push_across_is_borne_by_the_rail():
    across = 40.0 * np.array([-ALONG[1], ALONG[0]])
    push = ForceProfile([(0.0, 0.0, 0.0), (0.2, *across), (0.3, *(across + 10.0 * ALONG))])
    env = birthsim.make("BirthSIM/Rail-v0", parameters=RIG, user_force=push, duration=1.0)
    info = rolled(env, np.zeros((50, 2), np.float32))[-1][2]
    np.testing.assert_allclose(info["user_force"], 10.0 * ALONG, atol=1e-12)
    assert info["piston_position"][0] == 0.0


def test_a_controller_renders_stiffness_along_the_rail():
    """The displacement that a held push makes, from the positions alone: that of the metric, and of the setpoint."""
    hold = {"reference": FixedTarget(tuple(0.5 * ALONG)), "user_force": Ramp(20.0, TILT, 3.0), "duration": 7.0}
    found = birthsim.evaluate("BirthSIM/Rail-v0", "admittance", episodes=2, progress=False, parameters=RIG, **hold)
    assert max(abs(one) for one in found.metrics["stiffness_error"]) < 0.1
    said = {name for name in UNITS if not np.isnan(found.metrics[name]).all()}
    assert said == set(UNITS) - set(NOT_OF_A_RAIL)
    assert 0.0 < found.metrics["air"][0] < 20.0


def test_errors_along_the_rail_are_those_of_the_traces():
    found = birthsim.evaluate("BirthSIM/Rail-v0", "pid", episodes=2, progress=False, parameters=RIG)
    traced = 1e3 * np.sqrt(np.mean(np.square(found.traces[0][:, 0]).sum(axis=1)))
    assert found.metrics["error_rms_x"][0] == pytest.approx(traced, rel=0.02)
    assert found.settled_error()["max"] < 5.0


def test_an_idle_cylinder_draws_no_air_and_turns_no_valves():
    """The air of a rail is what its own two valves let in: the plant's flows, summed beside the metric."""
    env = birthsim.make_vec("BirthSIM/Rail-v0", 1, parameters=RIG)
    env.reset(seed=0)
    plant, drawn = env.simulation.plant, 0.0
    for _ in range(40):
        *_, info = env.step(np.array([[0.2, 0.2]], np.float32))
        flows = plant.mass_flows()
        assert np.all(flows[[0, 1, 4, 5]] == 0.0)
        drawn += 0.01 * np.maximum(flows[2:4], 0.0).sum()
    assert info["air_used"][0] == pytest.approx(drawn, rel=1e-9)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"id": "BirthSIM/Rail-v0", "parameters": {"mechanics.mass": 4.0}}, ("linkage.kind", "two-cylinders", "rail")),
        ({"id": "BirthSIM/Circle-v2", "parameters": RIG}, ("linkage.kind", "rail", "two-cylinders")),
        ({"id": "BirthSIM/Rail-v0", "parameters": RIG, "reference": FixedTarget((0.5, 0.0))}, ("reference", "rail", "0.5")),
        ({"id": "BirthSIM/Rail-v0", "reference": Sine(amplitude=0.3)}, ("reference", "rail", "0.3 to 0.7")),
        ({"id": "BirthSIM/Rail-v0", "randomize": {"linkage.inclination": (0, 1)}}, ("linkage.inclination", "randomize")),
    ],
)
def test_what_is_not_for_one_cylinder_is_refused_by_name(arguments, named):
    with pytest.raises(ValueError, match=named[0]) as refused:
        birthsim.make(arguments.pop("id"), **arguments).reset(seed=0)
    assert all(word in str(refused.value) for word in named)


def test_a_level_rail_bears_a_mass_that_the_cylinder_could_not_lift():
    heavy = RIG.replace({"mechanics.mass": 40.0, "linkage.inclination": 0.0})
    birthsim.make("BirthSIM/Rail-v0", parameters=heavy).reset(seed=0)
    upright = heavy.replace({"linkage.inclination": math.pi / 2})
    with pytest.raises(ValueError, match=r"Mechanics\.mass = 40 kg .* cylinder 2"):
        birthsim.make("BirthSIM/Rail-v0", parameters=upright).reset(seed=0)


BENCHES = [path for path in sorted(EXAMPLES.glob("*_rig.toml")) if load_parameters(path).linkage.is_rail]


@pytest.mark.parametrize("bench", BENCHES, ids=lambda path: path.stem)
def test_benches_of_the_examples_are_whole_and_a_controller_moves_them(bench):
    """Each names its source or says that it is assumed, parameter by parameter."""
    lines = [line for line in bench.read_text(encoding="utf-8").splitlines() if re.match(r"[a-z_]+ = [\d.]", line)]
    assert all("#" in line for line in lines)
    rig = load_parameters(bench)
    result = birthsim.evaluate(
        "BirthSIM/Rail-v0", "admittance", parameters=rig, sensors="encoders", randomize=False, episodes=1, progress=False
    )
    assert not any(result.lost)
    assert result.metrics["settled_rms"][0] < 1.0


def test_there_are_three_published_benches():
    assert len(BENCHES) >= 4
