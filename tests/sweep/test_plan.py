"""What a sweep's file says: grids, draws that do not depend on their number, searches, and what is refused."""

import math
import tracemalloc

import pytest

from agents.training.configuration import TrainingSettings, override
from studies.sweeps.plan import HeatMap, Range, load_sweep

WHOLE = """
[base]
environment = "BirthSIM/Probe-v2"
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
    assert (found.base["environment"], found.base["episodes"], found.base["seed"]) == ("BirthSIM/Probe-v2", 4, 7)
    assert len(found.points) == 2 * 3 * 5
    assert {(point["controller"], point["rig.mechanics.mass"]) for point in found.points} == {
        (name, mass) for name in ("backstepping", "pid") for mass in (2.0, 3.0, 4.0)
    }
    draws = {(point["rig.valves.time_constant"], point["sensors"]) for point in found.points}
    assert len(draws) == 5
    assert all(0.001 <= lag <= 0.01 and sensors in ("ideal", "lab") for lag, sensors in draws)
    assert found.maps == [HeatMap("rig.valves.time_constant", "rig.mechanics.mass", per="controller")]
    assert found.search is None


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


def test_a_file_without_tables_is_one_point(sweep):
    assert sweep("").points == [{}]


SPAN = "{from = 1, to = 2, count = 2, log = 'no'}"


@pytest.mark.parametrize(
    ("text", "name", "allowed"),
    [
        ("[gird]\nsensors = ['lab']", "'gird'", "[base], [grid], [draw], [search] and [[map]]"),
        ("[base]\ncolour = 'red'", "'colour'", "environment, controller, "),
        ("[grid]\nsensors = 'lab'", "[grid] sensors = 'lab'", "a list of values, or "),
        ("[grid]\n'gain.bandwidth' = {from = 3, to = 2, count = 2}", "", "from below to"),
        ("[grid]\n'gain.bandwidth' = {from = 1, to = 2}", "count = None", "a whole number from 2"),
        ("[grid]\n'gain.bandwidth' = {from = 1, to = 2, count = 2, step = 1}", "", "{ from, to, count, log }"),
        ("[grid]\n'gain.bandwidth' = {from = 1, to = 2, count = 4000000000}", "count", ""),
        ("[draw]\nsensors = ['lab']", "[draw] count = None", "a whole number from 1"),
        ("[draw]\ncount = 2000000\nsensors = ['lab']", "makes 2000000 points", "at most 1000000"),
        ("[base]\nepisodes = 0", "[base] episodes = 0", "a whole number from 1"),
        ("[search]\ntrials = 3", "[search] has no ranges", "names with"),
        ("[search]\n'gain.bandwidth' = [1, 2]", "[search] gain.bandwidth = [1, 2]", "{ from, to, log }"),
        ("[grid]\nsensors = ['lab']\n[[map]]\nx = 'sensors'", "[[map]]", "x, y and perhaps"),
        ("[[map]]\nx = 'sensors'\ny = 'policy'", "x = 'sensors'", "what varies"),
        ("[base]\npolicy = ''", "policy", "a word"),
        ("[grid]\ncontroller = [1, 'pid']", "controller = 1", "a word"),
        ("[draw]\ncount = 1\nenvironment = [2000-01-01]", "environment", "a word"),
        ("[base]\nsensors = 'perfect'", "sensors", "'lab'"),
        ("[grid]\nrandomize = ['no']", "randomize", "True"),
        ("[grid]\nsensors = {from = 1, to = 2, count = 2}", "sensors", "a list of values"),
        ("[search]\nreference = {from = 1, to = 2}", "reference", "from, to, log"),
        ("[grid]\n'gain.bandwidth' = [[1]]", "gain.bandwidth", "a number"),
        (f"[grid]\n'gain.bandwidth' = {SPAN}", "gain.bandwidth log", "true, false"),
        ("[search]\ntrials = 2000000\n'gain.bandwidth' = {from = 1, to = 2}", "trials", "1000000"),
        ("[search]\nmetric = 'best'\n'gain.bandwidth' = {from = 1, to = 2}", "metric", "settled_rms"),
        ("[[map]]\nx = ['a']\ny = {}", "x", "what varies"),
        ("[grid]\nsensors = ['lab']\n[[map]]\nx = 'sensors'\ny = 'sensors'\nstatistic = []", "statistic", "'median'"),
        ("[base]\n'training.seed' = 1", "training.seed", "train"),
        ("[base]\ntrain = 'circle'\n[grid]\n'training.stepz' = [1]", "training.stepz", "steps"),
        ("[base]\ntrain = 'circle'\n[grid]\ncontroller = ['pid']", "controller", "without it"),
        ("[base]\npolicy = 'circle'\n[grid]\ncontroller = ['pid']", "controller", "'residual'"),
        ("[base]\nsensors = 'lab'\n[draw]\ncount = 1\nsensors = ['ideal']", "sensors", "once"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_by_name_with_what_is_allowed(sweep, text, name, allowed):
    with pytest.raises(ValueError, match=r"sweep\.toml") as refusal:
        sweep(text)
    said = str(refusal.value)
    assert name in said
    assert allowed in said.partition("allowed")[2]
    assert "\n" not in said


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
