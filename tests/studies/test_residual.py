"""``birthsim study beside-law`` and ``own-motion``: policies beside their controllers, in the same worlds."""

import json
import shutil

import numpy as np
import pytest

from agents.policy.shipped import SHIPPED
from lab.studies.residual import beside_law, own_motion
from tests.console import call

LAW = "backstepping-force-first"
BESIDE = ("all seeds", "backstepping", "all seeds, less than backstepping")


@pytest.fixture
def told(monkeypatch, capsys, tmp_path):
    def figures(*arguments):
        common = ("--seed", "86000", "--jobs", 1, "--out", tmp_path / "out")
        status, _, complained = call("beside-law", monkeypatch, capsys, *arguments, *common)
        assert status == 0, complained
        return json.loads((tmp_path / "out" / "beside-law.json").read_text())["figures"]

    return figures


@pytest.fixture
def seeds(tmp_path):
    """A folder of the first seeds of a training; what a hand feels takes seconds a seed."""

    def copied(name, count):
        for k in range(count):
            shutil.copytree(SHIPPED / name / f"seed_{k}", tmp_path / "seeds" / name / f"seed_{k}")
        return tmp_path / "seeds" / name

    return copied


@pytest.mark.usefixtures("brief")
def test_one_seed_stands_beside_its_controller_and_the_mean_of_one_is_itself(told, seeds, monkeypatch):
    monkeypatch.setattr(beside_law, "_privileged", lambda folder: True)
    monkeypatch.setattr(beside_law, "acting", lambda policy, env, privileged: policy)
    ideal = ("--sensors", "ideal", "--episodes", 3, "--beside", "backstepping", "--parameters", "")
    law, own, every, *others = told("--policy", seeds("circle", 1), *ideal)["errors"]
    assert [row["who"] for row in (law, own, every, *others)] == [LAW, "circle seed_0", *BESIDE]
    assert own["error"][0] < law["error"][0], "a law of millimetres, a policy of half of one"
    assert own["less"] == every["less"]
    assert own["less"]["median"][0] > 0.0
    assert law["static"] is None, "what is told the rig in its own environment runs nowhere else"


@pytest.mark.slow
@pytest.mark.weekly
def test_a_trained_policy_is_better_than_its_law_on_ideal_sensors(told, seeds):
    ideal = ("--sensors", "ideal", "--episodes", 16, "--rigs", 1, "--beside", "backstepping", "--parameters", "")
    found = told("--policy", seeds("circle", 2), *ideal)
    medians = {row["who"]: row["error"][0] for row in found["errors"] if row["error"]}
    assert len(medians) >= 3
    assert max(error for who, error in medians.items() if who.startswith("circle")) < medians[LAW]
    static = {row["who"]: row["static"][0] for row in found["errors"] if row["static"]}
    assert max(off for who, off in static.items() if who.startswith("circle")) < static[LAW]
    law, *seeds, every = found["felt"]
    assert max(row["error"] for row in seeds) < law["error"], "own error under a multisine hand"
    for row in seeds:
        assert row["better"]["bandwidth"][0] == pytest.approx(row["bandwidth"] - law["bandwidth"])
        assert row["better"]["error"][0] == pytest.approx(law["error"] - row["error"]), "one rig: its mean is the median"
    assert every["better"]["error"][0] > 0.0


@pytest.fixture
def felt(monkeypatch):
    """What a hand feels is given: at 2 N too, which does not count, and at 10 N in two poses; of a policy it is 3 more."""

    def rendering(condition, setpoint):
        more = 0.0 if condition.controller == LAW else 3.0
        found = {"bandwidth": [3.0 + more, 99.0, 5.0 + more], "error_own_mm": [1.0, 99.0, 2.0 + more], "lost": [False] * 3}
        return {**found, "peak": [10.0, 2.0, 10.0], "frequency": [0.5, 1.0], "differences": [[9.0] * 3, [0.2, 9.0, 0.4]]}

    monkeypatch.setattr(beside_law, "rendering", rendering)


@pytest.mark.slow
@pytest.mark.usefixtures("brief", "felt")
def test_other_laws_and_policies_run_in_the_same_worlds(told, seeds):
    student = seeds("circle_honest_student", 1)
    found = told("--policy", student, "--beside", "backstepping", student, "--episodes", 3, "--rigs", 1)
    assert [row["who"] for row in found["errors"]] == [LAW, f"{student.name} seed_0", *BESIDE]
    law, policy, _ = found["felt"]
    assert (law["who"], law["bandwidth"], law["jnd"], law["error"]) == (LAW, 4.0, pytest.approx(0.3), 1.5)
    assert [policy["better"][name][0] for name in ("bandwidth", "jnd", "error")] == [3.0, 0.0, -1.5]


@pytest.mark.usefixtures("brief", "felt")
def test_without_a_force_sensor_no_law_that_reads_one_runs_beside(monkeypatch, capsys, tmp_path, seeds):
    common = ("--policy", seeds("circle_honest_student", 1), "--episodes", 1, "--jobs", 1, "--out", tmp_path / "out")
    status, _, complained = call("beside-law", monkeypatch, capsys, "--beside", "admittance-adaptive", *common)
    assert status == 2
    assert "force_sensor = False with law = 'admittance-adaptive'" in complained


@pytest.mark.slow
@pytest.mark.weekly
def test_a_policy_stands_beside_its_controller_under_a_moving_hand(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(own_motion, "HANDS", ("noise",))
    shutil.copytree(SHIPPED / "circle_honest_apg" / "seed_1", tmp_path / "own" / "seed_1")
    common = ("--policy", tmp_path / "own", "--episodes", 64, "--seed", 77000000, "--jobs", 1, "--out", tmp_path / "out")
    status, _, complained = call("own-motion", monkeypatch, capsys, *common)
    assert status == 0, complained
    figures = json.loads((tmp_path / "out" / "own-motion.json").read_text())["figures"]
    law, policy, quiet, bound = figures["moving"]
    assert law["less"] is None
    less, low, high = policy["less"]
    assert 0.0 < low < less < high < law["error"][0]
    assert bound["error"][0] < quiet["error"][0] < law["error"][0], "without noise and delays; what no controller has less of"
    (_, stiffness), (_, other) = figures["static"].items()
    assert np.all(np.diff(stiffness) >= 0)
    assert other[0] < 3.0, "the median"
