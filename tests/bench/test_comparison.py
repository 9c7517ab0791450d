"""The comparison: settings, lost episodes and ratios in its figures, tables and pictures; stored tables pin the rest."""

import math

import pytest

from baselines.bench.pieces import controller_settings, file_stem
from birthsim_env import Parameters
from lab.studies.comparison import figure as comparison_figures
from lab.studies.comparison.grid import METRICS, REFERENCE, Conditions, costs, gather, statistics
from lab.studies.comparison.tables import losses, overview
from tests.controllers.test_named_controllers import OWN
from tests.registered import registered

RIG = Parameters()
CIRCLE = Conditions("BirthSIM/Circle-v2", "ideal", "randomised")
PROBE = Conditions("BirthSIM/Probe-v3", "ideal", "nominal")
INF = math.inf


def test_settings_tell_a_file_from_its_next_version_and_controllers_have_files_of_their_own(tmp_path):
    path = tmp_path / "own.py"
    path.write_text(OWN)
    name = f"{path}:Own"
    first = controller_settings(name, RIG)
    assert controller_settings(name, RIG) == first
    path.write_text(OWN + "\n")
    assert controller_settings(name, RIG)["source"] != first["source"]
    assert controller_settings("backstepping", RIG)["source"] == ""
    assert controller_settings("backstepping", RIG.replace({"mechanics.mass": 4.0})) != controller_settings("backstepping", RIG)
    stems = [file_stem(name) for name in ("backstepping", "a/b.py:C", "a-b.py:C", "a/b.py-C")]
    assert stems[0] == "backstepping"
    assert len(set(stems)) == 4
    assert not any(character in stem for stem in stems for character in "/:")
    with pytest.raises(ValueError, match="controller = 'nobody'; allowed"):
        controller_settings("nobody", RIG)


def result(lost=(False, False, False), cost=1.0, **metrics):
    """What run_cell returns: metrics that are not named say nothing."""
    columns = {name: [None] * len(lost) for name in METRICS if name != "hunting"}
    return {"seeds": [0, 1, 2], "metrics": {**columns, **metrics}, "lost": list(lost), "cost": cost}


class Nobody:
    """A controller of which tables ask what it is told, learns and senses, and no more."""

    def __init__(self, parameters):
        self.parameters = parameters


@pytest.fixture(autouse=True)
def names(monkeypatch):
    """Of the controllers below, as tables ask what they need."""
    for name in ("other", "worst"):
        registered(monkeypatch, Nobody, needs={"force sensor"}, controller=name)


@pytest.fixture
def cells():
    """Three controllers in two environments; the second loses an episode of the first, the third all of them."""
    return gather(
        {
            (REFERENCE, CIRCLE): result(settled_rms=[2.0, 4.0, 8.0], air=[10.0, 20.0, 30.0], restarts=[0.0, 0.0, 0.0]),
            ("other", CIRCLE): result((False, True, False), 2.0, settled_rms=[1.0, 0.1, 2.0], air=[5.0, 5.0, 5.0]),
            ("worst", CIRCLE): result((True, True, True), 4.0, settled_rms=[1.0, 1.0, None]),
            (REFERENCE, PROBE): result(
                stiffness_error=[-20.0, 10.0, None], hunting_x=[1.0, 2.0, None], hunting_y=[3.0, 1.0, None]
            ),
            ("other", PROBE): result(stiffness_error=[1.0, -1.0, 1.0], hunting_x=[0.1, 0.1, 0.1], hunting_y=[0.0, 0.2, 0.0]),
        }
    )


@pytest.fixture
def figures(cells):
    return statistics(cells)


def at(figures, controller, conditions):
    return next(c for c in figures if c["controller"] == controller and c["environment"] == conditions.environment)


def test_figures_count_lost_episodes_as_infinitely_bad(figures):
    law, other, worst = (at(figures, name, CIRCLE) for name in (REFERENCE, "other", "worst"))
    assert law["metrics"]["settled_rms"]["median"] == 4.0
    assert law["metrics"]["settled_rms"]["worst"] == 8.0
    # By its figures until the loss, the median would be 1 and the worst 2.
    assert other["metrics"]["settled_rms"]["median"] == 2.0
    assert other["metrics"]["settled_rms"]["worst"] == INF
    assert other["metrics"]["air"]["worst"] == INF
    assert worst["metrics"]["settled_rms"]["median"] == INF
    # Of air it says nothing at all, and yet it lost what others have figures of.
    assert worst["metrics"]["air"]["median"] == INF
    assert [cell["lost"] for cell in (law, other, worst)] == [0, 1, 3]


def test_a_metric_applies_where_any_controller_says_something_of_it(figures):
    assert "stiffness_error" in at(figures, REFERENCE, PROBE)["metrics"]
    assert not any("stiffness_error" in at(figures, name, CIRCLE)["metrics"] for name in (REFERENCE, "other", "worst"))
    assert "cross_motion" not in at(figures, REFERENCE, PROBE)["metrics"]
    # Errors apply even where every episode is lost before there are any.
    (only,) = statistics(gather({("worst", CIRCLE): result((True, True, True))}))
    assert only["metrics"]["settled_rms"]["median"] == INF
    assert "hunting" not in only["metrics"]


