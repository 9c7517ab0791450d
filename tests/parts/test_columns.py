"""CSV files of a user: the heading says which column is which."""

import gymnasium
import numpy as np
import pytest

from birthsim_env.parts.columns import columns, csv_file
from birthsim_env.parts.own_parts import COURSE, FORCE

PUSH = {
    "in order": ("time,Fx,Fy\n0,1,-2\n1,3,-4\n", ""),
    "no heading": ("0,1,-2\n1,3,-4\n", ""),
    "turned": ("time,Fy,Fx\n0,-2,1\n1,-4,3\n", ""),
    "with units and more": ("marker,Fy [N],TIME (s),fx(N)\n7,-2,0,1\n8,-4,1,3\n", ""),
    "as NumPy writes it": ("# Fx, time, Fy\n1,0,-2\n3,1,-4\n", ""),
    "a remark before": ("# my hand\n\ntime,Fx,Fy\n0,1,-2\n# break\n1,3,-4\n", ""),
    "other names": ("t,a,b,c\n0,9,-2,1\n1,9,-4,3\n", ":t,c,b"),
}


@pytest.mark.parametrize("kind", PUSH)
def test_a_heading_names_the_columns_in_any_order(kind, tmp_path):
    text, names = PUSH[kind]
    (tmp_path / "push.csv").write_text(text, encoding="utf-8")
    found = columns("user_force", csv_file(f"{tmp_path}/push.csv{names}"), FORCE, tuple(FORCE))
    np.testing.assert_array_equal(found, [[0.0, 1.0, -2.0], [1.0, 3.0, -4.0]])


WRONG = {
    "milliseconds": ("time_ms,Fx,Fy\n0,1,2\n1,1,2\n", "", "'time'"),
    "another unit": ("time (ms),Fx,Fy\n0,1,2\n1,1,2\n", "", "'time' in ms, not in s"),
    "kilonewtons": ("time,Fx [kN],Fy\n0,1,2\n1,1,2\n", "", "'Fx' in kN, not in N"),
    "twice": ("time,Fx,Fx,Fy\n0,1,2,3\n1,1,2,3\n", "", "'Fx' 2 times"),
    "semicolons": ("time;Fx;Fy\n0;1;2\n1;1;2\n", "", "separated by commas"),
    "too few names": ("t,a,b\n0,1,2\n1,1,2\n", ":t,a", "one for each of"),
    "a name that is not there": ("t,a,b\n0,1,2\n1,1,2\n", ":t,a,d", "'d' 0 times"),
    "names without a heading": ("0,1,2\n1,1,2\n", ":t,a,b", "t, a, b"),
    "a short line": ("time,Fx,Fy\n0,1,2\n1,1\n", "", "line 3"),
    "time that goes back": ("Fx,time,Fy\n0,1,2\n1,0.5,2\n", "", "line 3"),
}


@pytest.mark.parametrize("kind", WRONG)
def test_what_a_file_does_not_say_is_refused(kind, tmp_path):
    text, names, allowed = WRONG[kind]
    (tmp_path / "push.csv").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match="user_force = ") as caught:
        columns("user_force", csv_file(f"{tmp_path}/push.csv{names}"), FORCE, tuple(FORCE))
    assert allowed in str(caught.value)
    assert "allowed: " in str(caught.value)


def test_a_stiffness_needs_no_course_beside_it_once_it_is_named(tmp_path):
    (tmp_path / "own.csv").write_text("stiffness,time\n1000,0\n2000,1\n", encoding="utf-8")
    file = csv_file(tmp_path / "own.csv")
    np.testing.assert_array_equal(columns("stiffness", file, COURSE, ("time", "stiffness")), [[0, 1000], [1, 2000]])
    assert csv_file("own.py:Name") is None
    assert csv_file(3.0) is None


def test_a_hand_whose_columns_are_turned_pushes_along_x(tmp_path):
    (tmp_path / "push.csv").write_text("time,Fy,Fx\n0,0,10\n20,0,10\n", encoding="utf-8")
    env = gymnasium.make("BirthSIM/Circle-v1", user_force=f"{tmp_path}/push.csv")
    env.reset(seed=0)
    *_, info = env.step(np.zeros(4))
    np.testing.assert_allclose(info["user_force"], [10.0, 0.0])
