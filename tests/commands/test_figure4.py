"""The paper's experiment (Fig. 4), 16 s on the full plant with friction: what the law reaches, and the figures drawn of it."""

import contextlib
import io

import numpy as np
import pytest
from matplotlib import pyplot as plt

from baselines.bench.evaluation import Evaluation, overview
from baselines.figures import runs as figures
from baselines.figures.runs import error_over_time
from birthsim.commands import figure4 as figure4_command
from birthsim.commands.figure4 import FIELDS, metrics_of, record_run
from birthsim_env import Parameters
from tests.console import assert_picture, call, strict

RIG = Parameters()
LIMITS = {2000: 2.5, 4000: 1.2}
"""Setpoint in N/m -> largest settled RMS error per axis, mm: the paper's curves lie within a few millimetres."""


@pytest.fixture(scope="module")
def command(tmp_path_factory):
    """What birthsim figure4 leaves: its folder, its record of the paper's law with ideal sensors, what it printed."""
    records, printed, out = [], io.StringIO(), tmp_path_factory.mktemp("figure4") / "out"

    def kept(*arguments):
        records.append(record_run(*arguments))
        return records[-1]

    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(printed):
        patch.setattr(figure4_command, "record_run", kept)
        figure4_command.main(figure4_command.Settings(out=out))
    return out, records[0], printed.getvalue()


@pytest.fixture(scope="module")
def records(command):
    others = (("backstepping", "lab"), ("backstepping-weight", "ideal"), ("backstepping-weight", "lab"))
    return {("backstepping", "ideal"): command[1], **{setting: record_run(*setting) for setting in others}}


def settled_rms(record, setpoint):
    """mm per axis, more than 0.5 s after a jump, computed from positions, target and force by (19)."""
    compliant = record["target"] + record["user_force"] / record["stiffness_setpoint"]
    chosen = (record["since_jump"] >= 0.5) & (record["stiffness_setpoint"][:, 0] == setpoint)
    return 1e3 * np.sqrt(((record["position"] - compliant)[chosen] ** 2).mean(axis=0))


def test_the_record_is_the_experiment_of_the_paper(records):
    record = records["backstepping", "ideal"]
    time = record["time"]
    assert set(record) == {*FIELDS, "lost"}
    np.testing.assert_allclose(time, 1e-3 * np.arange(16001), atol=1e-9)
    # Circles of 50 mm in 4 s about the centre, pushes of 30 N, stiffness that doubles.
    circle = 0.05 * np.stack([np.cos(np.pi / 2 * time), np.sin(np.pi / 2 * time)], axis=1)
    np.testing.assert_allclose(record["target"] - [0.5, 0.0], circle, atol=1e-9)
    np.testing.assert_array_equal(record["stiffness_setpoint"], np.where(time < 7.9995, 2000.0, 4000.0)[:, None] * [1, 1])
    assert [record["user_force"].min(), record["user_force"].max()] == pytest.approx([-30, 30])


@pytest.mark.parametrize("sensors", ["ideal", "lab"])
@pytest.mark.parametrize("name", ["backstepping", "backstepping-weight"])
def test_the_law_follows_the_compliant_target_on_the_plant_with_friction(records, name, sensors):
    record = records[name, sensors]
    assert all(np.isfinite(values).all() for values in record.values())
    assert record["impact_speed"].max() == 0
    clearance = np.array([0.1, 0.2]) - np.abs(record["piston_position"]).max(axis=0)
    assert (clearance > 0.02).all()
    for setpoint, limit in LIMITS.items():
        assert (settled_rms(record, setpoint) < limit).all()
    # From the moment on which the law has taken over, no jump throws the end effector far away.
    assert np.abs(record["tracking_error"]).max() < 0.02
    relative = record["pneumatic_stiffness"] / record["pneumatic_stiffness_setpoint"] - 1
    assert (np.sqrt((relative**2).mean(axis=0)) < 0.03).all()


@pytest.mark.parametrize("sensors", ["ideal", "lab"])
@pytest.mark.parametrize("setpoint", [2000, 4000])
def test_weight_compensation_lowers_the_error_on_x(records, setpoint, sensors):
    without = settled_rms(records["backstepping", sensors], setpoint)[0]
    assert settled_rms(records["backstepping-weight", sensors], setpoint)[0] < 0.7 * without


