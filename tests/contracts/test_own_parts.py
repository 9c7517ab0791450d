"""A user's own reference, hand and stiffness: what they lack, and answers that are none, are refused by name in one line."""

import gymnasium
import numpy as np
import pytest

from birthsim_env import StiffnessSchedule, Trajectory, UserForce

PARTS = {
    "reference": (Trajectory, "sample", "reference.sample(time)"),
    "user_force": (UserForce, "force", "user_force.force(...)"),
    "stiffness": (StiffnessSchedule, "sample", "stiffness.sample(time"),
}
"""Argument -> its class, the method that answers, and how a refusal calls it."""

SETPOINTS = [[2e3], [1e3], [4e3], [2e3], [0.0], [0.0], [0.0]]
ANSWERS = [
    ("reference", np.full((2, 1), 0.5), ("(2, 1)", "(8, 1)")),
    ("reference", np.zeros(8), ("(8,)", "(8, 1)")),
    ("reference", np.full((8, 1), np.nan), ("[0, 0] = nan", "finite")),
    ("reference", None, ("(8, 1)",)),
    ("reference", [["a"]] * 8, ("'a'", "numbers of shape (8, 1)")),
    ("user_force", np.zeros((2, 1)), ("(2, 1)", "(10, 2, 1)")),
    ("user_force", np.zeros((1, 2, 1)), ("(1, 2, 1)", "(10, 2, 1)")),
    ("user_force", np.full((10, 2, 1), np.inf), ("[0, 0, 0] = inf", "finite")),
    ("user_force", None, ("(10, 2, 1)",)),
    ("user_force", "push", ("= 'push'", "numbers of shape (10, 2, 1)")),
    ("stiffness", np.ones((4, 1)), ("(4, 1)", "(7, 1)")),
    ("stiffness", np.full((7, 1), np.inf), ("[0, 0] = inf", "finite")),
    ("stiffness", np.array([[2e3], [0.0], *SETPOINTS[2:]]), (" = 0 s) = 0 N/m", "more than 0")),
    ("stiffness", np.array([*SETPOINTS[:6], [2e3]]), ("Kclxy = 2000 N/m", "below sqrt(Kclx Kcly)")),
]


@pytest.mark.parametrize(("argument", "answer", "words"), ANSWERS)
def test_an_answer_that_is_none_is_refused_by_name(argument, answer, words):
    base, method, name = PARTS[argument]
    wrong = type("Wrong", (base,), {method: lambda self, *asked: answer})()
    with pytest.raises(ValueError, match="allowed") as refusal:
        gymnasium.make("BirthSIM/Probe-v3", **{argument: wrong}).reset(seed=0)
    assert all(word in str(refusal.value) for word in (name, *words)), refusal.value
    assert "\n" not in str(refusal.value)


def test_a_part_without_its_method_says_what_is_missing():
    with pytest.raises(NotImplementedError, match=r"Trajectory.sample\(time\) is missing; .*\(8, N\)"):
        gymnasium.make("BirthSIM/Probe-v3", reference=Trajectory()).reset(seed=0)
    with pytest.raises(NotImplementedError, match=r"UserForce.force\(time, position, velocity\) is missing"):
        gymnasium.make("BirthSIM/Probe-v3", user_force=UserForce()).reset(seed=0)
