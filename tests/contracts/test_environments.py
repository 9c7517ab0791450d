"""Every environment: each scenario, sensor model, hand, law and impedance, options of the plant, drawn and as described.

A lane is the environment alone; a reset of some lanes leaves the others alone; a state goes on. All of it to the last bit.
"""

import importlib
import io
import itertools

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env as gymnasium_check
from stable_baselines3.common.env_checker import check_env as stable_baselines_check

import birthsim_env
from agents.residual.settings import IMPEDANCES, LAWS
from birthsim_env.ids import environment_ids
from birthsim_env.info import FIELDS
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.registry import names
from birthsim_env.reward import REWARD_TERMS
from tests.covering import thinned
from tests.physics.plant.test_options import EACH, WORTH

CIRCLE, RESIDUAL, FORCEPS = "BirthSIM/Circle-v2", "BirthSIM/CircleResidual-v2", "BirthSIM/Forceps-v2"
FELT = Parameters().replace({"electronics.acceleration_bandwidth": 300.0, "electronics.force_bandwidth": 20.0})
SCENES, INSIDE = thinned(names("scenario"), names("sensors")), thinned(LAWS, names("sensors"))
WORLDS = {
    **{f"{name} {sensors}": (environment_id(name), {"sensors": sensors, "randomize": True}) for name, sensors, _ in SCENES},
    **{f"hand {hand}": (CIRCLE, {"user_force": hand, "randomize": True}) for hand in names("hand")},
    **{f"law {law} {sensors}": (RESIDUAL, {"law": law, "sensors": sensors, "randomize": True}) for law, sensors, _ in INSIDE},
    **{f"impedance {mode}": ("BirthSIM/DystociaResidual-v2", {"impedance": mode}) for mode in IMPEDANCES},
    **{f"option {name}": (CIRCLE, {"parameters": Parameters().replace(changes)}) for name, changes in EACH.items()},
    "flows": (FORCEPS, {"action_mode": "flow", "valves": "one_valve"}),
    "one valve": (FORCEPS, {"valves": "one_valve"}),
    "as described": ("BirthSIM/Descent-v2", {"action_mode": "flow", "policy_period": 0.02}),
    "drawn mass": ("BirthSIM/Descent-v2", {"randomize": {"mechanics.mass": (2, 5)}}),
    "drawn options": (CIRCLE, {"randomize": {name: pair for name, pair in WORTH.items() if "electronics" not in name}}),
    **{f"acceleration {sensors}": (CIRCLE, {"sensors": sensors, "parameters": FELT}) for sensors in ("lab", "honest")},
}  # fmt: skip
SELDOM = {f"{name} {sensors}": marks for name, sensors, marks in SCENES}
SELDOM |= {f"law {law} {sensors}": marks for law, sensors, marks in INSIDE}
every_world = pytest.mark.parametrize("world", [pytest.param(world, marks=SELDOM.get(world, ())) for world in WORLDS])


def made(world, lanes, **more):
    name, arguments = WORLDS[world]
    return gymnasium.make_vec(name, **{"num_envs": lanes, "duration": 0.24, "autoreset_mode": "SameStep", **arguments, **more})


def random_actions(env, steps, seed=0):
    """(steps, N, size): each other lane is driven one way, and some of these into an end stop."""
    actions = np.random.default_rng(seed).uniform(-1, 1, (steps, *env.action_space.shape)).astype(np.float32)
    actions[:, 1::2] = np.sign(actions[0, 1::2])
    return actions


def follow(env, actions, seed):
    """What one environment returns from ``reset`` and, step by step, with the start of the episode after an end."""
    yield env.reset(seed=seed)
    for action in actions:
        observation, reward, terminated, truncated, info = env.step(action)
        yield observation, reward, terminated, truncated, info, env.reset() if terminated or truncated else None


def assert_lane(infos, lane, info, where=""):
    """Equal to the last bit, NaN included."""
    for name in (*FIELDS, *REWARD_TERMS, "is_success"):
        assert (name in infos) == (name in info), where
        if name in info:
            np.testing.assert_array_equal(infos[name][lane], np.asarray(info[name]), err_msg=f"{where} {name}", strict=True)


IDS = environment_ids()
FACES = thinned([*itertools.product(("valve", "flow"), ("two_valves", "one_valve"))], names("sensors"))
CHECKED = [
    pytest.param(CIRCLE, {"action_mode": mode, "valves": valves, "sensors": sensors}, marks=marks)
    for (mode, valves), sensors, marks in FACES
] + [
    pytest.param(name, {"sensors": sensors, "randomize": True}, marks=marks)
    for name, sensors, marks in thinned(IDS, names("sensors"))
]


