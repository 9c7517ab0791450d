"""What users of Gymnasium and control engineers expect to find."""

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers import TimeAwareObservation

from baselines.bench.evaluation import evaluate
from baselines.registry import make_controller
from birthsim_env import Parameters

CIRCLE = "BirthSIM/Circle-v1"


def single(**arguments):
    return gymnasium.make(CIRCLE, **arguments)


def vector(**arguments):
    return gymnasium.make_vec(CIRCLE, num_envs=2, **arguments)


@pytest.mark.parametrize("make", [single, vector])
def test_a_specification_has_the_steps_of_an_episode(make):
    assert make().unwrapped.spec.max_episode_steps == 1600
    assert make(duration=2.0, policy_period=0.02).unwrapped.spec.max_episode_steps == 100
    assert make(max_episode_steps=7).spec.max_episode_steps == 7


def test_the_environment_itself_truncates_and_a_wrapper_that_counts_knows_when():
    env = TimeAwareObservation(single(duration=0.05), flatten=False)
    env.reset(seed=0)
    seen = [env.step(np.zeros(4)) for _ in range(5)]
    assert [step[3] for step in seen] == [False] * 4 + [True]
    assert [int(step[0]["time"][0]) for step in seen] == [1, 2, 3, 4, 5], "of the five of its specification"


def test_the_environment_made_again_from_its_specification_ends_at_the_same_step():
    env = gymnasium.make(single(duration=0.03).spec)
    env.reset(seed=0)
    assert [env.step(np.zeros(4))[3] for _ in range(3)] == [False, False, True]


@pytest.mark.parametrize("make", [single, vector])
def test_rig_and_time_step_are_attributes(make):
    env = make(parameters={"mechanics": {"mass": 4.0}}, policy_period=0.02).unwrapped
    assert env.dt == 0.02
    assert env.parameters == Parameters().replace({"mechanics.mass": 4.0})


def test_a_mapping_that_is_no_rig_is_refused_as_the_argument():
    with pytest.raises(ValueError, match="parameters: a = 1; allowed: a section"):
        single(parameters={"a": 1})


def test_a_number_is_a_stiffness_of_both_axes_for_all_time():
    env = single(stiffness=1500)
    for time in (0.0, 9.0):
        env.reset(seed=0)
        env.unwrapped.simulation.time[:] = time
        np.testing.assert_array_equal(env.step(np.zeros(4))[4]["stiffness_setpoint"], 1500.0)


@pytest.mark.parametrize("make", [single, vector])
def test_all_numbers_in_info_are_numpys(make):
    """`is_success` of a single environment is a bool: Gymnasium's own conversion to tensors knows no NumPy one."""
    env = make()
    for info in (env.reset(seed=0)[1], env.step(np.zeros(env.action_space.shape))[-1]):
        assert all(isinstance(value, (np.generic, np.ndarray, bool)) for value in info.values()), info


@pytest.mark.parametrize("make", [single, vector])
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
    (tmp_path / "own.py").write_text(
        "def law(measurement, reference):\n    return 0 * measurement.pressures\n", encoding="utf-8"
    )
    law = make_controller(f"{tmp_path}/own.py:law", Parameters())
    assert evaluate(CIRCLE, law, "own", 1, 0, progress=False, duration=0.1).seeds == [0]
    with pytest.raises(ValueError, match=r"gain = 3\.0 is unknown; allowed for .*: no options"):
        make_controller(f"{tmp_path}/own.py:law[gain=3]", Parameters())


def test_openings_of_four_lanes_that_are_turned_are_refused():
    """(4, N) and (N, 4) look alike where N is 4."""
    with pytest.raises(ValueError, match=r"command\(\) returned an array \(3, 4\); allowed: .*\(4, 3\)"):
        evaluate(CIRCLE, lambda measurement, reference: np.zeros((measurement.position.shape[1], 4)), "turned", 4, 0, False)


def test_a_name_without_its_section_is_asked_about():
    with pytest.raises(ValueError, match=r"'mass' .*did you mean 'mechanics\.mass'"):
        single(randomize={"mass": (1, 2)})
    with pytest.raises(ValueError, match=r"did you mean 'cylinder1\.stroke' or 'cylinder2\.stroke'"):
        single(randomize={"stroke": (1, 2)})


def test_a_window_without_a_display_says_so(monkeypatch):
    from birthsim_env.drawing import rendering

    monkeypatch.setattr(rendering, "UNSEEN", ("dummy", "offscreen", "x11", "wayland"))
    monkeypatch.setattr(rendering, "os", type("Without", (), {"environ": {}}))
    env = single(render_mode="human")
    with pytest.warns(UserWarning, match="rgb_array"):
        env.reset(seed=0)
    env.close()
