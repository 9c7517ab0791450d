"""Controllers by name: those of the package, and a user's own from a file."""

import gymnasium
import numpy as np
import pytest

from baselines.about import uses_force
from baselines.backstepping.controller import BacksteppingController
from baselines.registry import SHORT_NAMES, controller_names, make_controller, resolved
from birthsim_env import Parameters
from tests.bench.test_evaluation import Spy, run

CIRCLE = "BirthSIM/Circle-v1"
RIG = Parameters()


OWN = """
from dataclasses import dataclass
import numpy as np

@dataclass
class Own:
    parameters: object
    fraction: float = 0.05

    def command(self, measurement, reference):
        assert self.parameters.mechanics.mass == 3.5
        return np.full((4, measurement.position.shape[1]), self.fraction) * [[1], [-1], [1], [-1]]

    def reset(self, lanes=None):
        pass

def made_by_a_function(parameters):
    return Own(parameters, 0.0)
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
    assert make_controller(f"{own}:made_by_a_function", rig).fraction == 0
    assert make_controller(f"{own}:Own", rig, fraction=0.2).fraction == 0.2


def test_two_files_of_one_name_are_two_controllers(tmp_path):
    made = []
    for folder, fraction in (("a", "0.1"), ("b", "0.2")):
        (tmp_path / folder).mkdir()
        path = tmp_path / folder / "numpy.py"
        path.write_text(OWN.replace("0.05", fraction))
        made.append(make_controller(f"{path}:Own", RIG))
    assert [one.fraction for one in made] == [0.1, 0.2]
    # A file called numpy.py hides no package.
    import numpy

    assert numpy is np


def test_short_names_of_the_papers_law_have_their_options():
    assert {"backstepping", "admittance", "residual"} <= set(controller_names())
    env = gymnasium.make_vec(CIRCLE, num_envs=2)
    env.reset(seed=0)
    weight = {"weight_compensation": True}
    names = {"backstepping": {}, "backstepping-weight": weight, "backstepping-frozen": {**weight, "frozen_friction": True}}
    for name, options in names.items():
        expected = BacksteppingController(RIG, **options).command(env.measurement, env.reference)
        np.testing.assert_array_equal(make_controller(name, RIG).command(env.measurement, env.reference), expected)


@pytest.mark.parametrize("name", SHORT_NAMES)
def test_a_short_name_is_its_controller_with_options_and_takes_more(name):
    assert resolved(name) == resolved(SHORT_NAMES[name])
    assert resolved(f"limited:{name}[lead_time=2]") == (resolved(name)[0], {**resolved(name)[1], "lead_time": 2.0})
    short, long = (make_controller(one, RIG) for one in (name, SHORT_NAMES[name]))
    assert type(short) is type(long)
    for one, other in zip(short.law_stages(True), long.law_stages(True), strict=True):
        assert one.function is other.function
        np.testing.assert_array_equal(one.constants, other.constants)


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("backstepping-weight", False), ("shut-valves", False), ("admittance-sensorless", False),
        ("admittance[force_sensor=false,identified=true]", False), ("residual:circle_honest_student", False),
        ("residual:circle", True), ("limited:pid", True), ("limited:backstepping", True), ("admittance[learn=false]", True),
    ],
)  # fmt: skip
def test_a_table_knows_who_is_told_the_force(name, told):
    assert uses_force(name) == told
