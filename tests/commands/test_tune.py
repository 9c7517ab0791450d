"""birthsim tune: its search on costs that are known, its files, its costs on the plant, plain errors."""

from pathlib import Path

import numpy as np
import pytest

from baselines.named import make_controller
from birthsim.commands import tune
from birthsim_env import Parameters
from birthsim_env.parts.drawn.randomization import documented_ranges
from tests.console import OWN, call, strict

BOUNDS = {"stiff": (1.0, 10000.0), "fraction": (0.0, 2.0)}
TUNED = f"""
class Own(Held):
    TUNABLE = {BOUNDS}

    def __init__(self, parameters, stiff=2.0, fraction=2.0):
        self.gains = stiff, fraction
"""
BEST = (400.0, 0.6)


@pytest.fixture
def own(tmp_path):
    path = tmp_path / "own.py"
    path.write_text(OWN + TUNED)
    return f"{path}:Own"


@pytest.fixture
def trial_costs(monkeypatch):
    """Replaces the simulation by a bowl with its bottom at ``BEST``; what was tried; interrupts after ``limit`` trials."""
    tried, limit = [], [10**6]

    def bowl(controller, rig, sensors, lanes):
        if len(tried) == limit[0]:
            limit[0] = 10**6
            raise KeyboardInterrupt
        stiff, fraction = controller.gains
        tried.append((stiff, fraction))
        return {"stiff": abs(np.log(stiff / BEST[0])), "fraction": 3 * abs(fraction - BEST[1]), "floor": 0.1 * len(sensors)}

    monkeypatch.setattr(tune, "costs", bowl)
    return tried, limit


def test_the_search_gets_from_a_bad_start_to_the_bottom(own, tmp_path, trial_costs, monkeypatch, capsys):
    start = tmp_path / "bad.json"
    start.write_text('{"gains": {"stiff": 1.5, "fraction": 1.9, "other": 3}}')
    out = tmp_path / "out"
    status, printed, _ = call("tune", monkeypatch, capsys, "--controller", own, "--trials", 60, "--start", start, "--out", out)
    assert status == 0
    assert trial_costs[0][0] == (1.5, 1.9)
    trials, best = strict(out / "trials.json")["trials"], strict(out / "gains.json")
    assert len(trials) == 60 == len(trial_costs[0])
    assert best["cost"] == min(trial["cost"] for trial in trials) == sum(best["parts"].values())
    assert trials[0]["cost"] > 9
    assert best["cost"] < 0.2 + 0.5, "both sensors have a floor of 0.1 each"
    assert best["gains"] == trials[best["trial"]]["gains"]
    assert best["gains"]["stiff"] == pytest.approx(BEST[0], rel=0.4)
    assert best["gains"]["fraction"] == pytest.approx(BEST[1], abs=0.1)
    table = {line.split()[0]: line.split()[1:] for line in printed.splitlines() if line.split()}
    for name, value in best["gains"].items():
        assert [float(word) for word in table[name]] == pytest.approx(
            [trials[0]["gains"][name], value, *BOUNDS[name]], rel=1e-3
        )
    random, proposed = trials[1 : tune.RANDOM], trials[tune.RANDOM :]
    assert np.mean([trial["cost"] for trial in proposed[20:]]) < 0.5 * np.mean([trial["cost"] for trial in random])
    assert np.ptp([np.log10(trial["gains"]["stiff"]) for trial in random]) > 2.5, "the random ones cover the range, by decades"


@pytest.mark.slow
def test_an_interrupted_search_carries_on_where_it_was(own, tmp_path, trial_costs, monkeypatch, capsys):
    tried, limit = trial_costs
    options = ("--controller", own, "--trials", 40, "--seed", 5)
    assert call("tune", monkeypatch, capsys, *options, "--out", tmp_path / "whole")[0] == 0
    whole = list(tried)
    tried.clear()
    limit[0] = 27
    status, printed, _ = call("tune", monkeypatch, capsys, *options, "--out", tmp_path / "parts")
    assert status == 130
    assert "interrupted: 27 of 40 trials are kept; the same command carries on" in printed
    assert strict(tmp_path / "parts" / "gains.json")["trials"] == 27
    assert call("tune", monkeypatch, capsys, *options, "--out", tmp_path / "parts")[0] == 0
    assert tried == whole
    for name in ("trials.json", "gains.json"):
        assert strict(tmp_path / "parts" / name) == strict(tmp_path / "whole" / name)
    more = ("--controller", own, "--trials", 50, "--seed", 5, "--out", tmp_path / "parts")
    assert call("tune", monkeypatch, capsys, *more)[0] == 0
    assert len(tried) == 50
    assert tried[:40] == whole


def test_the_seed_is_all_that_a_search_depends_on(own, tmp_path, trial_costs, monkeypatch, capsys):
    found = []
    for folder, seed in (("a", 0), ("b", 0), ("c", 1)):
        trial_costs[0].clear()
        call("tune", monkeypatch, capsys, "--controller", own, "--trials", 12, "--seed", seed, "--out", tmp_path / folder)
        found.append(list(trial_costs[0]))
    assert found[0] == found[1]
    assert found[0][0] == found[2][0] == (100.0, 1.0), "the middle of the ranges"
    assert found[0][1:] != found[2][1:]


def test_the_robust_statistic():
    losses = np.array([1.0, 2.0, 3.0, np.nan, np.inf, 500.0])
    capped = [1, 2, 3, tune.WORST, tune.WORST, tune.WORST]
    assert tune.robust(losses) == pytest.approx(np.mean(capped) + np.quantile(capped, 0.95))