def test_sizes_count_and_hunting_is_the_larger_axis(figures):
    law, other = at(figures, REFERENCE, PROBE)["metrics"], at(figures, "other", PROBE)["metrics"]
    assert (law["stiffness_error"]["median"], law["stiffness_error"]["worst"], law["stiffness_error"]["count"]) == (15, 20, 2)
    assert law["hunting"]["worst"] == 3.0
    assert other["hunting"]["median"] == 0.1
    assert other["hunting"]["worst"] == 0.2


def test_ratios_are_paired_by_episode_and_never_to_nothing(figures):
    other, worst = at(figures, "other", CIRCLE)["ratios"], at(figures, "worst", CIRCLE)["ratios"]
    # 1/2, lost and 2/8: of the medians it would be 2/4.
    assert other["settled_rms"]["median"] == 0.5
    assert other["settled_rms"]["worst"] == INF
    assert worst["settled_rms"]["low"] == INF
    assert "restarts" not in other
    assert at(figures, REFERENCE, CIRCLE)["ratios"] == {}
    # Of the third episode the reference says nothing.
    assert at(figures, "other", PROBE)["ratios"]["stiffness_error"]["count"] == 2
    assert at(figures, "other", PROBE)["ratios"]["stiffness_error"]["median"] == pytest.approx((1 / 20 + 1 / 10) / 2)


def rows(text):
    return [[entry.strip() for entry in line.split("|")[1:-1]] for line in text.splitlines() if line.startswith("| ")]


def test_the_overview_has_a_row_per_controller_and_says_lost(figures):
    head, law, other, worst = rows(overview(figures))
    assert head[0] == "controller"
    assert not any("lab" in title for title in head), "what did not run has no column"
    column = {title: k for k, title in enumerate(head)}
    settled = column["settled error of circles, ideal sensors, mm: median [95 % interval]"]
    assert law[0] == f"`{REFERENCE}`"
    assert law[settled].startswith("4.00 [")
    assert other[settled].startswith("**2.00** [")
    assert "lost]" in other[settled]
    assert worst[settled] == "lost [lost, lost]"
    off, most = (column[f"stiffness error, ideal sensors, %: {statistic}"] for statistic in ("median", "worst"))
    assert [(row[off], row[most]) for row in (law, other, worst)] == [("15.0", "20.0"), ("**1.00**", "1.00"), ("-", "-")]
    assert [row[column["lost episodes"]] for row in (law, other, worst)] == ["0 of 6", "1 of 6", "3 of 3"]


def test_times_stand_apart_from_figures_since_they_differ_from_run_to_run(cells):
    assert costs(cells) == {REFERENCE: 1.0, "other": 1.5, "worst": 4.0}
    assert not any("cost" in key for cell in statistics(cells) for key in cell)


def test_lost_episodes_are_counted_by_environment(figures):
    table = rows(losses(figures))
    assert table[0] == ["lost episodes", "Circle", "Probe"]
    assert table[1:] == [[f"`{REFERENCE}`", "0 of 3", "0 of 3"], ["`other`", "1 of 3", "0 of 3"], ["`worst`", "3 of 3", "-"]]


def test_pictures_show_medians_with_intervals_and_name_what_is_lost(figures, drawn, tmp_path):
    cells = [{**c, "sensors": s} for c in figures for s in ("ideal", "lab") if c["environment"] == CIRCLE.environment]
    comparison_figures.draw_comparison(cells, tmp_path)
    settled, air = drawn["settled_error"], drawn["air_against_error"]
    circle = settled.axes[0]
    assert [label.get_text() for label in circle.get_yticklabels()] == [REFERENCE, "other", "worst"]
    assert [text.get_text() for text in circle.texts] == ["lost", "lost"]
    medians = sorted(float(line.get_xdata()[0]) for line in circle.lines if len(line.get_xdata()) == 1)
    assert medians == [2.0, 2.0, 4.0, 4.0]
    assert circle.get_xlim()[1] < 20, "a lost episode does not stretch the axis"
    errors, used = air.axes
    assert [label.get_text() for label in errors.get_yticklabels()] == ["other", REFERENCE, "worst"]
    assert [text.get_text() for text in air.legends[0].get_texts()] == ["ideal sensors", "lab sensors"]
    for axes, middles in ((errors, [2.0, 2.0, 4.0, 4.0]), (used, [5.0, 5.0, 20.0, 20.0])):
        marks = [(float(line.get_ydata()[0]), float(line.get_xdata()[0])) for line in axes.lines if len(line.get_xdata()) == 1]
        assert [middle for _, middle in sorted(marks)] == middles
        assert [text.get_text() for text in axes.texts] == ["lost", "lost"]
