"""The residual environments: zero is exactly the law, and what an action may do is bounded, smooth and forgotten on reset."""

import gymnasium
import numpy as np
import pytest

from agents.residual import authority
from agents.residual.corrected import CorrectedController, ResidualActuation
from agents.residual.settings import IMPEDANCES, LAWS, needs_force
from baselines.named import make_controller
from birthsim_env import Parameters
from birthsim_env.ids import rig_for
from birthsim_env.info import FIELDS
from birthsim_env.observation import ENTRIES, SIZE
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.registry import names
from tests.covering import thinned
from tests.oracles.residual_parts import UnexplainedForceObserver

IDS = tuple(environment_id(name, "Residual") for name in names("scenario"))
CIRCLE, PROBE = "BirthSIM/CircleResidual-v2", "BirthSIM/ProbeResidual-v3"
RIG = Parameters()
SENSED = thinned(LAWS[:-1], names("sensors"))


def single(name=CIRCLE, **arguments):
    return gymnasium.make(name, **arguments).unwrapped


def lanes(count, name=CIRCLE, **arguments):
    return gymnasium.make_vec(name, num_envs=count, autoreset_mode="SameStep", **arguments)


def random_actions(steps, count, size=2, seed=0):
    return np.random.default_rng(seed).uniform(-1, 1, (steps, count, size)).astype(np.float32)


def by_hand(name, steps, seed, told=None, law="backstepping", periods=10, **arguments):
    """The base environment at 1 kHz, driven by the law from measurements; its state and info after every policy step.

    ``told(tick)`` is what the law is told about in control period ``tick``: a force (2,), N, and its rate (2,), N/s.
    """
    env = gymnasium.make(name.replace("Residual", ""), policy_period=1e-3, **arguments).unwrapped
    controller = make_controller(law, rig_for(name, arguments.get("parameters")))
    env.reset(seed=seed)
    rows = []
    for step in range(steps):
        for tick in range(periods * step, periods * (step + 1)):
            believed = () if told is None else told(tick)
            openings = controller.command(env.measurement, env.reference, *believed)
            # On a rail the valves of cylinder 2 alone are there.
            _, _, terminated, truncated, info = env.step(openings[-env.action_space.shape[0] :])
        rows.append((env.simulation.plant.state.copy(), info, terminated, truncated))
    return rows


def assert_follows(env, actions, rows, seed):
    """The residual environment under ``actions`` goes, bit for bit, through ``rows`` of ``by_hand``."""
    env.reset(seed=seed)
    for action, (state, expected, terminated, truncated) in zip(actions, rows, strict=True):
        _, _, its_end, its_limit, info = env.step(action)
        np.testing.assert_array_equal(env.simulation.plant.state, state)
        assert (its_end, its_limit) == (terminated, truncated)
        for field in set(FIELDS) - {"impact_speed", "air_used"}:
            np.testing.assert_array_equal(info[field], expected[field], err_msg=field)


@pytest.mark.parametrize(("law", "sensors"), [pytest.param(*pair, marks=seldom) for *pair, seldom in SENSED])
def test_zero_actions_are_bit_for_bit_the_law(sensors, law):
    arguments = {"sensors": sensors, "randomize": True}
    rows = by_hand(CIRCLE, 140, 3, law=law, **arguments)
    settings = [(size, {"impedance": name}) for name, size in IMPEDANCES.items() if size == 2 or law.startswith("backstepping")]
    settings += [(2, {"informed": True}), *([] if needs_force(law) else [(2, {"force_sensor": False})])]
    for size, more in settings:
        env = single(law=law, **more, **arguments)
        assert_follows(env, np.zeros((140, size), np.float32), rows, seed=3)
    # It was no standstill: the first push has come.
    assert np.abs(rows[-1][1]["user_force"]).max() > 5


