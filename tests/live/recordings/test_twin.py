"""A log beside its twin as a recording: the log's own numbers, the model's free run, and how the page shows them."""

import math

import numpy as np
import pytest

from baselines.identification.comparing.compared import Candidate, compare
from baselines.identification.experiment import propose
from baselines.identification.laboratory import run_plan
from baselines.identification.log.log_columns import LogOptions
from baselines.identification.log.log_file import write_trial
from baselines.named import make_controller
from birthsim.identification import compare_log, judging_of
from birthsim_env.physics.linkage.geometry import end_effector
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_live.logs.recording import SLICES, load_recording
from birthsim_live.logs.twin import write_twin
from tests.console import call
from tests.identification.test_compared import HEAVY
from tests.identification.trials import OWNER, part, trial
from tests.live.browser import Server, Window

NAMES = "[...document.querySelectorAll('.rigs b')].map((one) => one.textContent)"


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """2 s of a log beside a rig that is too heavy."""
    log = part(trial(), 0, 2100)
    path = tmp_path_factory.mktemp("twins") / "twin.rec"
    found = compare([Candidate("heavy.toml", HEAVY, log)])
    write_twin(found.nearest, log, path)
    return path, found


def test_it_holds_the_log_and_the_free_run(file):
    path, found = file
    read, run = load_recording(path), found.nearest.free
    log = found.trial
    assert read.rig == HEAVY
    assert read.interval == pytest.approx(0.004)
    judged = found.nearest.starts[-1] + found.window - run.start
    assert judged - 0.02 < read.duration < judged
    times = run.start + read.interval * np.arange(len(read.rows))
    # Cells, less what was taken off.
    raw = np.array([np.interp(times, log.times, one) for one in log.pressures]).T - found.nearest.taken.biases
    np.testing.assert_allclose(read.rows[:, SLICES["pressures"]], raw, atol=1e-6)
    track = next(one for one in run.tracks if one.signal.name == "position_y")
    known = np.isfinite(track.measured[0])
    off = (read.rows - read.second)[:, SLICES["position"]][:, 1]
    np.testing.assert_allclose(off, np.interp(times, track.times[0, known], track.error[0, known]), atol=1e-12)
    assert np.abs(off).max() > 5e-3  # it falls
    for rows in (read.rows, read.second):
        np.testing.assert_allclose(end_effector(rows[:, SLICES["joints"]].T, HEAVY).T, rows[:, SLICES["position"]], atol=1e-12)
        np.testing.assert_array_equal(rows[:, SLICES["target"]], read.rows[:, SLICES["position"]])
    at = np.round(times / 1e-3).astype(int)
    np.testing.assert_array_equal(read.rows[:, SLICES["openings"]], log.openings[:, at].T)


def test_a_rail_moves_along_its_line(tmp_path):
    rail = Parameters().replace({"linkage.kind": "rail", "linkage.inclination": math.radians(30.0)})
    log = run_plan(propose(rail, duration=4.0), [rail], make_controller("backstepping", rail), "encoders", 0)[0]
    write_twin(compare([Candidate("rail", rail, log)]).nearest, log, tmp_path / "twin.rec")
    read = load_recording(tmp_path / "twin.rec")
    for rows in (read.rows, read.second):
        x, y = rows[:, SLICES["position"]].T
        np.testing.assert_allclose(np.arctan2(y, x), math.radians(30.0), atol=1e-9)
        assert np.isfinite(rows[:, SLICES["pressures"]]).all()
    places = np.array([np.interp(0.1 + read.interval * np.arange(len(read.rows)), log.times, one) for one in log.positions])
    assert np.abs(read.rows[:, SLICES["position"]].T - places).max() < 1e-3


@pytest.mark.slow
def test_the_page_plays_both(chromium, file):
    path, _ = file
    with Server("live", "--replay", path) as server, Window(chromium, server.url) as window:
        window.wait("birthsim.hello !== null && birthsim.hello.mode === 'replay' && document.body.dataset.rigs === '2'")
        assert window.value(NAMES) == ["the log", "heavy.toml in free run"]
        window.pause()
        window.page.locator("#scrub").fill("1.5")
        window.wait("Math.abs(birthsim.frame.time - 1.5) < 1e-4")
        frame, read = window.frame(), load_recording(path)
        row = round(1.5 / read.interval)
        off = (read.rows - read.second)[row, SLICES["position"]]
        assert frame["error_mm"] == pytest.approx(0.0)
        assert frame["second"]["error_mm"] == pytest.approx(1e3 * np.hypot(*off), rel=1e-6)


@pytest.mark.slow
def test_the_page_plays_a_log_beside_the_rig_that_is_named(chromium, tmp_path):
    log, rig, path = tmp_path / "log.csv", tmp_path / "heavy.toml", tmp_path / "expected.rec"
    write_trial(part(trial(), 0, 2100), log, OWNER)
    HEAVY.to_toml(rig)
    found = compare_log(log, [str(rig)], LogOptions(), judging_of())
    write_twin(found.nearest, found.trial, path)
    with Server("live", "--replay", log, "--parameters", rig) as server, Window(chromium, server.url) as window:
        window.wait("birthsim.hello !== null && birthsim.hello.mode === 'replay' && document.body.dataset.rigs === '2'")
        assert window.value(NAMES) == ["the log", "heavy.toml in free run"]
        assert window.value("birthsim.hello.replay") == "log.csv"
        window.pause()
        window.page.locator("#scrub").fill("1.5")
        window.wait("Math.abs(birthsim.frame.time - 1.5) < 1e-4")
        read = load_recording(path)
        off = (read.rows - read.second)[round(1.5 / read.interval), SLICES["position"]]
        assert window.frame()["second"]["error_mm"] == pytest.approx(1e3 * np.hypot(*off), rel=1e-6)


def test_a_recording_has_its_own_rig(monkeypatch, capsys, file, tmp_path):
    path, _ = file
    HEAVY.to_toml(tmp_path / "heavy.toml")
    status, _, error = call("live", monkeypatch, capsys, "--replay", path, "--parameters", tmp_path / "heavy.toml")
    assert status == 2
    assert "--parameters with --replay; allowed: without it" in error