def test_probes_are_pushed_rigs_of_the_documented_ranges():
    probes = tune.probes(Parameters(), 40)
    for name, (low, high) in documented_ranges(Parameters()).items():
        section, field = name.split(".")
        values = [getattr(getattr(rig, section), field) for rig in probes.rigs]
        assert low <= min(values) < low + 0.2 * (high - low)
        assert high - 0.2 * (high - low) < max(values) <= high
    size = np.abs(probes.force).max(axis=0)
    assert np.all((size >= 5) & (size <= 40))
    assert np.all((probes.force == 0).sum(axis=0) == 1)
    assert len(np.unique(np.sign(probes.force), axis=1).T) == 4
    assert np.all((probes.stiffness[:2] >= 1000) & (probes.stiffness[:2] <= 4000))
    assert len(np.unique(probes.position, axis=1).T) == 5
    again = tune.probes(Parameters(), 20)
    assert np.array_equal(again.position, probes.position[:, :20])
    assert again.rigs == probes.rigs[:20]


RAIL = Parameters().replace({"linkage.kind": "rail", "linkage.inclination": 0.5})


def test_probes_of_one_cylinder_push_along_its_rail():
    probes = tune.probes(RAIL, 40)
    along = np.array([np.cos(0.5), np.sin(0.5)])
    places = along @ probes.position - RAIL.geometry.k2
    np.testing.assert_allclose(probes.position, np.outer(along, along @ probes.position), atol=1e-12)
    np.testing.assert_allclose(probes.force, np.outer(along, along @ probes.force), atol=1e-12)
    assert np.abs(places).max() < 0.5 * RAIL.cylinder2.stroke - 40 / 1000
    assert len(np.unique(np.round(places, 9))) == 5
    assert {-1.0, 1.0} == set(np.sign(along @ probes.force))
    np.testing.assert_array_equal(probes.stiffness[0], probes.stiffness[1])


def test_costs_on_a_rail_tell_good_gains_from_bad_ones():
    good, slack = (
        tune.costs(make_controller("pid", RAIL, **gains), RAIL, ("encoders",), 3, 1.0)
        for gains in ({}, {"bandwidth": 12.0, "integral_rate": 0.3})
    )
    assert set(good) == {"rail, encoders", "stiffness test, encoders"}
    assert all(slack[part] > 1.2 * good[part] for part in good)


def test_frictions_are_drawn_which_the_controller_does_not_know(own, tmp_path, monkeypatch, capsys):
    asked = []

    def watched(controller, rig, sensors, lanes):
        asked.append((controller, rig, sensors))
        return {"cost": 1.0}

    monkeypatch.setattr(tune, "costs", watched)
    run = ("--controller", own, "--trials", 1, "--out", tmp_path / "out", "--sensors", "honest", "--friction")
    status, printed, _ = call("tune", monkeypatch, capsys, *run, "drawn")
    assert status == 0
    assert "law of friction lugre or elasto_plastic or coulomb or gms" in printed
    ((_, rig, sensors),) = asked
    assert sensors == ("honest",)
    assert rig.friction == Parameters().friction, "what the controller is told"
    assert {one.friction.law for one in tune.probes(rig, 40).rigs} == {"lugre", "elasto_plastic", "coulomb", "gms"}
    assert {one.friction.law for one in tune.probes(Parameters(), 40).rigs} == {"lugre"}
    status, _, said = call("tune", monkeypatch, capsys, *run, "drwan")
    assert status != 0
    assert "did you mean 'drawn'?" in said


@pytest.mark.slow
def test_costs_on_the_plant_tell_good_gains_from_bad_ones(own):
    """The same gains cost the same; a slack PID costs more, valves that stay shut much more."""
    rig = Parameters()
    good = tune.costs(make_controller("pid", rig), rig, ("ideal", "lab"), 3, 1.0)
    assert set(good) == {f"{what}, {kind}" for what in ("circle", "stiffness test") for kind in ("ideal", "lab")}
    again = tune.costs(make_controller("pid", rig), rig, ("ideal",), 3, 1.0)
    assert again == {part: good[part] for part in ("circle, ideal", "stiffness test, ideal")}
    slack = tune.costs(make_controller("pid", rig, bandwidth=12.0, integral_rate=0.3), rig, ("ideal",), 3, 1.0)
    assert all(slack[part] > 1.2 * good[part] for part in slack)
    shut = tune.costs(make_controller(own, rig), rig, ("ideal",), 3, 1.0)
    assert shut["circle, ideal"] > 10 * good["circle, ideal"]
    assert shut["stiffness test, ideal"] > 10 * good["stiffness test, ideal"]


def test_trials_of_another_search_are_not_mixed_in(own, tmp_path, trial_costs, monkeypatch, capsys):
    tried, _ = trial_costs
    run = lambda *options: call("tune", monkeypatch, capsys, "--controller", own, "--out", tmp_path / "out", *options)[0]  # noqa: E731
    assert run("--trials", 3) == 0
    first = list(tried)
    assert run("--trials", 3, "--sensors", "lab") == 0
    assert tried[3:] == first, "the same gains, tried anew"
    assert run("--trials", 4, "--seed", 9) == 0
    assert len(tried) == 6 + 3, "the start is the same for every seed"
    assert run("--trials", 3) == 0
    assert len(tried) == 9
    Path(own.removesuffix(":Own")).write_text(OWN + TUNED + "\n")
    assert run("--trials", 3) == 0
    assert tried[9:] == first, "a controller's file that changed is another controller"
