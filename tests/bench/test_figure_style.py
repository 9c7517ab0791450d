"""What every figure has in common: the style, both formats, the same bytes again, and lines that a grey print tells apart."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib import pyplot as plt
from PIL import Image

from agents.reports.correction_figure import draw_corrections
from agents.reports.learning_curves import draw_learning_curves
from baselines.bench.evaluation import Evaluation
from baselines.figures import style
from baselines.figures.runs import episode_figure, error_over_time, figure4
from baselines.figures.style import headline, legend_below, save
from studies.comparison.figure import CONDITIONS, draw_comparison
from studies.comparison.stiffness_figures import draw_studies
from studies.results import read_result
from studies.shelf import declared, names
from studies.stability.figure import stability_figure
from studies.study import no_pictures
from tests.figures import caught, contrast

ROOT = Path(__file__).resolve().parent.parent.parent


def cell(controller, sensors, plant):
    said = {"median": 1.0, "low": 0.5, "high": 2.0}
    place = {"environment": "BirthSIM/Circle-v1", "sensors": sensors, "plant": plant}
    return {"controller": controller, **place, "metrics": {"settled_rms": said, "air": said}}


TEN = [f"a rather long controller name {k}" for k in range(10)]


def study(folder):
    """Every figure of the studies."""
    stiffness = {"setpoints": [1000, 4000], "error_percent": [[1, 2], [3, None]], "hunting_mm": [[1, 2], [3, None]]}
    push = {"amplitudes": [2, 40], "error_percent": [[1, 2], [3, 4]]}
    polar = {"angles": [0, 1.5, 3, 4.5], "stiffness": [[2000, 2100]] * 4, "setpoint": 2000}
    ellipses = {"poses": [(0.5, 0)], "setpoint": [[3000, 800], [800, 1500]], "stiffness": [[[3000, 0], [0, 1500]]]}
    pushed = {f"law, {friction}": push for friction in ("frictionless", "with friction")}
    return draw_studies(
        {
            "stiffness": dict.fromkeys(TEN, stiffness),
            "disturbance": pushed,
            "polar": dict.fromkeys(TEN, polar),
            "ellipses": dict.fromkeys(TEN, ellipses),
        },
        folder,
    )


def learning(folder):
    """Two validations of each: every one costs a bootstrap."""
    paths = sorted((ROOT / "agents/policies/circle").glob("seed_*/training.json"))
    trainings = [json.loads(path.read_text()) for path in paths]
    return draw_learning_curves([{**training, "curve": training["curve"][:2]} for training in trainings], folder)


def stability(folder):
    axis = {"values": [1.0, 2.0], "label": "mass (kg)", "logarithmic": True}
    variants = {"as it is": {"motion_mm": [[0.01, None], [1.0, 50.0]], "stable": [[True, False], [True, False]]}}
    return stability_figure(
        "rig", {"title": "Rigs", "x": axis, "y": axis, "variants": variants, "believed": (1.5, 1.5)}, "law, lab sensors", folder
    )


def record():
    """A run of Fig. 4, and rows of an episode."""
    time = np.linspace(0, 16, 65)
    way = np.stack([np.cos(time), np.sin(time)], axis=1)
    pairs = {"user_force": 30.0, "target": 0.05, "compliant_target": 0.05, "position": 0.051, "tracking_error": 1e-3}
    stiffness = {"stiffness_setpoint": 2000.0, "pneumatic_stiffness": 4000.0, "pneumatic_stiffness_setpoint": 4000.0}
    whole = {name: np.where(time < 8, value, 2 * value)[:, None] + np.zeros(2) for name, value in stiffness.items()}
    return {"time": time, "since_jump": time % 1, **{name: value * way for name, value in pairs.items()}, **whole}


def controllers(folder):
    traces = [[np.full((50, 4, 2), 1e-3 * (k + 1))] for k in range(8)]
    evaluations = [Evaluation(f"controller-of-my-own-{k}", traces=trace) for k, trace in enumerate(traces)]
    return error_over_time(evaluations, "BirthSIM/Circle-v1, 4 episodes from seed 0, ideal sensors, --randomize all", folder)


DRAWINGS = {
    "figure4": (lambda folder: figure4(record(), folder), {"figure4"}),
    "episode": (lambda folder: episode_figure(record(), "BirthSIM/Circle-v1, pid, seed 0, lab sensors", folder), {"episode"}),
    "controllers": (controllers, {"error_over_time"}),
    "comparison": (
        lambda folder: draw_comparison([cell(name, *where) for name in TEN for where in CONDITIONS], folder),
        {"settled_error", "air_against_error"},
    ),
    "studies": (study, {"rendered_stiffness", "hunting", "disturbances", "stiffness_by_direction", "stiffness_ellipses"}),
    "stability": (stability, {"stability_rig"}),
    "learning": (learning, {"learning_curves"}),
    "correction": (
        lambda folder: draw_corrections(2 * (np.arange(5.0),), 0.9, 2 * (np.ones((2, 5)).cumsum(axis=1),), folder),
        {"correction"},
    ),
}


MANY = ("comparison", "learned", "stability", "stiffness")
"""Studies whose figures ``DRAWINGS`` has too, with fewer figures."""

LONG = ("learning", "studies", "comparison", "stability")
"""Figures that take seconds to draw twice."""


@pytest.mark.parametrize(
    ("draw", "names"),
    [pytest.param(*case, id=name, marks=[pytest.mark.slow] * (name in LONG)) for name, case in DRAWINGS.items()],
)
def test_every_figure_is_a_png_and_an_svg_that_do_not_change(draw, names, tmp_path):
    for folder in (tmp_path / "one", tmp_path / "other"):
        folder.mkdir()
        paths = draw(folder)
        assert {path.name for path in paths} == {f"{name}.{kind}" for name in names for kind in ("png", "svg")}
        assert all(path.is_file() for path in paths)
        assert plt.get_fignums() == []
    for path in paths:
        assert path.read_bytes() == (tmp_path / "one" / path.name).read_bytes()
        if path.suffix == ".svg":
            text = path.read_text()
            assert "<dc:date>" not in text
        else:
            with Image.open(path) as image:
                assert image.width >= 300


@pytest.mark.parametrize(("draw", "names"), DRAWINGS.values(), ids=DRAWINGS)
def test_every_figure_has_the_style_and_every_axis_says_its_unit(draw, names, tmp_path, monkeypatch):
    drawn = caught(monkeypatch)
    draw(tmp_path)
    assert len(drawn) == len(names)
    assert {figure.get_suptitle(): wrong for figure, wrong in drawn if wrong} == {}
    for figure, _ in drawn:
        labels = [label for axes in figure.axes for label in (axes.get_xlabel(), axes.get_ylabel()) if label]
        assert [label for label in labels if not re.search(r"\((mm|%|N|N/m|kg|s|million|normal l/min)\)|% of", label)] == []


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.slow] * (name in MANY))
        for name in names()
        if declared(name).draw is not no_pictures
    ],
)
def test_every_figure_of_a_result_has_the_style(name, tmp_path, monkeypatch):
    drawn = caught(monkeypatch)
    declared(name).draw(read_result(name), tmp_path)
    assert drawn
    assert {figure.get_suptitle(): wrong for figure, wrong in drawn if wrong} == {}


def test_what_the_style_forbids_is_found(tmp_path, monkeypatch):
    drawn = caught(monkeypatch)
    figure, axes = plt.subplots()
    axes.plot([0, 1], color="yellow", label="one")
    axes.plot([1, 0], color="black", label="other")
    axes.set_title("small", fontsize=5)
    axes.legend()
    axes.text(0, 0, "fine")
    figure.text(0.9, 0.5, "a text that leaves the figure on its right side")
    save(figure, tmp_path, "poor")
    assert sorted(drawn[0][1]) == [
        "5 pt: small", "a legend lies on axes", "cut off: a text that leaves the figure on its right side",
        "neither a column nor a page wide", "no finding as title", "one and other differ in colour alone",
        "yellow: contrast 1.1",
    ]  # fmt: skip
    assert contrast("black") == pytest.approx(21)
    assert contrast("#767676") == pytest.approx(4.54, abs=0.01)


def test_a_headline_keeps_units_beside_their_numbers():
    figure = plt.figure(figsize=(style.COLUMN, 2))
    headline(figure, "An error of this length, which fills a line 12 mm")
    assert figure.get_suptitle().splitlines()[-1].endswith("12\N{NO-BREAK SPACE}mm")
    plt.close(figure)


def test_a_legend_has_a_label_once():
    figure, panels = plt.subplots(1, 2)
    for axes in panels:
        axes.plot([0, 1], label="same")
    legend_below(figure, said="heading", also=panels[0].plot([1, 0], label="also"))
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["same", "also"]
    assert legend.get_title().get_text() == "heading"
    plt.close(figure)


def test_a_figure_of_another_name_has_other_identifiers(tmp_path):
    texts = []
    for name in ("one", "other"):
        figure, axes = plt.subplots()
        axes.plot([0, 1])
        save(figure, tmp_path, name)
        texts.append(set(re.findall(r'id="(p[0-9a-f]{10})"', (tmp_path / f"{name}.svg").read_text())))
    # Two drawings in one page must not share clip paths.
    assert texts[0]
    assert not texts[0] & texts[1]
