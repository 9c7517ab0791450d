"""Drives through processes: what only the watching one sees, how a drive ends, and what is left."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from baselines.identification.experiment import propose, suited
from baselines.identification.log.log_file import read_trial
from birthsim_drive.safety.limits import Limits
from birthsim_drive.session import PERIODS, TOLD, Drive, perform, recovered
from tests.console import PATIENCE, call, run
from tests.drive.rigs import PROBE, RIG

FILES = ("log.csv", "asked.csv")

DRIVER = '''
import os, signal, time
from pathlib import Path
import numpy as np
from birthsim_env.loop.signals import Measurement

class Rig:
    """A rig that stands still."""

    def __init__(self, rig):
        self.time, self.reads = 0.0, 0

    def read(self):
        self.reads += 1
        self.time += 0.001
        time.sleep(0.001)
        if self.reads == 300:
            {ends}
        place, still = np.array([0.5, 0.0]), np.zeros(2)
        noise = np.random.default_rng(self.reads).normal(size=4)
        return Measurement(np.float64(self.time), place, np.float64(self.time), still, 4e5 + noise, still, True)

    def write(self, openings):
        pass

    def stop(self):
        with open({marks!r}, "a") as file:
            file.write(f"{{os.getpid()}}\\n")
'''


def told(driver, **options):
    return Drive(
        **{"driver": driver, "controller": "pid", "rig": RIG, "limits": Limits().for_rig(RIG), "duration": 3.0, **options}
    )


@pytest.mark.parametrize(("ends", "kind"), [("time.sleep(600)", "hung"), ("os.kill(os.getpid(), signal.SIGKILL)", "killed")])
def test_a_loop_that_is_gone_is_stopped_by_another_process(tmp_path, ends, kind):
    marks, file = tmp_path / "stopped", tmp_path / "rig.py"
    file.write_text(DRIVER.format(ends=ends, marks=str(marks)))
    outcome = perform(told(f"{file}:Rig", limiter=False, ramp=0.0), tmp_path)
    assert [one.kind for one in outcome.faults] == [kind]
    assert marks.read_text().split() == [str(os.getpid())]
    assert outcome.kept.shape[1] >= 290  # what was logged is not lost


def test_a_driver_that_cannot_be_stopped_is_said(tmp_path):
    file = tmp_path / "rig.py"
    ends = "os.kill(os.getpid(), signal.SIGKILL)"
    file.write_text(DRIVER.format(ends=ends, marks=str(tmp_path / "nowhere" / "stopped")))
    outcome = perform(told(f"{file}:Rig", limiter=False, ramp=0.0), tmp_path)
    assert [one.kind for one in outcome.faults] == ["killed"]
    assert "NOT be stopped" in outcome.faults[0].action


def test_a_loop_that_ends_stops_its_driver_itself(tmp_path):
    marks, file = tmp_path / "stopped", tmp_path / "rig.py"
    file.write_text(DRIVER.format(ends="raise OSError('unplugged')", marks=str(marks)))
    outcome = perform(told(f"{file}:Rig", limiter=False, ramp=0.0), tmp_path)
    assert [one.kind for one in outcome.faults] == ["read"]
    assert len(marks.read_text().split()) == 1
    assert marks.read_text().split() != [str(os.getpid())]


def test_a_plan_leaves_a_log_that_identify_reads(tmp_path):
    plan, out = tmp_path / "plan.csv", tmp_path / "out"
    suited(propose(RIG, 4.0), RIG).write(plan)
    options = ("--plan", str(plan), "--controller", "backstepping", "--no-limiter", "--lockstep", "--out", str(out))
    done = run("drive", *options)
    assert done.returncode == 0, done.stderr
    assert "no fault" in done.stdout
    trial = read_trial(out / "log.csv", RIG)
    assert trial.times[-1] - trial.times[0] > 5.9  # with both ramps
    assert np.abs(trial.openings).max() > 0.3
    timing = json.loads((out / "timing.json").read_text())
    assert timing["missed_by_the_rig"] == 0
    assert "in lockstep" in done.stdout
    assert not (out / "timing.png").exists()  # no clock ran
    assert not (out / PERIODS).exists()


def test_a_dry_run_leaves_what_was_asked_for_and_what_the_controller_wanted(tmp_path):
    options = ("--dry-run", "--env", "BirthSIM/Circle-v2", "--duration", "1.2", "--ramp", "0.3", "--lockstep", "--no-limiter")
    done = run("drive", *options, "--out", str(tmp_path))
    assert done.returncode == 0, done.stderr
    log, asked = (np.genfromtxt(tmp_path / name, delimiter=",", names=True, dtype=None, encoding="utf-8") for name in FILES)
    np.testing.assert_array_equal(log["time"], asked["time"])
    course = asked[asked["phase"] == "course"]
    angle = 2 * np.pi * (course["time"] - course["time"][0]) / 4.0  # the circle of Fig. 4: 50 mm about (0.5, 0), 4 s
    np.testing.assert_allclose(np.hypot(course["target_x"] - 0.5, course["target_y"]), 0.05, atol=1e-9)
    turned = np.unwrap(np.arctan2(course["target_y"], course["target_x"] - 0.5))
    np.testing.assert_allclose(np.abs(turned - turned[0]), angle, atol=1e-6)
    assert {*course["stiffness_x"]} == {2000.0}
    assert np.abs(log["openings_P2"]).max() == 0.0
    assert np.abs(course["wanted_P2"]).max() > 0.1


def test_what_a_rail_was_asked_for_is_counted_as_its_log_is(tmp_path):
    options = ("--parameters", "examples/meng_rig.toml", "--env", "BirthSIM/Rail-v0", "--duration", "2", "--lockstep")
    done = run("drive", *options, "--out", str(tmp_path))
    assert done.returncode == 0, done.stderr
    log, asked = (np.genfromtxt(tmp_path / name, delimiter=",", names=True, dtype=None, encoding="utf-8") for name in FILES)
    course = asked["phase"] == "course"
    assert np.ptp(asked["target"][course]) > 0.02
    assert np.abs(log["position"] - asked["target"])[course].max() < 0.5 * np.ptp(asked["target"][course])


def _until(holds, process):
    """Wait for a state."""
    ends = time.monotonic() + PATIENCE
    while not holds():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < ends
        time.sleep(0.02)


def _begun(out):
    return (out / PERIODS).is_file() and (np.fromfile((out / PERIODS).read_text(), count=1) > 300).any()


def _driving(out, *options):
    command = (sys.executable, "-m", "birthsim", "drive", "--duration", "600", "--ramp", "0.2", "--out", str(out), *options)
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_ctrl_c_ends_a_drive_as_stated_and_keeps_its_log(tmp_path):
    out = tmp_path / "out"
    with _driving(out, "--controller", "backstepping", "--safety", str(_patient(tmp_path))) as process:
        _until(lambda: _begun(out), process)
        process.send_signal(signal.SIGINT)
        said, error = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130, error
    assert "interrupted" in said
    assert len((out / "log.csv").read_text().splitlines()) > 300


def test_a_drive_whose_watching_process_is_killed_ends_and_is_recovered(tmp_path):
    out = tmp_path / "out"
    with _driving(out, "--controller", "backstepping", "--safety", str(_patient(tmp_path))) as process:
        _until(lambda: _begun(out), process)
        process.kill()
        process.communicate(timeout=PATIENCE)
    ends = time.monotonic() + PATIENCE
    while not (out / TOLD).is_file():  # what the loop writes when it has ended
        assert time.monotonic() < ends
        time.sleep(0.02)
    assert [one["kind"] for one in json.loads((out / TOLD).read_text())["faults"]] == ["interrupted"]
    left = recovered(out, RIG)
    assert left is not None
    assert left.trial(RIG).times.size > 300
    done = run("drive", "--duration", "0.2", "--lockstep", "--no-limiter", "--ramp", "0", "--out", str(out))
    assert done.returncode == 0, done.stderr
    assert len((out / "log_recovered.csv").read_text().splitlines()) > 300


def _patient(folder: Path) -> Path:
    """Limits for a busy machine, on which samples wait."""
    path = folder / "safety.toml"
    path.write_text("[limits]\nfault_time = 5.0\nlate_periods = 5000\nleap = 5.0\nposition_age = 5.0\n")
    return path


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--driver", "udp:nowhere"), "allowed: udp:HOST:PORT"),
        (("--driver", "upd:127.0.0.1:5005"), "udp"),
        (("--driver", "missing.py:Rig"), "missing.py"),
        (("--driver", "udp:127.0.0.1:5005", "--lockstep"), "--lockstep with --driver"),
        (("--plan", "plan.csv", "--env", PROBE), "--plan with --env"),
        (("--provoke", "nan-presure@1"), "nan-pressure"),
        (("--provoke", "nan-pressure"), "KIND@SECONDS"),
        (("--ramp", "-1"), ">= 0"),
        ((), "--out is missing"),
    ],
)
def test_what_cannot_be_driven_is_refused(tmp_path, monkeypatch, capsys, options, said):
    out = () if not options else ("--out", str(tmp_path / "out"))
    status, _, error = call("drive", monkeypatch, capsys, *options, *out)
    assert status == 2
    assert said in error
    assert error.rpartition("\r")[2].count("\n") == 1  # behind the bar


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[limits]\nspeeed = 1.0", "speed"),
        ("[limits]\nspeed = -1.0", "limits.speed"),
        ("[on_fault]\npressure = 'hold'", "close, vent"),
        ("[on_fault]\npressure = 'pray'", "close, vent"),
        ("[on_fault]\nhung = 'close'", "hung"),
        ("limits = 3", "[limits]"),
        ("[limits]\nopening = 1.5", "limits.opening"),
        ("[limits]\nfault_time = inf", "limits.fault_time"),
        ("[limits]\nspeed = nan", "limits.speed"),
        ("[limits]\nspeed = 'fast'", "limits.speed"),
        ("[limits]\nspeed = true", "limits.speed"),
        ("[on_fault]\nspeed = 3", "close, vent"),
        ("[on_fault]\nspeed = ['vent']", "close, vent"),
    ],
)
def test_a_bad_file_of_limits_is_refused(tmp_path, monkeypatch, capsys, text, said):
    path = tmp_path / "safety.toml"
    path.write_text(text)
    status, _, error = call("drive", monkeypatch, capsys, "--safety", path, "--show-limits")
    assert status == 2
    assert said in error
    assert "safety.toml" in error


def test_limits_are_shown_as_they_act(tmp_path, monkeypatch, capsys):
    path = tmp_path / "safety.toml"
    path.write_text("[limits]\nspeed = 0.4\n[on_fault]\ndefault = 'vent'\nlate = 'hold'\n")
    status, said, _ = call("drive", monkeypatch, capsys, "--safety", path, "--show-limits")
    assert status == 0
    assert "speed 0.4 m/s" in said
    assert "hold at late" in said


def test_a_fault_is_seen_in_the_exit_status(tmp_path):
    options = (
        "--lockstep",
        "--duration",
        "0.5",
        "--ramp",
        "0",
        "--provoke",
        "high-pressure@0.1",
        "--out",
        str(tmp_path / "out"),
    )
    done = run("drive", *options)
    assert done.returncode == 1, done.stderr
    assert "pressure: a chamber's pressure is outside of its limits; P2 has 20 bar" in done.stdout
    dry = run("drive", *options[:-1], str(tmp_path / "dry"), "--dry-run")
    assert dry.returncode == 0, dry.stderr
    assert "dry run, nothing happens; else: close" in dry.stdout


@pytest.mark.parametrize("place", ["127.0.0.1:9", "255.255.255.255:9"])
def test_a_rig_that_nobody_reaches_is_said_in_a_line(tmp_path, place):
    done = run("drive", "--driver", f"udp:{place}", "--duration", "0.2", "--out", str(tmp_path / "out"))
    assert done.returncode in (1, 2)
    assert "Traceback" not in done.stderr
    assert "start: no good sample has come at all" in done.stdout or "allowed: a rig that can be reached" in done.stderr