@pytest.mark.parametrize("name", IDS[1:])
def test_zero_actions_are_the_law_in_every_scenario_up_to_its_end(name):
    steps = 80
    rows = by_hand(name, steps, 0, duration=steps * 0.01)
    assert rows[-1][3]
    env = single(name, duration=steps * 0.01)
    assert_follows(env, np.zeros((steps, *env.action_space.shape), np.float32), rows, seed=0)


@pytest.fixture
def unguarded(monkeypatch):
    """Nothing that oscillates costs authority."""
    monkeypatch.setattr(authority, "LEVEL", np.inf)


@pytest.mark.parametrize(
    ("law", "authority", "constant", "period"),
    [
        ("backstepping", 40.0, 0.028, 0.01),
        ("backstepping-weight", 15.0, 0.001, 0.01),
        ("backstepping-frozen", 80.0, 0.1, 0.02),
        ("admittance-backstepping", 25.0, 0.028, 0.001),
    ],
)
def test_a_held_action_becomes_a_feedforward_force_and_its_rate_through_the_low_pass(
    law, authority, constant, period, unguarded
):
    """z' = (a - z)/T at 1 kHz: after n periods z = a (1 - exp(-n ms/T)), and the force changes at authority (a - z)/T."""
    steps, periods, action = 40, round(1000 * period), np.array([0.75, -0.5], np.float32)
    whole = authority * action.astype(np.float64)

    def told(tick):
        left = np.exp(-1e-3 * tick / constant)
        return whole * (1 - left), whole * left / constant

    rows = by_hand(CIRCLE, steps, 1, told, law, periods)
    env = single(law=law, authority=authority, time_constant=constant, policy_period=period)
    env.reset(seed=1)
    for state, expected, _, _ in rows:
        _, _, _, _, info = env.step(action)
        # The closed form and the recursion differ in rounding alone.
        np.testing.assert_allclose(info["position"], expected["position"], rtol=0, atol=1e-9)
        np.testing.assert_allclose(env.simulation.plant.state[6:14], state[6:14], rtol=1e-6)
    # Force and rate are felt: the law alone goes elsewhere, and so does one that is told of the force without its rate.
    for other in (None, lambda tick: told(tick)[:1]):
        untold = by_hand(CIRCLE, steps, 1, other, law, periods)
        assert np.abs(rows[-1][1]["position"] - untold[-1][1]["position"]).max() > 1e-7


@pytest.fixture
def told(monkeypatch):
    """Forces (2, N), N, and rates (2, N), N/s, that the law inside was told about, (4, N) a control period: the loop, else
    compiled, stops for it."""
    beliefs, command = [], CorrectedController.command

    def spied(self, measurement, reference):
        openings = command(self, measurement, reference)
        assert not self.feedforward[4].any()
        beliefs.append(self.feedforward[:4])
        return openings

    monkeypatch.setattr(ResidualActuation, "stages", lambda *_: None)
    monkeypatch.setattr(CorrectedController, "command", spied)
    return beliefs


def test_the_feedforward_force_never_exceeds_the_authority_and_changes_at_the_control_rate(told, unguarded):
    env = lanes(4, authority=25.0, time_constant=0.02)
    env.reset(seed=0)
    actions = np.sign(random_actions(50, 4, seed=4))
    actions[30:] = 1.0
    for action in actions:
        env.step(action)
    forces, rates = np.array(told).reshape(50, 10, 2, 2, 4).transpose(2, 0, 1, 3, 4)
    smooth = np.zeros((2, 4))
    for k, action in enumerate(actions):
        for tick in range(10):
            np.testing.assert_allclose(forces[k, tick], 25 * smooth, rtol=1e-9, atol=1e-12)
            np.testing.assert_allclose(rates[k, tick], 25 / 0.02 * (action.T - smooth), rtol=1e-9, atol=1e-9)
            smooth += (1 - np.exp(-1e-3 / 0.02)) * (action.T - smooth)
    assert np.abs(forces).max() <= 25
    assert forces[-1, -1].min() > 24.9