@pytest.mark.parametrize(("name", "arguments"), CHECKED)
def test_both_checkers_find_nothing_to_say(name, arguments, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    gymnasium_check(gymnasium.make(name, render_mode="rgb_array", **arguments).unwrapped)
    stable_baselines_check(gymnasium.make(name, **arguments).unwrapped)


def test_importing_again_neither_warns_nor_changes_the_registry():
    before = {name: gymnasium.registry[name] for name in IDS}
    assert set(IDS) == {environment_id(name, kind) for name in names("scenario") for kind in ("", "Residual")}
    importlib.reload(birthsim_env)
    assert all(gymnasium.registry[name] is spec for name, spec in before.items())


@pytest.mark.parametrize("name", IDS)
def test_a_spec_makes_both_classes_and_the_same_world_again(name):
    env = gymnasium.make(name, sensors="lab", randomize=True, policy_period=0.02)
    kind = "Residual" if "Residual" in name else "BirthSIM"
    assert type(env.unwrapped).__name__ == f"{kind}Env"
    copy = gymnasium.make(gymnasium.envs.registration.EnvSpec.from_json(env.spec.to_json()))
    action = np.full(env.action_space.shape, 0.1, np.float32)
    env.reset(seed=3), copy.reset(seed=3)
    np.testing.assert_array_equal(env.step(action)[0], copy.step(action)[0])
    assert type(gymnasium.make_vec(name, num_envs=2)).__name__ == f"{kind}VectorEnv"


@every_world
def test_a_lane_is_the_environment_alone_through_its_episodes(world):
    """Lanes of two blocks of 32, the last incomplete, beyond the ends of several episodes."""
    name, arguments = WORLDS[world]
    env, chosen = made(world, 34), (0, 1, 33)
    actions = random_actions(env, 30)
    single = [gymnasium.make(name, duration=0.24, **arguments).unwrapped for _ in chosen]
    alone = {lane: follow(one, actions[:, lane], 70 + lane) for lane, one in zip(chosen, single, strict=True)}
    observation, infos = env.reset(seed=70)
    begun = 0
    for lane, walk in alone.items():
        first, info = next(walk)
        np.testing.assert_array_equal(observation[lane], first)
        assert_lane(infos, lane, info)
    for step, action in enumerate(actions):
        observation, rewards, terminated, truncated, infos = env.step(action)
        assert env.observation_space.contains(observation)
        assert np.isfinite(rewards).all()
        over = terminated | truncated
        assert ("final_obs" in infos) == ("final_info" in infos) == over.any()
        if over.any():
            np.testing.assert_array_equal(infos["_final_obs"], over)
            assert all((last is not None) == ended for last, ended in zip(infos["final_obs"], over, strict=True))
        for lane, walk in alone.items():
            where = f"lane {lane}, step {step}"
            last, reward, ended, cut, info, after = next(walk)
            assert (rewards[lane], terminated[lane], truncated[lane]) == (reward, ended, cut), where
            begun += after is not None
            if after is None:
                np.testing.assert_array_equal(observation[lane], last, err_msg=where)
                assert_lane(infos, lane, info, where)
            else:
                np.testing.assert_array_equal(infos["final_obs"][lane], last, err_msg=where)
                assert_lane(infos["final_info"], lane, info, where)
                np.testing.assert_array_equal(observation[lane], after[0], err_msg=where)
                assert infos["_final_info"][lane], where
                for name in FIELDS:
                    np.testing.assert_array_equal(infos[name][lane], after[1][name], err_msg=f"{where} {name}")
                assert (infos["time"][lane], infos["is_success"][lane]) == (0.0, False), where
                assert not (ended and info["is_success"]), where
    assert begun >= len(chosen)


@every_world
def test_a_reset_of_one_lane_leaves_the_others_alone(world):
    """Within a policy step of each other: what all lanes share is made anew, and no bit of the others changes."""
    kept, reset = made(world, 3), made(world, 3)
    actions, mask = random_actions(kept, 11, 1) / 20, np.array([False, True, False])
    kept.reset(seed=[3, 4, 5]), reset.reset(seed=[3, 4, 5])
    for step, action in enumerate(actions):
        if step == 5:
            _, info = reset.reset(options={"reset_mask": mask})
            assert info["time"][1] == 0.0
        one, other = kept.step(action), reset.step(action)
        for a, b in zip(one[:4], other[:4], strict=True):
            np.testing.assert_array_equal(b[~mask], a[~mask])
        if step >= 5:
            assert other[4]["time"][1] < one[4]["time"][1]


def saved(state):
    file = io.BytesIO()
    np.savez(file, **state)
    file.seek(0)
    with np.load(file, allow_pickle=False) as content:
        return dict(content)


def assert_same_steps(one, other, given):
    for action in given:
        expected, actual = one.step(action), other.step(action)
        for mine, its in zip(expected[:4], actual[:4], strict=True):
            np.testing.assert_array_equal(its, mine, strict=True)
        for name in FIELDS:
            np.testing.assert_array_equal(actual[4][name], expected[4][name])


@every_world
def test_another_environment_goes_on_from_a_state_over_ends_of_episodes(world):
    one, other = made(world, 3), made(world, 3)
    given = random_actions(one, 60)
    first, _ = one.reset(seed=5, options={"staggered": True})
    begun = one.get_state()
    for action in given[:30]:
        one.step(action)
    state = one.get_state()
    # Whatever the other one did before, and it may have stopped anywhere.
    other.reset(seed=77)
    for action in given[:10]:
        other.step(action)
    other.set_state(saved(state))
    assert_same_steps(one, other, given[30:])
    # The state is a copy, and gives the same future once more.
    other.set_state(state)
    one.set_state(state)
    assert_same_steps(one, other, given[:30])
    np.testing.assert_array_equal(one.reset(seed=5)[0], first)
    # One that was never reset goes on from the state right after a reset.
    fresh = made(world, 3)
    for env in (one, fresh):
        env.set_state(begun)
    assert_same_steps(one, fresh, given[:10])
