"""Stability maps: what counts as stable, known corners of the maps, figures and the command."""

import re

import numpy as np
import pytest

from baselines.bench.pieces import controller_settings
from baselines.named import make_controller
from birthsim_env.physics.rig.parameters import Parameters
from lab.studies.stability import maps as stability
from lab.studies.stability.figure import stability_figure
from lab.studies.stability.maps import MAPS, Axis, Cases, Map, Window, describe_map, judge, stability_tasks, stable_up_to
from tests.console import OWN, call, strict

RIG = Parameters()


def test_a_small_motion_under_a_stiff_hand_is_an_oscillation(monkeypatch):
    """0.2 mm peak to peak are 0.2 N of a hand of 1000 N/m and 6 N of one of 30,000 N/m; 0.6 mm are too much for any."""
    spans = iter(np.array([[2e-4, 2e-4, 2e-4, 6e-4, np.nan], [1e-4, 1e-4, 1e-4, 1e-4, 1e-4]]) for _ in range(2))
    monkeypatch.setattr(stability, "END", 0.01)
    monkeypatch.setattr(Window, "span", lambda self: next(spans))
    cases = Cases([RIG] * 5, np.array([0.0, 1000.0, 30000.0, 0.0, 0.0]), np.full(5, 2000.0))
    verdict = judge(cases, make_controller("shut-valves", RIG))
    assert verdict.stable.tolist() == [True, True, False, False, False]
    assert verdict.lost.tolist() == [False, False, False, False, True]


def test_a_rig_that_runs_into_its_stop_is_lost(tmp_path, monkeypatch):
    """Valves that drive both pistons out: lost, null in JSON, and said in the picture."""
    monkeypatch.setattr(stability, "JUDGED", 0.9)
    monkeypatch.setattr(stability, "END", 1.2)
    own = tmp_path / "own.py"
    own.write_text(OWN)
    verdict = judge(Cases([RIG, RIG], np.array([0.0, 30000.0]), np.full(2, 2000.0)), make_controller(f"{own}:Out", RIG))
    assert verdict.lost.tolist() == [True, False]
    assert not verdict.stable[0]
    hand, asked = Axis("hand (N/m)", 100.0, 30000.0, 2, True), Axis("asked for (N/m)", 1000.0, 4000.0, 2)
    monkeypatch.setitem(MAPS, "hand", Map("pushed out", hand, asked, MAPS["hand"].cases, lambda rig: (None, None)))
    (((key, label), task),) = stability_tasks(["hand"], controller_settings(f"{own}:Out", RIG), "ideal", None, 0).items()
    assert label == f"{own}:Out"
    chart = {**describe_map(key, RIG), "variants": {label: task.work(**task.settings)}}
    assert np.isnan(chart["variants"][f"{own}:Out"]["motion_mm"][0][0])
    stability_figure("own", chart, "with a file of one's own", tmp_path)
    assert "lost: ran into a stop" in "".join(re.findall("<!-- (.*?) -->", (tmp_path / "stability_own.svg").read_text()))


def test_how_far_all_is_stable():
    rows = [[True, True, True], [True, False, True], [False, True, True]]
    chart = {"x": {"values": [1.0, 2.0, 3.0]}, "variants": {"a": {"stable": rows}}}
    assert stable_up_to(chart, "a") == [3.0, 1.0, None]


@pytest.mark.slow
def test_the_command(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(stability, "JUDGED", 0.9)
    monkeypatch.setattr(stability, "END", 1.2)
    out = tmp_path / "deeper" / "maps"
    options = ("--map", "hand", "rig", "--points", 2, "--sensors", "lab", "--jobs", 1, "--out", out)
    status, printed, _ = call("stability", monkeypatch, capsys, *options)
    assert status == 0
    content = strict(out / "stability.json")
    assert list(content["figures"]) == ["hand", "rig"]
    assert content["settings"]["sensors"] == "lab"
    for name, chart in content["figures"].items():
        assert (out / f"stability_{name}.png").stat().st_size > 20_000
        assert "<svg" in (out / f"stability_{name}.svg").read_text()[:1000]
        assert list(chart["variants"]) == ["as it is", "gains that never yield", "half the friction fed forward"]
        assert np.shape(chart["variants"]["as it is"]["stable"]) == (2, 2)
    hand = content["figures"]["hand"]
    limit = stable_up_to(hand, "as it is")[1]
    assert re.search(rf"\n\| 4000 +\| +{'nowhere' if limit is None else round(limit)}", printed)
    assert f"written to {out}/: stability.json, stability.md, stability_hand.png, stability_rig.png" in printed