def test_the_figures_beside_the_plot_are_those_of_the_record(records):
    record = records["backstepping", "ideal"]
    result = metrics_of(record, RIG)
    for setpoint in LIMITS:
        np.testing.assert_allclose(result[f"settled_rms_mm_at_{setpoint}"], settled_rms(record, setpoint))
        chosen = (record["since_jump"] >= 0.5) & (record["stiffness_setpoint"][:, 0] == setpoint)
        largest = 1e3 * np.abs(record["tracking_error"][chosen]).max(axis=0)
        np.testing.assert_allclose(result[f"settled_max_mm_at_{setpoint}"], largest)
    relative = record["pneumatic_stiffness"] / record["pneumatic_stiffness_setpoint"] - 1
    np.testing.assert_allclose(result["pneumatic_rms_percent"], 100 * np.sqrt((relative**2).mean(axis=0)))
    np.testing.assert_allclose(result["least_clearance_mm"], 1e3 * ([0.1, 0.2] - np.abs(record["piston_position"]).max(axis=0)))
    assert (result["finite"], result["duration_s"]) == (True, pytest.approx(16))
    broken = {**record, "position": np.where(record["time"][:, None] > 15, np.nan, record["position"])}
    assert metrics_of(broken, RIG)["finite"] is False


def test_the_command_writes_its_figures_the_picture_and_the_numbers(command):
    out, record, printed = command
    names = sorted(path.name for path in out.iterdir())
    assert names == ["figure4.json", "figure4.png", "figure4.svg", "rig.png"]
    assert_picture(out, "figure4")
    assert (out / "rig.png").stat().st_size > 10_000
    numbers = strict(out / "figure4.json")
    assert numbers == metrics_of(record, RIG)
    table = {words[0]: words[1:] for words in map(str.split, printed.splitlines()) if words}
    assert table["settled_rms_mm_at_2000"] == [f"{value:.3f}" for value in numbers["settled_rms_mm_at_2000"]]


def test_the_error_over_time_shows_the_median_of_every_controller(tmp_path, monkeypatch):
    size = np.arange(1.0, 7.0)
    traces = [1e-3 * k * np.tile(size[:, None], (50, 1, 1)).reshape(50, 6, 1) * [0.6, 0.8] for k in range(1, 7)]
    evaluations = [Evaluation(f"law {k}", traces=[trace[:, :2], trace[:, 2:]]) for k, trace in enumerate(traces)]
    drawn = []
    monkeypatch.setattr(figures, "save", lambda figure, folder, name: drawn.append(figure))
    error_over_time(evaluations, "six", tmp_path)
    (axes,) = drawn[0].axes
    lines = axes.get_lines()
    assert [line.get_label().split(" (")[0] for line in lines] == [f"law {k}" for k in range(6)]
    for k, line in enumerate(lines):
        time, median = line.get_data()
        np.testing.assert_allclose(time, 0.01 * np.arange(50))
        np.testing.assert_allclose(median, 3.5 * (k + 1))
    plt.close(drawn[0])


def test_screen_and_figure_say_one_metric_by_one_name(tmp_path, monkeypatch):
    """The settled error of ``birthsim evaluate``: not the median over time of what is drawn."""
    said = []
    monkeypatch.setattr(figures, "headline", lambda figure, words: said.append(words))
    monkeypatch.setattr(figures, "save", lambda figure, folder, name: plt.close(figure))
    trace = [np.full((50, 3, 2), 2e-3)]

    def one(name, settled, lost=(False, False, False)):
        return Evaluation(name, metrics={"settled_rms": settled}, lost=list(lost), traces=trace)

    good, bad = one("good", [3.3, 3.486, 4.0]), one("bad", [5.0, 6.0, 7.0])
    for evaluations in ([good], [bad, good], [one("odd", [np.nan] * 3)], [one("lost", [1.0] * 3, [True] * 3)]):
        error_over_time(evaluations, "some", tmp_path)
    assert "3.49" in overview([good])
    assert "settled error, mm" in overview([good])
    assert said == [
        "good: median of the settled error, 3.49 mm",
        "good: smallest median of the settled error, 3.49 mm",
        "Error over time; nothing settled",
        "Error over time; most episodes were lost",
    ]


def test_what_is_lost_is_said_to_be_lost(tmp_path, monkeypatch, capsys):
    (tmp_path / "heavy.toml").write_text("[mechanics]\nmass = 400.0\n")
    arguments = ("--parameters", tmp_path / "heavy.toml", "--out", tmp_path / "out")
    status, printed, complained = call("figure4", monkeypatch, capsys, *arguments)
    assert (status, printed) == (2, "")
    assert "Mechanics.mass = 400 kg is more than this rig can carry" in complained
    arguments = ("--controller", "slammed-valves", "--out", tmp_path / "out")
    status, printed, complained = call("figure4", monkeypatch, capsys, *arguments)
    assert (status, printed) == (2, "")
    assert "slammed-valves lost the end effector after 0." in complained
    assert complained.rstrip().endswith("Allowed: a controller and a rig that keep it")
    assert strict(tmp_path / "out" / "figure4.json")["lost"] is True
