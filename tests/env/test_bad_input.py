"""Bad input is refused with a message that names argument, value and what is allowed, and leaves the environment as it was."""

import math
import re

import gymnasium
import numpy as np
import pytest

import birthsim_env  # noqa: F401  registers the ids

CIRCLE = "BirthSIM/Circle-v2"
NAN, INF = math.nan, math.inf


def refused(*words):
    return pytest.raises(ValueError, match="(?s)" + "".join(f"(?=.*{re.escape(word)})" for word in ("allowed", *words)))


ACTIONS = [
    # of one environment
    ((0, 0, 0, NAN), ("action[3] = nan", "-1 to 1")),
    ((0, -INF, 0, 0), ("action[1] = -inf", "-1 to 1")),
    ((0, 0, 1.001, 0), ("action[2] = 1.001", "-1 to 1")),
    ((-3, 0, 0, 0), ("action[0] = -3.0", "-1 to 1")),
    ((0, 0), ("action has shape (2,)", "(4,)")),
    ((0, 0, 0, 0, 0), ("action has shape (5,)", "(4,)")),
    (np.zeros((1, 4)), ("action has shape (1, 4)", "(4,)")),
    (0.5, ("action has shape ()", "(4,)")),
    (None, ("action = [None]", "4 numbers in [-1, 1]")),
    ("open", ("action = ", "'open'", "4 numbers")),
    (("a", "b", "c", "d"), ("action = ", "'a'", "4 numbers")),
    ({"P1": 1.0}, ("action = ", "'P1'", "4 numbers")),
    ((0, 0, (0, 0), 0), ("action = ", "4 numbers")),
    ((1j, 0, 0, 0), ("action = ", "1j", "4 numbers")),
    ((np.nextafter(np.float32(1), np.float32(2)), 0, 0, 1.0001), ("action[3] = 1.0001", "-1 to 1")),  # the first is rounding
]
LANES = [
    # of three lanes
    (np.zeros(4), ("action has shape (4,)", "(3, 4)")),
    (np.zeros((2, 4)), ("action has shape (2, 4)", "(3, 4)")),
    (np.zeros((4, 3)), ("action has shape (4, 3)", "(3, 4)")),
    (np.array([[0.0] * 4, [0, 0, NAN, 0], [0.0] * 4]), ("action[2] = nan in lane 1", "-1 to 1")),
    (np.array([[0.0] * 4, [0.0] * 4, [0, 1.5, 0, 0]]), ("action[1] = 1.5 in lane 2", "-1 to 1")),
    (np.full((3, 4), "x"), ("action = ", "'x'", "numbers in [-1, 1]")),
    ([[0.0] * 4, [0.0] * 3, [0.0] * 4], ("action = ", "numbers in [-1, 1]")),
]


@pytest.mark.parametrize("sensors", ["ideal", "lab"])
@pytest.mark.parametrize(("lanes", "action", "words"), [*((0, *row) for row in ACTIONS), *((3, *row) for row in LANES)])
def test_a_refused_action_leaves_the_environment_as_it_was(lanes, action, words, sensors):
    make, good = (gymnasium.make_vec, np.full((lanes, 4), 0.1)) if lanes else (gymnasium.make, np.full(4, 0.1))
    env, calm = (make(CIRCLE, sensors=sensors, **({"num_envs": lanes} if lanes else {})).unwrapped for _ in range(2))
    for one in (env, calm):
        one.reset(seed=2)
        one.step(good)
    before = env.simulation.plant.state.copy(), env.simulation.time.copy(), env.measurement.position.copy()
    with refused(*words):
        env.step(action)
    after = env.simulation.plant.state, env.simulation.time, env.measurement.position
    for old, new in zip(before, after, strict=True):
        np.testing.assert_array_equal(old, new)
    for _ in range(5):
        for one, other in zip(env.step(good)[:4], calm.step(good)[:4], strict=True):
            np.testing.assert_array_equal(one, other)


def test_a_step_before_reset_is_refused():
    for env, action in (
        (gymnasium.make(CIRCLE).unwrapped, np.zeros(4)),
        (gymnasium.make_vec(CIRCLE, num_envs=2).unwrapped, np.zeros((2, 4))),
    ):
        with pytest.raises(RuntimeError, match=r"reset\(seed=\.\.\.\) first"):
            env.step(action)
        env.reset(seed=0)
        assert np.isfinite(env.step(action)[0]).all()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"positon": (0.5, 0.0)}, ("'positon'", "'position'")),
        ({"position": (0.5,)}, ("options['position'] = (0.5,)", "(x, y)")),
        ({"position": (0.5, NAN)}, ("options['position'] = (0.5, nan)", "finite")),
        ({"position": "centre"}, ("options['position'] = 'centre'", "(x, y)")),
        ({"position": None}, ("options['position'] = None", "(x, y)")),
        ({"position": (0.9, 0.0)}, ("(0.9, 0)", "unreachable", "0.3 to 0.7 m")),
    ],
)
def test_impossible_starts_are_refused_and_the_next_reset_works(options, words):
    for env in (gymnasium.make(CIRCLE), gymnasium.make_vec(CIRCLE, num_envs=2)):
        with refused(*words):
            env.reset(seed=0, options=options)
        observation = env.reset(seed=0)[0]
        fresh = gymnasium.make(CIRCLE).reset(seed=0)[0]
        np.testing.assert_array_equal(observation.reshape(-1, 24)[0], fresh)
