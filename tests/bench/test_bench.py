"""birthsim study speed: what it measures in processes of their own, and what it says where something is missing."""

import json
import math
import shutil

import pytest

from agents.residual.settings import LAWS
from studies.speed import command as bench
from studies.speed import speeds as speed
from tests.console import call


@pytest.mark.slow
def test_another_checkout_is_measured_in_turns_with_this_one(tmp_path, monkeypatch, capsys):
    # Machine code goes by the contents of the sources, so that the copy need not compile.
    shutil.copytree(speed.HERE / "birthsim_env", tmp_path / "birthsim_env")
    monkeypatch.setattr(speed, "ROUNDS", 2)
    monkeypatch.setattr(speed, "SHARED", speed.SHARED[:1])
    monkeypatch.setattr(speed, "LANES", ())
    monkeypatch.setattr(bench, "_rows", lambda budget: [("plant", 1.0, "policy steps/s")])
    out = tmp_path / "out"
    status, printed, complained = call("speed", monkeypatch, capsys, "--seconds", "0.02", "--beside", tmp_path, "--out", out)
    assert (status, complained) == (0, "")
    plant, single, one, two, ratio = json.loads((out / "bench.json").read_text())
    assert plant == {"what": "plant", "value": 1.0, "unit": "policy steps/s"}
    assert single["times_as_fast"] == pytest.approx(single["value"] / single["beside"])
    assert 0.2 < single["times_as_fast"] < 5.0
    assert ratio["value"] == pytest.approx(one["value"] / two["value"])
    assert "beside" not in one
    assert f"{tmp_path.name:>14} times as fast" in printed


def test_what_a_checkout_cannot_do_ends_the_measurement():
    with speed.Process(speed.HERE) as process, pytest.raises(ValueError, match="has ended; its last words are above"):
        process.measure("step", environment="BirthSIM/Nothing-v1", budget=0.01)


def test_without_gcc_the_twin_has_no_speed(monkeypatch):
    monkeypatch.setattr(bench, "has_compiler", lambda: False)
    kernel, twin = bench._against_c(32, 0.01)
    assert kernel > 0.0
    assert math.isnan(twin)


@pytest.mark.slow
def test_first_steps_compile_once():
    seconds = dict(speed.first_steps())
    names = [name.removesuffix(", compiled") for name in seconds if name.endswith(", compiled")]
    assert len(names) == 1 + len(LAWS)
    assert seconds["valve mode, compiled"] > 3.0 * seconds["valve mode, cached"]
    assert all(seconds[f"{name}, cached"] < seconds["valve mode, compiled"] for name in names)
