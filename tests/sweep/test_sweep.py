"""birthsim study sweep: grids, draws, searches and trainings, kept pieces, and the same bytes however many processes work."""

import json
from dataclasses import asdict

import numpy as np
import optuna
import pyarrow.parquet as pq
import pytest
from optuna.storages import JournalStorage
from optuna.storages.journal import JournalFileBackend

from baselines import evaluate, make_controller
from birthsim_env import Parameters
from lab.engine.results import read_result
from lab.studies.sweeps.plan import load_sweep
from lab.studies.sweeps.study import EXAMPLE
from tests.console import call

GRID = """
[base]
environment = "BirthSIM/Probe-v3"
randomize = "scenario"
episodes = 2
seed = 5

[grid]
controller = ["backstepping", "pid"]
"rig.mechanics.mass" = [3.0, 4.0]

[[map]]
x = "controller"
y = "rig.mechanics.mass"
"""


@pytest.fixture
def swept(tmp_path, monkeypatch, capsys):
    def done(text, *arguments, out="out"):
        (tmp_path / "sweep.toml").write_text(text)
        status, printed, complained = call(
            "sweep", monkeypatch, capsys, tmp_path / "sweep.toml", *arguments, "--out", tmp_path / out
        )
        return status, printed + complained, tmp_path / out

    return done


def found(folder):
    return json.loads((folder / "sweep.json").read_text())["figures"]


def same(one, other):
    """The same files, and all the same bytes but in what says when and how the result was made."""
    names = {path.name for path in one.iterdir() if path.is_file()}
    assert names == {path.name for path in other.iterdir() if path.is_file()}
    for name in names - {"sweep.json"}:
        assert (one / name).read_bytes() == (other / name).read_bytes(), name
    assert found(one) == found(other)


@pytest.mark.slow
def test_a_grid_gives_the_same_bytes_with_one_process_with_two_and_after_a_longer_one(swept):
    status, said, out = swept(GRID, "--jobs", 1)
    assert status == 0, said
    rows = pq.read_table(out / "episodes.parquet").to_pylist()
    assert [(row["controller"], row["rig.mechanics.mass"], row["episode_seed"]) for row in rows] == [
        (name, mass, seed) for name in ("backstepping", "pid") for mass in (3.0, 4.0) for seed in (5, 6)
    ]
    # A rig of 4 kg under a law that believes in 3 kg.
    rig = Parameters()
    heavy = rig.replace({"mechanics.mass": 4.0})
    plain = evaluate(
        "BirthSIM/Probe-v3", make_controller("pid", rig), "pid", 2, 5, progress=False, parameters=heavy, randomize="scenario"
    )
    np.testing.assert_array_equal([row["settled_rms"] for row in rows[6:]], plain.metrics["settled_rms"])
    assert rows[6]["return_0.9"] == plain.returns[0.9][0]
    assert [point["point"]["rig.mechanics.mass"] for point in found(out)["points"]] == [3.0, 4.0, 3.0, 4.0]
    assert "| backstepping | default | no | no | 3 | 0 of 2 |" in (out / "sweep.md").read_text()
    assert (out / "sweep_0.png").read_bytes()[:4] == b"\x89PNG"
    same(out, swept(GRID, "--jobs", 2, out="two")[2])
    longer = GRID.replace("[3.0, 4.0]", "[2.5, 3.0, 4.0]")
    _, said, _ = swept(longer, "--jobs", 1)
    assert "sweep: 4 of 6 are there with these settings, rig and code, and are kept" in said
    same(swept(GRID, "--jobs", 1)[2], swept(GRID, out="two")[2])


@pytest.mark.slow
def test_a_search_proposes_the_same_whatever_has_been_kept(swept):
    text = """
        [base]
        environment = "BirthSIM/Probe-v3"
        controller = "pid"
        episodes = 2
        randomize = "scenario"
        [search]
        trials = 4
        batch = 2
        "gain.bandwidth" = { from = 20, to = 80, log = true }
    """
    status, said, out = swept(text, "--jobs", 1)
    assert status == 0, said
    best = found(out)["best"]
    values = [point["metrics"]["settled_rms"]["q95"] for point in found(out)["points"]]
    assert best["settled_rms q95"] == min(values) == values[best["trial"]]
    # As after a kill: one piece of the second batch is missing.
    whole = {name: (out / name).read_bytes() for name in ("sweep.md", "episodes.parquet")}
    bandwidth = found(out)["points"][3]["point"]["gain.bandwidth"]
    (last,) = [path for path in (out / "pieces").rglob("*.json") if f"{bandwidth!r}" in path.read_text()]
    last.unlink()
    status, said, _ = swept(text, "--jobs", 2)
    assert status == 0, said
    assert "sweep: 1 of 2 are there" in said
    assert {name: (out / name).read_bytes() for name in whole} == whole
    storage = JournalStorage(JournalFileBackend(str(out / "trials.journal")))
    trials = optuna.load_study(study_name="birthsim-sweep", storage=storage).trials
    assert [trial.value for trial in trials] == values


@pytest.mark.slow
def test_a_point_may_train_the_policy_that_it_evaluates(swept):
    text = """
        [base]
        train = "circle_quick"
        episodes = 2
        "training.steps" = 2048
        "training.lanes" = 16
        "training.batch" = 256
        "training.validations" = 1
        "training.validation_lanes" = 2
        [grid]
        "training.seed" = [0, 1]
    """
    status, said, out = swept(text)
    assert status == 0, said
    assert len(list(out.rglob("policy.safetensors"))) == 2
    rows = pq.read_table(out / "episodes.parquet").to_pylist()
    assert [row["training.seed"] for row in rows] == [0, 0, 1, 1]
    assert "sweep: 2 of 2 are there" in swept(text)[1]


def test_the_stored_result_is_of_the_example_as_it_is():
    kept, sweep = read_result("sweep")["figures"], load_sweep(EXAMPLE)
    assert kept["base"] == sweep.base
    assert [point["point"] for point in kept["points"]] == sweep.points
    assert kept["maps"] == [asdict(chart) for chart in sweep.maps]


def test_points_that_cannot_be_are_named_and_cost_no_other(swept):
    text = GRID.replace('["backstepping", "pid"]', '["nobody"]').replace("episodes = 2", "episodes = 1")
    status, said, _ = swept(text, "--jobs", 1)
    assert status == 2
    assert "error: 2 of 2 pieces failed, the first point 0: ValueError: controller = 'nobody'; allowed: " in said
