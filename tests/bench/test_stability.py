"""Stability maps: what counts as stable, known corners of the maps, figures and the command."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib import pyplot as plt

from baselines.bench.pieces import controller_settings
from baselines.registry import make_controller
from birthsim_env.physics.rig.parameters import Parameters
from studies.stability import maps as stability
from studies.stability.figure import _border, _edges, _places, stability_figure
from studies.stability.maps import (
    MAPS,
    MOST_FORCE,
    MOST_MOTION,
    Axis,
    Cases,
    Map,
    Window,
    describe_map,
    judge,
    stability_tasks,
    stable_up_to,
)
from tests.console import OWN, call, strict

RIG = Parameters()


def corners(name: str, rig: Parameters = RIG, points: int = 2) -> dict[str, Any]:
    settings = controller_settings("admittance-backstepping", rig)
    tasks = stability_tasks([name], settings, "ideal", points, 0)
    return {
        **describe_map(name, rig, points),
        "variants": {label: task.work(**task.settings) for (_, label), task in tasks.items()},
    }


@pytest.mark.slow
def test_the_corners_of_the_rigs_map() -> None:
    """Fixed gains oscillate on a light rig with slow valves; those that yield come to rest, there but for half a millimetre."""
    chart = corners("rig")
    assert (chart["x"]["values"], chart["y"]["values"], chart["believed"]) == ([1.0, 12.0], [1.5, 6.0], [4.0, 3.0])
    found = {label: variant["stable"] for label, variant in chart["variants"].items()}
    motion = {label: variant["motion_mm"] for label, variant in chart["variants"].items()}
    assert found["as it is"][0][0]
    assert found["as it is"][1] == [True, True]
    assert motion["as it is"][0][1] < 1
    assert found["gains that never yield"] == [[True, False], [True, True]]
    assert motion["gains that never yield"][0][1] > 10
    assert stable_up_to(chart, "gains that never yield") == [1.0, 12.0]


@pytest.mark.slow
def test_what_is_stable_with_a_hand() -> None:
    """Less than 0.5 mm and 5 N; friction that is fed forward but not there drives a stiff hand, half of it less so."""
    chart = corners("hand_friction", points=3)
    hand, found = np.array(chart["x"]["values"]), chart["variants"]
    for variant in found.values():
        motion, stable = 1e-3 * np.array(variant["motion_mm"]), np.array(variant["stable"])
        assert np.array_equal(stable, (motion < MOST_MOTION) & (hand * motion < MOST_FORCE))
    assert not found["as it is"]["stable"][0][2]
    assert np.all(np.array(found["as it is"]["stable"])[:, 0])
    assert np.all(np.array(found["as it is"]["stable"])[1:])
    assert found["half the friction fed forward"]["motion_mm"][0][2] < found["as it is"]["motion_mm"][0][2]


def test_a_small_motion_under_a_stiff_hand_is_an_oscillation(monkeypatch: pytest.MonkeyPatch) -> None:
    """0.2 mm peak to peak are 0.2 N of a hand of 1000 N/m and 6 N of one of 30,000 N/m; 0.6 mm are too much for any."""
    spans = iter(np.array([[2e-4, 2e-4, 2e-4, 6e-4, np.nan], [1e-4, 1e-4, 1e-4, 1e-4, 1e-4]]) for _ in range(2))
    monkeypatch.setattr(stability, "END", 0.01)
    monkeypatch.setattr(Window, "span", lambda self: next(spans))
    cases = Cases([RIG] * 5, np.array([0.0, 1000.0, 30000.0, 0.0, 0.0]), np.full(5, 2000.0))
    verdict = judge(cases, make_controller("shut-valves", RIG))
    assert verdict.stable.tolist() == [True, True, False, False, False]
    assert verdict.lost.tolist() == [False, False, False, False, True]


def test_a_rig_that_runs_into_its_stop_is_lost(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Valves that drive both pistons out: lost, null in JSON, and said in the picture."""
    monkeypatch.setattr(stability, "JUDGED", 0.9)
    monkeypatch.setattr(stability, "END", 1.2)
    own = tmp_path / "own.py"
    own.write_text(OWN)
    verdict = judge(Cases([RIG, RIG], np.array([0.0, 30000.0]), np.full(2, 2000.0)), make_controller(f"{own}:Out", RIG))
    assert verdict.lost.tolist() == [True, False]
    assert not verdict.stable[0]
    monkeypatch.setitem(MAPS, "hand", Map("pushed out", *small_axes(), MAPS["hand"].cases, lambda rig: (None, None)))
    (((key, label), task),) = stability_tasks(["hand"], controller_settings(f"{own}:Out", RIG), "ideal", None, 0).items()
    assert label == f"{own}:Out"
    chart = {**describe_map(key, RIG), "variants": {label: task.work(**task.settings)}}
    assert np.isnan(chart["variants"][f"{own}:Out"]["motion_mm"][0][0])
    stability_figure("own", chart, "with a file of one's own", tmp_path)
    assert "lost: ran into a stop" in "".join(re.findall("<!-- (.*?) -->", (tmp_path / "stability_own.svg").read_text()))


def small_axes() -> tuple[Axis, Axis]:
    return Axis("stiffness of the hand (N/m)", 100.0, 30000.0, 2, True), Axis("asked for (N/m)", 1000.0, 4000.0, 2)


def test_axes_and_edges_of_cells() -> None:
    """Even or by equal factors; edges halfway, also beyond the ends."""
    np.testing.assert_allclose(Axis("", 1.0, 7.0, 4).values(), [1, 3, 5, 7])
    np.testing.assert_allclose(Axis("", 1.0, 1000.0, 9, True).values(4), [1, 10, 100, 1000])
    np.testing.assert_allclose(_edges(np.array([1.0, 3, 5]), False), [0, 2, 4, 6])
    np.testing.assert_allclose(_edges(np.array([1.0, 100, 10000]), True), [0.1, 10, 1000, 100000])
    np.testing.assert_allclose(_edges(np.array([2.0]), False), [1.5, 2.5])


def test_a_logarithmic_side_begins_at_none() -> None:
    """A logarithm has no zero: the first cell stands a factor before the second, and its tick says 0."""
    values = [0.0, 100.0, 1000.0]
    np.testing.assert_allclose(_places({"values": values, "logarithmic": True}), [10, 100, 1000])
    np.testing.assert_allclose(_places({"values": values, "logarithmic": False}), values)


def test_the_border_runs_between_stable_cells_and_others() -> None:
    figure, axes = plt.subplots()
    _border(axes, np.arange(4.0), np.arange(3.0), np.array([[True, True, False], [True, False, False]]))
    upright, level = ({tuple(map(tuple, path.vertices)) for path in lines.get_paths()} for lines in axes.collections)
    assert upright == {((2.0, 0.0), (2.0, 1.0)), ((1.0, 1.0), (1.0, 2.0))}
    assert level == {((1.0, 1.0), (2.0, 1.0))}
    plt.close(figure)


def test_how_far_all_is_stable() -> None:
    """Up to the first cell that is not, whatever comes behind it."""
    rows = [[True, True, True], [True, False, True], [False, True, True]]
    chart = {"x": {"values": [1.0, 2.0, 3.0]}, "variants": {"a": {"stable": rows}}}
    assert stable_up_to(chart, "a") == [3.0, 1.0, None]


@pytest.mark.slow
def test_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Files, strict JSON, and a table with the numbers of the maps."""
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
