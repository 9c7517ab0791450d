"""What every figure has in common: the style, both formats, the same bytes again, and lines that a grey print tells apart."""

import re

import numpy as np
import pytest
from matplotlib import pyplot as plt
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

from agents.reports.correction_figure import draw_corrections
from baselines.bench.evaluation import Evaluation
from baselines.figures import style
from baselines.figures.runs import episode_figure, error_over_time, figure4
from baselines.figures.style import headline, legend_below, save
from lab.engine.results import read_result
from lab.engine.shelf import declared, names
from lab.engine.study import no_pictures
from tests.figures import caught, contrast


def record():
    time = np.linspace(0, 16, 65)
    way = np.stack([np.cos(time), np.sin(time)], axis=1)
    pairs = {"user_force": 30.0, "target": 0.05, "compliant_target": 0.05, "position": 0.051, "tracking_error": 1e-3}
    stiffness = {"stiffness_setpoint": 2000.0, "pneumatic_stiffness": 4000.0, "pneumatic_stiffness_setpoint": 4000.0}
    whole = {name: np.where(time < 8, value, 2 * value)[:, None] + np.zeros(2) for name, value in stiffness.items()}
    return {"time": time, "since_jump": time % 1, **{name: value * way for name, value in pairs.items()}, **whole}


def controllers(folder):
    traces = [[np.full((50, 4, 2), 1e-3 * (k + 1))] for k in range(8)]
    evaluations = [Evaluation(f"controller-of-my-own-{k}", traces=trace) for k, trace in enumerate(traces)]
    return error_over_time(evaluations, "BirthSIM/Circle-v2, 4 episodes from seed 0, ideal sensors, --randomize all", folder)


def of_result(name):
    return lambda folder: declared(name).draw(read_result(name), folder)


DRAWINGS = {
    "figure4": lambda folder: figure4(record(), folder),
    "episode": lambda folder: episode_figure(record(), "BirthSIM/Circle-v2, pid, seed 0, lab sensors", folder),
    "controllers": controllers,
    "correction": lambda folder: draw_corrections(2 * (np.arange(5.0),), 0.9, 2 * (np.ones((2, 5)).cumsum(axis=1),), folder),
}
UNIT = r"\((mm|µm|%|N|N/m|kN/m|kg|s|ms|Hz|-|N s/m|J|degrees|million|normal l/min|bar|1/s|m|euro)\)|% of|fraction of|^magnitude"
RESULTS = {name: of_result(name) for name in names() if declared(name).draw is not no_pictures}


@pytest.mark.parametrize(
    "draw", [*DRAWINGS.values(), pytest.param(RESULTS["comparison"], marks=pytest.mark.weekly)], ids=[*DRAWINGS, "comparison"]
)
def test_every_figure_is_a_png_and_an_svg_that_do_not_change(draw, tmp_path):
    for folder in (tmp_path / "one", tmp_path / "other"):
        folder.mkdir()
        draw(folder)
        assert plt.get_fignums() == []
    paths = sorted(folder.iterdir())
    assert [path.suffix for path in paths] == [".png", ".svg"] * (len(paths) // 2)
    for path in paths:
        assert path.read_bytes() == (tmp_path / "one" / path.name).read_bytes()
        if path.suffix == ".svg":
            assert "<dc:date>" not in path.read_text()
        else:
            with Image.open(path) as image:
                assert image.width >= 300


@pytest.mark.parametrize("name", [*DRAWINGS, *RESULTS])
def test_every_figure_has_the_style_and_every_axis_says_its_unit(name, tmp_path, monkeypatch):
    drawn = caught(monkeypatch)
    {**DRAWINGS, **RESULTS}[name](tmp_path)
    assert drawn
    assert {figure.get_suptitle(): wrong for figure, wrong in drawn if wrong} == {}
    for figure, _ in drawn:
        labels = [label for axes in figure.axes for label in (axes.get_xlabel(), axes.get_ylabel()) if label]
        assert [label for label in labels if not re.search(UNIT, label)] == []


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
        "5 pt: small",
        "a legend lies on axes",
        "cut off: a text that leaves the figure on its right side",
        "neither a column nor a page wide",
        "no finding as title",
        "one and other differ in colour alone",
        "yellow: contrast 1.1",
    ]
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


def test_twenty_four_controllers_have_marks_of_their_own():
    """Whether or not lines join them, and with colours left out: marker, and whether it is hollow."""
    marks = [style.look(k) for k in range(24)]
    assert len({(one["marker"], one.get("mfc")) for one in marks}) == 24
    assert style.look(23, markers=False).keys() == {"color", "linestyle"}


def test_for_a_paper_figures_have_its_width_and_its_letters_no_title_and_carry_their_fonts(tmp_path, monkeypatch):
    drawn, save_figure = [], Figure.savefig

    def kept(self, file, **options):
        self.canvas.draw()
        drawn.append(self)
        save_figure(self, file, **options)

    monkeypatch.setattr(Figure, "savefig", kept)
    before = dict(style.STYLE)
    with style.drawn_for("paper"):
        for draw in DRAWINGS.values():
            draw(tmp_path)
    paths = sorted(tmp_path.iterdir())
    assert before == style.STYLE
    assert len(drawn) == len(paths) >= len(DRAWINGS)
    assert {path.suffix for path in paths} == {".pdf"}
    assert all(b"FontFile2" in path.read_bytes() for path in paths)
    for figure in drawn:
        assert figure.get_suptitle() == ""
        assert any(np.isclose(figure.get_figwidth(), width) for width in (3.5, 7.16))
        letters = {text.get_fontsize() for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()}
        assert letters == {8.0}


def test_a_short_logarithmic_axis_has_several_labels():
    figure, axes = plt.subplots(2)
    for panel, high in zip(axes, (5.0, 500.0), strict=True):
        panel.set(xscale="log", xlim=(0.5, high))
        style.log_ticks(panel.xaxis, 1.0)
    figure.canvas.draw()
    said = [[tick for tick in panel.get_xticks() if panel.get_xlim()[0] <= tick <= panel.get_xlim()[1]] for panel in axes]
    assert said == [[1.0, 3.0], [1.0, 10.0, 100.0]]
    plt.close(figure)
