"""birthsim study speed: what it measures in processes of their own, and what it says where something is missing."""

import json
import shutil

import pytest

from agents.residual.settings import LAWS
from lab.studies.speed import speeds as speed
from lab.studies.speed import study as bench
from tests.console import call


def plant(seconds):
    return {"rows": [("plant", 1.0, "policy steps/s")]}


@pytest.mark.slow
def test_another_checkout_is_measured_in_turns_with_this_one(tmp_path, monkeypatch, capsys):
    # Machine code goes by the contents of the sources, so that the copy need not compile.
    shutil.copytree(speed.HERE / "birthsim_env", tmp_path / "birthsim_env")
    monkeypatch.setattr(speed, "ROUNDS", 2)
    monkeypatch.setattr(speed, "SHARED", speed.SHARED[:1])
    monkeypatch.setattr(speed, "LANES", ())
    monkeypatch.setattr(bench, "here", plant)
    out = tmp_path / "out"
    status, printed, complained = call("speed", monkeypatch, capsys, "--seconds", "0.02", "--beside", tmp_path, "--out", out)
    assert status == 0, complained
    figures = json.loads((out / "speed.json").read_text())["figures"]
    assert figures["here"]["rows"] == [["plant", 1.0, "policy steps/s"]]
    single, one, two, ratio = figures["environments"]["rows"]
    assert single[4] == pytest.approx(single[1] / single[3])
    assert 0.2 < single[4] < 5.0
    assert ratio[1] == pytest.approx(one[1] / two[1])
    assert len(one) == 3
    assert f"| {tmp_path.name} | times as fast | unit |" in printed


def test_what_a_checkout_cannot_do_ends_the_measurement():
    with speed.Process(speed.HERE) as process, pytest.raises(ValueError, match="has ended; its last words are above"):
        process.measure("step", environment="BirthSIM/Nothing-v1", budget=0.01)


@pytest.mark.slow
@pytest.mark.weekly
def test_first_steps_compile_once(monkeypatch):
    monkeypatch.setattr(speed, "LAWS", LAWS[:1])
    seconds = dict(speed.first_steps())
    names = [name.removesuffix(", compiled") for name in seconds if name.endswith(", compiled")]
    assert len(names) == 2
    assert seconds["valve mode, compiled"] > 3.0 * seconds["valve mode, cached"]
    assert all(
        seconds[f"{name}, {state}"] < seconds["valve mode, compiled"] for name in names for state in ("prebuilt", "cached")
    )
