"""What users of Gymnasium and control engineers expect to find."""

import inspect
import re
from functools import partial

import gymnasium
import numpy as np
import pytest
from gymnasium import wrappers
from gymnasium.wrappers import vector as lanes

from baselines import evaluate, make_controller
from birthsim_env import Parameters
from birthsim_env.assembly import DEFAULTS, Arguments
from birthsim_env.env import BirthSIMEnv
from birthsim_env.ids import environment_ids
from birthsim_env.physics.compiled.lanes import Rig
from birthsim_env.vector_env import BirthSIMVectorEnv

CIRCLE = "BirthSIM/Circle-v2"
single, vector = partial(gymnasium.make, CIRCLE), partial(gymnasium.make_vec, CIRCLE, num_envs=2)
both = pytest.mark.parametrize("make", [single, vector], ids=["single", "vector"])


@both
def test_steps_of_an_episode_rig_and_time_step_are_attributes(make):
    assert make().unwrapped.spec.max_episode_steps == 1600
    assert make(max_episode_steps=7).spec.max_episode_steps == 7
    for heavier in ({"mechanics": {"mass": 4.0}}, {"mechanics.mass": 4.0}):
        env = make(parameters=heavier, duration=2.0, policy_period=0.02).unwrapped
        assert (env.spec.max_episode_steps, env.dt) == (100, 0.02)
        assert env.parameters == Parameters().replace({"mechanics.mass": 4.0})


PICTURES = {"render_mode": "rgb_array", "picture_size": (320, 240)}
ENDING = {mode: partial(vector, duration=0.08, autoreset_mode=mode) for mode in ("NextStep", "SameStep")}
WRAPPED = {
    "a picture as observation": lambda: wrappers.AddRenderObservation(single(**PICTURES), render_only=True),
    "pictures in a list": lambda: wrappers.RenderCollection(single(**PICTURES)),
    **{f"information in a list, {mode}": lambda made=made: lanes.DictInfoToList(made()) for mode, made in ENDING.items()},
    "flat": lambda: lanes.VectorizeTransformObservation(ENDING["NextStep"](), wrappers.FlattenObservation),
}


@pytest.mark.parametrize("wrapped", WRAPPED.values(), ids=WRAPPED)
def test_wrappers_that_use_more_than_arrays_in_boxes(wrapped):
    """Pictures, and the information of lanes that have ended; ``lab/studies/clients`` has the others."""
    env = wrapped()
    env.reset(seed=0)
    for _ in range(20):
        observation, reward, *_ = env.step(np.zeros(env.action_space.shape, np.float32))
        assert np.shape(observation) == env.observation_space.shape
        assert np.isfinite(reward).all()
    env.close()


def test_a_number_is_a_stiffness_of_both_axes_for_all_time():
    env = single(stiffness=1500)
    for time in (0.0, 9.0):
        env.reset(seed=0)
        env.unwrapped.simulation.time[:] = time
        np.testing.assert_array_equal(env.step(np.zeros(4))[4]["stiffness_setpoint"], 1500.0)


@both
def test_all_numbers_in_info_are_numpys(make):
    """`is_success` of a single environment is a bool: Gymnasium's own conversion to tensors knows no NumPy one."""
    env = make()
    for info in (env.reset(seed=0)[1], env.step(np.zeros(env.action_space.shape))[-1]):
        assert all(isinstance(value, (np.generic, np.ndarray, bool)) for value in info.values()), info


@both
def test_actions_beyond_one_are_clipped_by_choice(make):
    wrong, right = make(clip_actions=True), make()
    wrong.reset(seed=0), right.reset(seed=0)
    action = np.full(right.action_space.shape, 1.194, np.float32)
    np.testing.assert_array_equal(wrong.step(action)[0], right.step(np.ones_like(action))[0])
    with pytest.raises(ValueError, match=r"action\[0\].*clip_actions=True") as caught:
        right.step(action)
    assert "ClipAction" in str(caught.value)
    with pytest.raises(ValueError, match=r"action\[0\] = nan"):
        wrong.step(np.full_like(action, np.nan))


def test_a_function_is_a_controller_and_a_class_is_none():
    shut = {"episodes": 4, "seed": 0, "progress": False, "duration": 0.1}
    found = evaluate(CIRCLE, lambda measurement, reference: np.zeros((4, measurement.position.shape[1])), "shut", **shut)
    assert found.seeds == [0, 1, 2, 3]
    with pytest.raises(ValueError, match="controller = Parameters, a class; allowed: an object"):
        evaluate(CIRCLE, Parameters, "class", **shut)
    with pytest.raises(ValueError, match="controller = 3; allowed: an object with command"):
        evaluate(CIRCLE, 3, "number", **shut)


