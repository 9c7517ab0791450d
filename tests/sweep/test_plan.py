"""What a sweep's file says: grids, draws that do not depend on their number, searches, and what is refused."""

import math
import tracemalloc

import pytest

from agents.training.configuration import TrainingSettings, override
from lab.studies.sweeps.plan import HeatMap, Range, load_sweep

WHOLE = """
[base]
environment = "BirthSIM/Probe-v3"
episodes = 4
seed = 7

[grid]
controller = ["backstepping", "pid"]
"rig.mechanics.mass" = { from = 2, to = 4, count = 3 }

[draw]
count = 5
seed = 3
"rig.valves.time_constant" = { from = 0.001, to = 0.01, log = true }
sensors = ["ideal", "lab"]

[[map]]
x = "rig.valves.time_constant"
y = "rig.mechanics.mass"
per = "controller"
"""


@pytest.fixture
def sweep(tmp_path):
    def written(text):
        (tmp_path / "sweep.toml").write_text(text)
        return load_sweep(tmp_path / "sweep.toml")

    return written


def test_every_combination_of_the_grid_meets_every_draw(sweep):
    found = sweep(WHOLE)
    assert (found.base["environment"], found.base["episodes"], found.base["seed"]) == ("BirthSIM/Probe-v3", 4, 7)
    assert len(found.points) == 2 * 3 * 5
    assert {(point["controller"], point["rig.mechanics.mass"]) for point in found.points} == {
        (name, mass) for name in ("backstepping", "pid") for mass in (2.0, 3.0, 4.0)
    }
    draws = {(point["rig.valves.time_constant"], point["sensors"]) for point in found.points}
    assert len(draws) == 5
    assert all(0.001 <= lag <= 0.01 and sensors in ("ideal", "lab") for lag, sensors in draws)
    assert found.maps == [HeatMap("rig.valves.time_constant", "rig.mechanics.mass", per="controller")]
    assert found.search is None
    assert sweep("").points == [{}]


def test_a_draw_does_not_depend_on_how_many_there_are(sweep):
    few, many = sweep(WHOLE).points, sweep(WHOLE.replace("count = 5", "count = 8")).points
    assert few[:5] == many[:5]
    other = sweep(WHOLE.replace("seed = 3", "seed = 4")).points
    assert not {point["rig.valves.time_constant"] for point in few} & {point["rig.valves.time_constant"] for point in other}


def test_ranges_are_even_or_by_equal_factors():
    assert Range(1.0, 3.0, 3).values() == [1.0, 2.0, 3.0]
    assert Range(1.0, 100.0, 3, True).values() == pytest.approx([1.0, 10.0, 100.0])
    assert Range(1.0, 100.0, log=True).at(0.5) == pytest.approx(10.0)
    assert Range(1.0, 3.0).at(0.5) == 2.0
    # Uniform in the logarithm: as many draws below the geometric mean as above it.
    places = [math.log(Range(1.0, 100.0, log=True).at(k / 1000)) for k in range(1000)]
    assert sum(place < math.log(10.0) for place in places) == 500


def test_layers_of_a_trained_network_may_be_set(sweep):
    base = sweep("[base]\ntrain = 'circle_quick'\n'training.hidden' = [8, 16]").base
    assert override(TrainingSettings(), hidden=base["training.hidden"]).hidden == (8, 16)


def test_a_grid_is_refused_before_it_takes_memory(sweep):
    axes = "\n".join(f"'gain.g{k}' = {{from = 1, to = 2, count = 1000000}}" for k in range(20))
    tracemalloc.start()
    with pytest.raises(ValueError, match=r"grid.*allowed"):
        sweep(f"[grid]\n{axes}")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 10e6  # bytes; the values of one axis alone take 32 MB
