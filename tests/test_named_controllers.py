"""Controllers by name: those of the package, and a user's own from a file."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

from baselines.backstepping import BacksteppingController
from baselines.registry import controller_names, make_controller
from birthsim_env import Parameters
from tests.test_evaluation import Spy, run

PROBE, CIRCLE = "BirthSIM/Probe-v0", "BirthSIM/Circle-v0"
RIG = Parameters()


OWN = """
from __future__ import annotations
from dataclasses import dataclass
import numpy as np

@dataclass
class Own:
    parameters: object
    share: float = 0.05

    def command(self, measurement, reference):
        assert self.parameters.mechanics.mass == 3.5
        return np.full((4, measurement.position.shape[1]), self.share) * [[1], [-1], [1], [-1]]

    def reset(self, lanes=None):
        pass

def made_by_a_function(parameters):
    return Own(parameters, 0.0)

class Wordless:
    def __init__(self, parameters):
        pass

number = 3
"""


@pytest.fixture
def own(tmp_path):
    path = tmp_path / "own.py"
    path.write_text(OWN)
    return path


def test_a_controller_from_a_users_own_file_runs_as_named(own):
    rig = RIG.replace({"mechanics.mass": 3.5})
    chosen = make_controller(f"{own}:Own", rig)
    assert type(chosen).__name__ == "Own"
    assert chosen.parameters == rig
    spy = Spy(chosen)
    result = run(spy, duration=0.1, parameters=rig)
    np.testing.assert_array_equal(np.unique(spy.commands), [-0.05, 0.05])
    assert result.metrics["error_rms_x"][0] > 0
    assert make_controller(f"{own}:made_by_a_function", rig).share == 0
    assert make_controller(f"{own}:Own", rig, share=0.2).share == 0.2


def test_two_files_of_one_name_are_two_controllers(tmp_path):
    made = []
    for folder, share in (("a", "0.1"), ("b", "0.2")):
        (tmp_path / folder).mkdir()
        path = tmp_path / folder / "numpy.py"
        path.write_text(OWN.replace("0.05", share))
        made.append(make_controller(f"{path}:Own", RIG))
    assert [one.share for one in made] == [0.1, 0.2]
    # A file called numpy.py hides no package.
    import numpy

    assert numpy is np


def test_the_named_controllers_are_the_law_with_and_without_weight():
    assert {"backstepping", "backstepping-weight", "residual"} <= set(controller_names())
    env = gymnasium.make_vec(CIRCLE, num_envs=2)
    env.reset(seed=0)
    for name, weight in (("backstepping", False), ("backstepping-weight", True)):
        expected = BacksteppingController(RIG, weight_compensation=weight).command(env.measurement, env.reference)
        np.testing.assert_array_equal(make_controller(name, RIG).command(env.measurement, env.reference), expected)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("backsteping", r"controller = 'backsteping'; allowed: backstepping, backstepping-weight, .*path/to/file\.py:Class"),
        ("", r"controller = ''; allowed: backstepping"),
        ("own.py", r"controller = '{folder}/own\.py'; allowed: .*path/to/file\.py:Class"),
        ("missing.py:Own", r"'{folder}/missing\.py' does not exist; allowed: path/to/file\.py:Class"),
        ("own.py:Missing", r"'{folder}/own\.py' has no 'Missing'; allowed: a class with command\(\) and reset\(\)"),
        ("own.py:", r"'{folder}/own\.py' has no ''; allowed: a class"),
        ("own.py:number", r"'{folder}/own\.py:number'.* allowed: a class with command\(\) and reset\(\)"),
        ("own.py:Wordless", r"'{folder}/own\.py:Wordless'.* allowed: a class with command\(\) and reset\(\)"),
    ],
)
def test_what_is_no_controller_is_refused_with_its_name_and_what_there_is(own, name, message):
    given = f"{own.parent}/{name}" if ".py" in name else name
    with pytest.raises(ValueError, match=message.replace("{folder}", str(own.parent))):
        make_controller(given, RIG)
