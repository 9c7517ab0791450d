"""Controllers by name: those of the package, and a user's own from a file."""

from dataclasses import replace

import numpy as np
import pytest

from baselines.named import make_controller, resolved, uses_force, with_brackets
from birthsim_env import Parameters
from birthsim_env.registry import entries
from tests.bench.test_evaluation import Spy, run
from tests.contracts.test_controllers import CONTROLLED, recorded

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


@pytest.mark.parametrize("name", [one.name for one in entries("controller") if one.options])
def test_a_short_name_is_its_controller_with_options_and_takes_more(name):
    whole = with_brackets(*resolved(name))
    assert whole.endswith("]")
    assert resolved(name) == resolved(whole)
    assert resolved(f"limited:{name}[lead_time=2]") == (resolved(name)[0], {**resolved(name)[1], "lead_time": 2.0})
    short, long = (make_controller(one, RIG) for one in (name, whole))
    assert type(short) is type(long)
    for one, other in zip(short.controller_stages(True), long.controller_stages(True), strict=True):
        assert one.function is other.function
        np.testing.assert_array_equal(one.constants, other.constants)


@pytest.mark.parametrize("sensors", ["ideal", "honest"])
@pytest.mark.parametrize("name", [*CONTROLLED, "residual:circle", "admittance[force_sensor=false,learn=false]"])
def test_a_force_that_is_shown_moves_those_who_are_said_to_use_it_and_nobody_else(name, sensors):
    made = f"residual[policy={name.partition(':')[2]}]" if name.startswith("residual:") else name
    law, pushed = (make_controller(made, RIG) for _ in range(2))
    moved, lanes = False, 12
    # Either way: a tank that bounds what a law gives to the hand empties where the head moves against it, on few rigs so early.
    push = 25.0 * (-1.0) ** np.arange(lanes)
    for measured, wanted, _ in recorded(make_controller(made, RIG), sensors, RIG, lanes, 40)[0]:
        lie = replace(measured, user_force=measured.user_force + push)
        moved |= (law.command(measured, wanted) != pushed.command(lie, wanted)).any()
    assert moved == uses_force(name) == getattr(law, "reads_force", moved)


@pytest.mark.parametrize("sensors", ["ideal", "honest"])
@pytest.mark.parametrize("name", CONTROLLED)
def test_a_lane_without_numbers_gets_openings_that_valves_have_and_disturbs_no_other(name, sensors):
    law, blind = (make_controller(name, RIG) for _ in range(2))
    for tick, (measured, wanted, _) in enumerate(recorded(make_controller(name, RIG), sensors, RIG, 3, 8)[0]):
        unknown = measured.position * [1.0, 1.0, np.nan if tick in (3, 4) else 1.0]
        openings = blind.command(replace(measured, position=unknown), wanted)
        np.testing.assert_array_equal(openings[:, :2], law.command(measured, wanted)[:, :2])
        assert np.all(np.abs(openings) <= 1)