def test_a_function_in_a_file_is_a_controller_without_options(tmp_path):
    (tmp_path / "own.py").write_text("def law(measurement, reference):\n    return 0 * measurement.pressures\n")
    law = make_controller(f"{tmp_path}/own.py:law", Parameters())
    assert evaluate(CIRCLE, law, "own", 1, 0, progress=False, duration=0.1).seeds == [0]
    with pytest.raises(ValueError, match=r"gain = 3\.0 is unknown; allowed for .*: no options"):
        make_controller(f"{tmp_path}/own.py:law[gain=3]", Parameters())


def test_a_window_without_a_display_says_so(monkeypatch):
    from birthsim_env.drawing import rendering

    monkeypatch.setattr(rendering, "UNSEEN", ("dummy", "offscreen", "x11", "wayland"))
    monkeypatch.setattr(rendering, "os", type("Without", (), {"environ": {}}))
    env = single(render_mode="human")
    with pytest.warns(UserWarning, match="rgb_array"):
        env.reset(seed=0)
    env.close()


@pytest.mark.parametrize("kind", [BirthSIMEnv, BirthSIMVectorEnv, evaluate])
def test_signatures_name_every_argument(kind):
    """A function of plain Python with these arguments is the oracle of what completion finds."""
    shown = inspect.signature(kind).parameters
    inside = {"policy_period", "actuation"} if kind is evaluate else set()
    assert not any(one.kind is one.VAR_KEYWORD for one in shown.values())
    assert set(Arguments.__annotations__) == set(DEFAULTS) == (set(shown) & set(DEFAULTS)) | inside
    assert {name: shown[name].default for name in ("sensors", "duration")} == {"sensors": "ideal", "duration": None}
    documented = re.findall(r"`(\w+)`", re.search(r"## Arguments\n(.*?)\n\n    Controllers", BirthSIMEnv.__doc__, re.DOTALL)[1])
    assert set(DEFAULTS) <= set(documented)


def test_every_argument_that_is_shown_is_taken():
    env = single(**DEFAULTS)
    env.reset(seed=0)
    np.testing.assert_array_equal(env.reset(seed=3)[0], single().reset(seed=3)[0])


def test_info_says_what_a_step_costs():
    """Against the state of the plant, its flows and the parameters, until open valves have driven a piston into its stop.

    Before that, air is shut in on the rods' side, whose section is the smaller one, until its pressure exceeds the supply's.
    """
    hand = {"user_force": lambda time: (30.0, -40.0)}
    env = vector(policy_period=0.001, randomize="plant", autoreset_mode="Disabled", **hand)
    env.reset(seed=3)
    plant, used, deepest, largest, costs = env.unwrapped.simulation.plant, np.zeros(2), 0.0, 0.0, set()
    vented = np.zeros(2)
    for _ in range(900):
        action = np.stack([np.ones(2), -vented, np.ones(2), -vented], axis=1)
        *_, terminated, _, info = env.step(action)
        used += np.maximum(plant.mass_flows()[:4], 0.0).sum(axis=0) * 0.001
        rig = Rig(plant.lane_parameters)
        depth = np.maximum(abs(plant.piston) - np.stack([rig.half_l1, rig.half_l2]), 0.0)
        excess = np.maximum(np.maximum(plant.pressures - rig.supply, rig.atmosphere - plant.pressures), 0.0)
        np.testing.assert_array_equal(info["stop_depth"], depth.T)
        np.testing.assert_array_equal(info["pressure_excess"], excess.T)
        np.testing.assert_array_equal(info["cost"], (depth > 0.0).any(axis=0) | (excess > 0.0).any(axis=0))
        np.testing.assert_allclose(info["hand_force"], 50.0 * (info["time"] > 0.0), rtol=1e-15)
        np.testing.assert_allclose(info["air_used"], used, rtol=1e-12)
        vented = np.maximum(vented, excess.max(axis=0) > 0.0)
        deepest, largest, costs = max(deepest, depth.max()), max(largest, excess.max()), costs | {*info["cost"]}
        if terminated.any():
            break
    assert deepest > 0.0
    assert largest > 0.0
    assert costs == {0.0, 1.0}
    assert (env.reset()[1]["air_used"] == 0.0).all()


def test_every_former_id_names_its_successor_and_says_what_changed():
    """CONTRIBUTING.md promises it of every version that was."""
    names = environment_ids()
    older = [(f"{name[: -len(v)]}{k}", name) for name in names for v in [name.rpartition("-v")[2]] for k in range(int(v))]
    assert {("BirthSIM/Probe-v1", "BirthSIM/Probe-v3"), ("BirthSIM/Circle-v1", "BirthSIM/Circle-v2")} <= {*older}
    for old, new in older:
        for make in (gymnasium.make, gymnasium.make_vec):
            with (
                pytest.warns(DeprecationWarning, match=f"{old} is out of date"),
                pytest.raises(gymnasium.error.DeprecatedEnv, match=f"{old} .*valves and seals.*`{new}`"),
            ):
                make(old)