def test_oscillation_costs_authority_and_what_is_left_is_seen(told):
    """Lane 0 is shaken at 7 Hz with all that an action may say; lane 1 is left alone."""
    env, actions, fractions = lanes(2, PROBE, authority=400.0, duration=4.0), np.zeros((2, 2), np.float32), []
    env.reset(seed=0)
    columns = [env.observation_names.index(f"fraction of the authority on cylinder {i}, 1") for i in (1, 2)]
    for step in range(150):
        actions[0] = np.sign(np.sin(2 * np.pi * 7 * 0.01 * step + 0.1))
        fractions.append(env.step(actions)[0][:, columns].T)
    fractions, smooth = np.array(fractions), np.zeros(2)
    np.testing.assert_array_equal(fractions[:, :, 1], 1.0)
    assert np.all(np.diff(fractions[:, :, 0], axis=0) <= 0)
    assert fractions[-1, :, 0].min() < 0.5
    for step in range(150):
        action = np.sign(np.sin(2 * np.pi * 7 * 0.01 * step + 0.1))
        for _ in range(10):
            believed = smooth
            smooth = smooth + (1 - np.exp(-1 / 28)) * (action - smooth)
        # In the last period of a step the fraction was the one that the policy sees after it.
        force, rate = told[10 * step + 9][:, 0].reshape(2, 2)
        np.testing.assert_allclose(force, 400 * fractions[step, :, 0] * believed, rtol=1e-5, atol=1e-9)
        np.testing.assert_allclose(rate, 400 * fractions[step, :, 0] / 0.028 * (action - believed), rtol=1e-5)


@pytest.mark.parametrize(
    ("arguments", "size"),
    [({}, 2), ({"impedance": "variable_kp"}, 4), ({"impedance": "variable"}, 5), ({"law": "none"}, 4)],
)
def test_observations_end_with_the_last_action_and_what_the_law_remembers(arguments, size):
    env = lanes(2, time_constant=0.02, **arguments)
    assert env.single_action_space == gymnasium.spaces.Box(-1, 1, (size,), np.float32)
    assert env.single_observation_space.shape == (SIZE + 2 * size + 8,) == (len(env.observation_names),)
    names = list(env.observation_names)
    assert names[:SIZE] == [str(entry) for entry in ENTRIES]
    said = [name.removeprefix("last action: ") for name in names[SIZE : SIZE + size]]
    assert names[SIZE + size : SIZE + 2 * size] == [f"smoothed action: {name}" for name in said]
    word = "opening" if "law" in arguments else "believed force"
    assert [word in name for name in said[:2]] == [True, True]
    assert all("fraction" in name for name in names[-8:-6])
    assert all(name.startswith("unexplained force on piston") for name in names[-6:])
    assert len(set(names)) == len(names)
    observation, _ = env.reset(seed=0)
    np.testing.assert_array_equal(observation[:, SIZE:], [[0] * 2 * size + [1, 1] + [0] * 6] * 2)
    actions = random_actions(1, 2, size)[0]
    observation, _, _, _, infos = env.step(actions)
    np.testing.assert_array_equal(observation[:, SIZE : SIZE + size], actions)
    np.testing.assert_allclose(observation[:, SIZE + size : SIZE + 2 * size], (1 - np.exp(-10 / 20)) * actions, rtol=1e-6)
    np.testing.assert_allclose(infos["reward_action_change"], -0.2 / 8.75 * np.abs(actions).mean(axis=1), rtol=1e-6)


@pytest.mark.parametrize("sensors", ["ideal", "lab"])
def test_observations_tell_what_the_pistons_met_as_the_rigs_owner_describes_it(sensors):
    env = lanes(3, PROBE, sensors=sensors, randomize=True, policy_period=1e-3)
    observation, _ = env.reset(seed=5)
    observer = UnexplainedForceObserver(RIG, 3)
    for _ in range(400):
        observer.update(env.measurement)
        observation = env.step(np.zeros((3, 2), np.float32))[0]
        np.testing.assert_array_equal(observation[:, -6:], np.clip(observer.met.T / 100, -10, 10).astype(np.float32))
    assert np.abs(observation[:, -6:]).max() > 0.05
