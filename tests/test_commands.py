"""The console commands as a user runs them: help, files, tables, strict JSON, plain errors, Ctrl-C."""

from __future__ import annotations

import importlib
import json
import math
import signal
import subprocess
import sys
import time
from functools import partial
from importlib.metadata import entry_points
from pathlib import Path

import numpy as np
import pytest

from agents.policy_files import CONFIGURATION, WEIGHTS, load_policy
from baselines import studies
from baselines.commands.shared import write_json
from baselines.metrics import UNITS

ROOT = Path(__file__).parent.parent
COMMANDS = {
    "evaluate": "baselines.commands.evaluate",
    "figure4": "baselines.commands.figure4",
    "train": "agents.commands.train",
}
RESIDUAL = "BirthSIM/ProbeResidual-v0"


def run(command, *arguments):
    """The finished process of a command, in the words of a shell."""
    line = [sys.executable, "-m", COMMANDS[command], *map(str, arguments)]
    return subprocess.run(line, cwd=ROOT, capture_output=True, text=True, check=False, timeout=300)


def call(command, monkeypatch, capsys, *arguments):
    """Exit status, what was printed and what was complained about, of a command within this process."""
    monkeypatch.setattr(sys, "argv", [command, *map(str, arguments)])
    status = 0
    try:
        importlib.import_module(COMMANDS[command]).main()
    except SystemExit as end:
        status = end.code
    return status, *capsys.readouterr()


def strict(path):
    """JSON as others read it: without NaN and Infinity."""

    def refuse(word):
        raise AssertionError(f"{word} is no JSON")

    return json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)


def assert_picture(folder, name):
    assert (folder / f"{name}.png").read_bytes()[:4] == b"\x89PNG"
    assert (folder / f"{name}.png").stat().st_size > 20_000
    assert "<svg" in (folder / f"{name}.svg").read_text()[:1000]


SMALL = """[training]
environment = "BirthSIM/ProbeResidual-v0"
lanes = 32
rollout = 32
batch = 256
epochs = 4
learning_rate = 2e-3
hidden = [32, 32]
validation_lanes = 4
validations = 2
"""


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """A configuration whose trainings take seconds."""
    path = tmp_path_factory.mktemp("configurations") / "small.toml"
    path.write_text(SMALL)
    return path


@pytest.fixture(scope="module")
def trained(tmp_path_factory, small):
    """A folder of birthsim-train, and the process that made it."""
    folder = tmp_path_factory.mktemp("policies") / "deeper" / "policy"
    return folder, run("train", "--config", small, "--steps", 30_000, "--seed", 3, "--authority", 60, "--out", folder)


def test_the_scripts_of_the_package_are_these_commands():
    scripts = {point.name: point for point in entry_points(group="console_scripts") if point.name.startswith("birthsim-")}
    for command, module in COMMANDS.items():
        assert scripts[f"birthsim-{command}"].value == f"{module}:main"
    assert all(callable(point.load()) for point in scripts.values())


@pytest.mark.parametrize(
    ("command", "options"),
    [
        (
            "evaluate",
            (
                *("all", "env", "controller", "policy", "episodes", "seed", "sensors", "randomize", "parameters", "jobs"),
                *("no-studies", "studies-only", "out"),
            ),
        ),
        ("figure4", ("controller", "sensors", "parameters", "out")),
        (
            "train",
            (
                *("config", "env", "algorithm", "law", "impedance", "steps", "seed", "seeds", "jobs", "sensors", "randomize"),
                *("authority", "parameters", "resume", "out"),
            ),
        ),
    ],
)
def test_help_names_every_option_and_touches_nothing(command, options):
    done = run(command, "--help")
    assert done.returncode == 0
    assert done.stderr == ""
    assert done.stdout.startswith(f"usage: birthsim-{command}")
    for option in options:
        assert f"--{option}" in done.stdout, option
    assert done.stdout.count("\n  --") == len(options)


def test_evaluate_writes_a_table_json_and_a_figure(tmp_path):
    out = tmp_path / "new" / "folder"
    arguments = (
        "--env",
        "BirthSIM/Probe-v0",
        "--episodes",
        "3",
        "--seed",
        "7",
        "--controller",
        "backstepping",
        "backstepping-weight",
    )
    done = run("evaluate", *arguments, "--out", out)
    assert done.returncode == 0, done.stderr
    assert sorted(path.name for path in out.iterdir()) == [
        *("error_over_time.png", "error_over_time.svg", "evaluation.json", "evaluation.md")
    ]
    table = (out / "evaluation.md").read_text()
    assert table.strip() in done.stdout
    assert table.startswith("BirthSIM/Probe-v0, 3 episodes from seed 7, ideal sensors, randomised: all")
    assert "| metric | unit | backstepping: median | 95 % | max | backstepping-weight: median | 95 % | max |" in table
    assert "| lost episodes |  | 0 of 3 |  |  | 0 of 3 |  |  |" in table
    content = strict(out / "evaluation.json")
    law, weight = content["results"]
    assert (law["controller"], weight["controller"]) == ("backstepping", "backstepping-weight")
    assert law["seeds"] == weight["seeds"] == [7, 8, 9]
    assert content["arguments"]["env"] == "BirthSIM/Probe-v0"
    assert content["rig"]["mechanics"]["mass"] == 3.0
    for name in UNITS:
        assert len(law["episodes"][name]) == 3
        median = law["summary"][name]["median"]
        rows = [line for line in table.splitlines() if line.startswith(f"| {name} |")]
        assert [row.split("|")[3].strip() for row in rows] == ([] if median is None else [f"{median:.3g}"]), name
    assert weight["summary"]["settled_rms"]["median"] < law["summary"]["settled_rms"]["median"]
    # The figures are there for the stiffness test, whose reference stands still.
    assert math.isfinite(law["summary"]["stiffness_error"]["median"])
    assert_picture(out, "error_over_time")


def test_evaluate_says_null_where_there_is_no_figure_to_give_and_takes_a_rig(tmp_path, monkeypatch, capsys):
    (tmp_path / "rig.toml").write_text("[mechanics]\nmass = 3.5\n")
    arguments = ("--episodes", 1, "--randomize", "none", "--sensors", "lab", "--parameters", tmp_path / "rig.toml")
    status, printed, _ = call("evaluate", monkeypatch, capsys, *arguments, "--out", tmp_path)
    assert status == 0
    assert "BirthSIM/Circle-v0, 1 episodes from seed 0, lab sensors, randomised: none" in printed
    content = strict(tmp_path / "evaluation.json")
    (result,) = content["results"]
    # On the circle the reference never rests.
    assert result["summary"]["stiffness_error"]["median"] is None
    assert result["episodes"]["stiffness_error"] == [None]
    assert "stiffness_error" not in printed, "a row in which nothing is said is left out"
    assert content["rig"]["mechanics"]["mass"] == 3.5


OWN = """
import numpy as np

class Slam:
    def __init__(self, parameters):
        pass
    def reset(self, lanes=None):
        pass
    def command(self, measurement, reference):
        return np.tile([[0.0], [0.0], [1.0], [-1.0]], measurement.position.shape[1])
"""


def test_evaluate_takes_a_controller_from_a_file_and_survives_that_it_loses_every_episode(tmp_path):
    (tmp_path / "slam.py").write_text(OWN)
    name = f"{tmp_path}/slam.py:Slam"
    done = run("evaluate", "--env", "BirthSIM/Probe-v0", "--episodes", 2, "--controller", name, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "Warning" not in done.stderr
    assert "| lost episodes |  | 2 of 2 |" in done.stdout
    (result,) = strict(tmp_path / "out" / "evaluation.json")["results"]
    assert result["lost"] == [True, True]
    assert result["episodes"]["stiffness_error"] == result["episodes"]["cross_motion"] == [None, None]
    assert_picture(tmp_path / "out", "error_over_time")


FAILING = """

class Fails(Slam):
    def command(self, measurement, reference):
        raise RuntimeError("no law at all")
"""
NARROW = ("--all", "--env", "BirthSIM/Probe-v0", "--sensors", "ideal", "--episodes", 2)


@pytest.fixture
def small_studies(monkeypatch):
    """Studies of one pose, which take a second each instead of ten."""
    pose = ((0.5, 0.0),)
    for name, options in (
        ("stiffness", {"setpoints": (2000.0,), "poses": pose, "forces": (20.0,)}),
        ("polar", {"directions": 4, "poses": pose}),
        ("ellipses", {"poses": pose}),
    ):
        monkeypatch.setitem(studies.STUDIES, name, partial(studies.STUDIES[name], **options))
    monkeypatch.setattr(studies, "disturbance_study", partial(studies.disturbance_study, amplitudes=(2.0, 20.0), poses=pose))


def test_evaluate_all_compares_resumes_and_draws(tmp_path, monkeypatch, capsys, small_studies):
    (tmp_path / "slam.py").write_text(OWN)
    slam = f"{tmp_path}/slam.py:Slam"
    arguments = (*NARROW, "--controllers", "backstepping", slam, "--jobs", 1, "--out")
    status, printed, complained = call("evaluate", monkeypatch, capsys, *arguments, tmp_path / "out")
    assert status == 0, complained
    assert "Warning" not in complained
    for title, pieces in (("comparison", 4), ("studies", 8)):
        assert f"{title}: 100%" in complained
        assert f"{pieces}/{pieces} " in complained
    content = strict(tmp_path / "out" / "comparison.json")
    cells = {(cell["controller"], cell["plant"]): cell for cell in content["cells"]}
    assert set(cells) == {(name, plant) for name in ("backstepping", slam) for plant in ("nominal", "randomised")}
    law, lost = cells["backstepping", "nominal"], cells[slam, "nominal"]
    assert (law["episodes"], law["lost"], lost["lost"]) == (2, 0, 2)
    assert 0 < law["metrics"]["stiffness_error"]["median"] < 200
    assert lost["metrics"]["stiffness_error"]["median"] == lost["ratios"]["air"]["low"] == "lost"
    assert set(content["studies"]) == {"stiffness", "polar", "ellipses", "disturbance"}
    assert set(content["studies"]["polar"]) == {"backstepping", slam}
    assert content["studies"]["polar"][slam]["stiffness"] == [[None]] * 4
    assert len(content["studies"]["polar"]["backstepping"]["stiffness"]) == 4
    assert content["arguments"]["controller"] == ["backstepping", slam]
    text = (tmp_path / "out" / "comparison.md").read_text()
    table = text[text.index("| controller |") : text.index("## ")].strip()
    assert table in printed
    assert f"| {slam} | lost; lost |" in table
    for name in (
        *("settled_error", "air_against_error", "rendered_stiffness", "hunting", "disturbances"),
        *("stiffness_by_direction", "stiffness_ellipses"),
    ):
        assert_picture(tmp_path / "out", name)
        assert f"{name}.png" in printed
    # Once more: nothing is computed, and all is the same.
    written = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").rglob("*.json") if path.parent != tmp_path / "out"}
    assert len(written) == 12
    status, again, _ = call("evaluate", monkeypatch, capsys, *arguments, tmp_path / "out")
    assert status == 0
    assert f"comparison: 4 of 4 are there with these settings, rig and code, and are kept: backstepping 2, {slam} 2" in again
    assert "studies: 8 of 8 are there" in again
    assert {path: path.stat().st_mtime_ns for path in written} == written
    assert (tmp_path / "out" / "comparison.md").read_text() == text
    assert strict(tmp_path / "out" / "comparison.json") == content
    # The studies alone, from what is there of them.
    (tmp_path / "out" / "comparison.md").unlink()
    status, alone, _ = call("evaluate", monkeypatch, capsys, *arguments, tmp_path / "out", "--studies-only")
    assert status == 0
    assert "settled_error.png" not in alone
    assert "rendered_stiffness.png" in alone
    assert not (tmp_path / "out" / "comparison.md").exists()
    assert strict(tmp_path / "out" / "comparison.json")["studies"] == content["studies"]


def test_evaluate_all_goes_on_where_it_was_interrupted(tmp_path, monkeypatch, capsys):
    arguments = (*NARROW, "--controllers", "backstepping", "--no-studies", "--out")
    line = [
        *arguments,
        tmp_path / "out",
        "--episodes",
        1,
        "--jobs",
        2,
        "--randomize",
        "all",
        "--controllers",
        "backstepping",
        "backstepping-weight",
    ]
    status, printed = interrupted("evaluate", line, lambda said: "1/2 " in said)
    assert (status, printed) == (130, "")
    done = list((tmp_path / "out").rglob("*.json"))
    assert len(done) == 1
    status, printed, _ = call("evaluate", monkeypatch, capsys, *line)
    assert status == 0
    assert "comparison: 1 of 2 are there with these settings, rig and code, and are kept" in printed
    assert "studies" not in strict(tmp_path / "out" / "comparison.json")["arguments"]["out"]


def test_evaluate_all_keeps_what_others_reached_when_a_controller_fails(tmp_path, monkeypatch, capsys):
    (tmp_path / "own.py").write_text(OWN + FAILING)
    fails = f"{tmp_path}/own.py:Fails"
    arguments = (*NARROW, "--randomize", "scenario", "--no-studies", "--jobs", 1, "--controllers", fails, "backstepping")
    status, printed, complained = call("evaluate", monkeypatch, capsys, *arguments, "--out", tmp_path / "out")
    assert status == 2
    assert "| backstepping |" in printed
    assert "birthsim-evaluate: error: 1 of 2 pieces failed, the first cells/" in complained
    assert "RuntimeError: no law at all" in complained
    assert [cell["controller"] for cell in strict(tmp_path / "out" / "comparison.json")["cells"]] == ["backstepping"]


def test_train_writes_a_policy_that_evaluate_runs_beside_the_law(trained, tmp_path, monkeypatch, capsys):
    folder, done = trained
    assert done.returncode == 0, done.stderr
    assert [path.name for path in folder.iterdir()] == ["seed_3"]
    own = folder / "seed_3"
    assert {path.name for path in own.iterdir()} == {CONFIGURATION, WEIGHTS, "training.json", "checkpoint.pt", "tensorboard"}
    reached, policy = strict(own / "training.json"), load_policy(own)
    assert strict(own / CONFIGURATION)["training"]["reached"] == reached["policy"]
    assert (policy.environment, policy.settings.authority, policy.training["seed"]) == (RESIDUAL, 60.0, 3)
    assert (reached["settings"]["steps"], reached["settings"]["authority"], reached["settings"]["lanes"]) == (30_000, 60.0, 32)
    assert reached["policy"]["pooled_mm"] < reached["law"]["pooled_mm"]
    assert f"backstepping{reached['law']['pooled_mm']:7.2f} mm{reached['law']['tail_mm']:7.2f} mm" in done.stdout
    assert f"seed 3      {reached['policy']['pooled_mm']:7.2f} mm" in done.stdout
    assert "% below" in done.stdout
    assert f"written to {folder}/" in done.stdout
    assert "seed 3: " in done.stderr  # the progress bar
    assert "% better" in done.stderr
    assert "Warning" not in done.stderr
    medians = []
    for name, arguments, place in (("named", ("--controller", "residual"), folder), ("unnamed", (), own)):
        options = ("--env", "BirthSIM/Probe-v0", "--policy", place, "--episodes", 2, "--seed", 900, "--out", tmp_path / name)
        status, printed, _ = call("evaluate", monkeypatch, capsys, *arguments, *options)
        assert status == 0
        assert "residual: median" in printed
        results = strict(tmp_path / name / "evaluation.json")["results"]
        assert [result["controller"] for result in results] == ["backstepping", "residual"]
        medians.append([result["episodes"]["settled_rms"] for result in results])
        assert results[0]["demand"] == results[1]["demand"]
    assert medians[0] == medians[1]
    assert not np.array_equal(*medians[0])


def test_train_refuses_a_folder_with_a_training_and_resumes_it_where_asked(trained, small, monkeypatch, capsys):
    folder, _ = trained
    options = ("--config", small, "--steps", 30_000, "--seed", 3, "--authority", 60, "--out", folder)
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file() and "tfevents" not in path.name}
    status, printed, complained = call("train", monkeypatch, capsys, *options)
    assert (status, printed) == (2, "")
    assert complained.endswith("/seed_3' holds a training; allowed: --resume to go on, or another --out\n")
    status, printed, _ = call("train", monkeypatch, capsys, *options, "--resume")
    assert status == 0, "a training that is over is reported once more"
    assert "seed 3" in printed
    status, _, complained = call("train", monkeypatch, capsys, *options, "--resume", "--law", "backstepping-weight")
    assert status == 2
    assert "is of a training with other law; allowed: the same settings, or a folder of its own" in complained
    after = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file() and "tfevents" not in path.name}
    assert after == before


def test_train_runs_several_seeds_side_by_side_and_evaluate_takes_them_together(tmp_path, small, monkeypatch, capsys):
    options = ("--config", small, "--steps", 1024, "--randomize", "plant", "--sensors", "lab", "--impedance", "variable_kp")
    done = run("train", *options, "--seed", 5, "--seeds", 2, "--jobs", 2, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "leaked" not in done.stderr
    reached = [strict(tmp_path / "out" / f"seed_{seed}" / "training.json") for seed in (5, 6)]
    for seed, one in zip((5, 6), reached, strict=True):
        settings = one["settings"]
        assert (settings["seed"], settings["randomize"], settings["sensors"]) == (seed, "plant", "lab")
        assert (settings["impedance"], settings["law"], settings["algorithm"]) == ("variable_kp", "backstepping", "ppo")
        assert f"seed {seed}      {one['policy']['pooled_mm']:7.2f} mm" in done.stdout
        assert f"seed {seed}: 100%" in done.stderr
    assert reached[0]["law"] == reached[1]["law"]
    assert reached[0]["curve"][-1]["pooled_mm"] != reached[1]["curve"][-1]["pooled_mm"]
    # A seed trained alone, in this very process, becomes the same policy.
    status, _, complained = call("train", monkeypatch, capsys, *options, "--seed", 6, "--out", tmp_path / "alone")
    assert status == 0, complained
    for name in (WEIGHTS, CONFIGURATION):
        alone, together = ((tmp_path / place / "seed_6" / name).read_bytes() for place in ("alone", "out"))
        assert alone == together
    evaluate = ("--env", "BirthSIM/Probe-v0", "--policy", tmp_path / "out", "--episodes", 1, "--out", tmp_path / "evaluated")
    status, printed, complained = call("evaluate", monkeypatch, capsys, *evaluate)
    assert status == 0, complained
    assert "2 training seeds" in printed
    results = strict(tmp_path / "evaluated" / "evaluation.json")["results"]
    assert [result["controller"] for result in results] == ["backstepping", "residual seed_5", "residual seed_6"]
    assert_picture(tmp_path / "evaluated", "learning_curves")


def test_figure4_writes_its_figures_the_picture_and_the_numbers(tmp_path):
    done = run("figure4", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["figure4.json", "figure4.png", "figure4.svg", "rig.png"]
    assert_picture(tmp_path / "out", "figure4")
    assert (tmp_path / "out" / "rig.png").stat().st_size > 10_000
    numbers = strict(tmp_path / "out" / "figure4.json")
    assert numbers["finite"] is True
    assert numbers["duration_s"] == pytest.approx(16)
    assert max(numbers["settled_rms_mm_at_2000"]) < 2.5
    assert max(numbers["settled_rms_mm_at_4000"]) < 1.2
    assert min(numbers["least_clearance_mm"]) > 0
    assert max(numbers["pneumatic_rms_percent"]) < 3
    assert f"{numbers['settled_rms_mm_at_2000'][0]:10.3f}{numbers['settled_rms_mm_at_2000'][1]:10.3f}" in done.stdout


@pytest.fixture
def damaged(trained, tmp_path):
    """A policy folder with a flipped byte."""
    folder = tmp_path / "damaged"
    folder.mkdir()
    for name in (CONFIGURATION, WEIGHTS):
        (folder / name).write_bytes((trained[0] / "seed_3" / name).read_bytes())
    content = bytearray((folder / WEIGHTS).read_bytes())
    content[-1] ^= 1
    (folder / WEIGHTS).write_bytes(content)
    return folder


BAD = [
    ("evaluate", ("--env", "BirthSIM/Square-v0"), "--env 'BirthSIM/Square-v0'; allowed: BirthSIM/Circle-v0, "),
    ("evaluate", ("--env", "CartPole-v1"), "--env 'CartPole-v1'; allowed: BirthSIM/Circle-v0, "),
    ("evaluate", ("--controller", "nobody"), "controller = 'nobody'; allowed: backstepping, backstepping-weight, "),
    (
        "evaluate",
        ("--controller", "nowhere.py:Mine"),
        "controller file 'nowhere.py' does not exist; allowed: path/to/file.py:Class",
    ),
    ("evaluate", ("--controller", "{tmp}/own.py:Mine"), "own.py' has no 'Mine'; allowed: a class with command() and reset()"),
    ("evaluate", ("--controller", "residual", "--policy", "{tmp}/none"), "none' holds no policy; allowed: a folder that"),
    ("evaluate", ("--policy", "{tmp}/none"), "none' holds no policy; allowed: a folder that birthsim-train wrote"),
    ("evaluate", ("--controller", "residual", "--policy", "{damaged}"), "policy.safetensors is not the file that policy.json"),
    ("evaluate", ("--episodes", "0"), "--episodes: '0'; allowed: a whole number >= 1"),
    ("evaluate", ("--episodes", "-3"), "--episodes: '-3'; allowed: a whole number >= 1"),
    ("evaluate", ("--episodes", "some"), "--episodes: 'some'; allowed: a whole number >= 1"),
    ("evaluate", ("--seed", "-1"), "--seed: '-1'; allowed: a whole number from 0 to 4294967295"),
    ("evaluate", ("--sensors", "perfect"), "--sensors: invalid choice: 'perfect' (choose from"),
    ("evaluate", ("--randomize", "some"), "--randomize: invalid choice: 'some' (choose from"),
    ("evaluate", ("--parameters", "nowhere.toml"), "'nowhere.toml'"),
    ("evaluate", ("--parameters", "{tmp}/rig.toml"), "Mechanics.mass = -3.0 is impossible; allowed: a finite number > 0 (kg)"),
    ("evaluate", ("--out", "{tmp}/own.py"), "own.py'"),
    ("evaluate", ("--jobs", "2"), "--jobs, --no-studies and --studies-only; allowed: with --all"),
    ("evaluate", ("--no-studies",), "--jobs, --no-studies and --studies-only; allowed: with --all"),
    ("evaluate", ("--all", "--jobs", "0"), "--jobs: '0'; allowed: a whole number >= 1"),
    ("evaluate", ("--all", "--env", "CartPole-v1"), "--env 'CartPole-v1' with --all; allowed: BirthSIM/Circle-v0, "),
    ("evaluate", ("--all", "--env", RESIDUAL), f"--env '{RESIDUAL}' with --all; allowed: BirthSIM/Circle-v0, "),
    ("evaluate", ("--all", "--randomize", "none"), "--randomize 'none' with --all; allowed: scenario, all"),
    ("evaluate", ("--all", "--policy", "{tmp}/none"), "--policy with --all; allowed: without it"),
    ("evaluate", ("--all", "--controllers", "nobody"), "--controller 'nobody' with --all; allowed: backstepping, "),
    ("evaluate", ("--all", "--controllers", "residual"), "--controller 'residual' with --all; allowed: backstepping, "),
    ("evaluate", ("--all", "--controllers", "{tmp}/own.py:Mine"), "own.py' has no 'Mine'; allowed: a class with command()"),
    ("evaluate", ("--all", "--controllers", "nowhere.py:Mine"), "controller file 'nowhere.py' does not exist; allowed: "),
    ("evaluate", ("--all", "--episodes", "0"), "--episodes: '0'; allowed: a whole number >= 1"),
    ("evaluate", ("--all", "--parameters", "{tmp}/rig.toml"), "Mechanics.mass = -3.0 is impossible; allowed: "),
    ("evaluate", ("--episodes", "2", "--colour", "red"), "unrecognized arguments: --colour red"),
    ("figure4", ("--controller", "residual"), "--controller: invalid choice: 'residual' (choose from"),
    ("figure4", ("--sensors", "perfect"), "--sensors: invalid choice: 'perfect' (choose from"),
    ("figure4", ("--parameters", "nowhere.toml"), "'nowhere.toml'"),
    ("figure4", ("--out", "{tmp}/own.py"), "own.py'"),
    ("train", ("--env", "BirthSIM/Circle-v0"), "--env 'BirthSIM/Circle-v0'; allowed: BirthSIM/CircleResidual-v0, "),
    ("train", ("--env", "Pendulum-v1"), "--env 'Pendulum-v1'; allowed: BirthSIM/CircleResidual-v0, "),
    ("train", ("--steps", "0"), "--steps: '0'; allowed: a whole number >= 1"),
    ("train", ("--steps", "1e6"), "--steps: '1e6'; allowed: a whole number >= 1"),
    ("train", ("--seed", "-1"), "--seed: '-1'; allowed: a whole number from 0 to 4294967295"),
    ("train", ("--seed", "4294967296"), "--seed: '4294967296'; allowed: a whole number from 0 to 4294967295"),
    ("train", ("--config", "square"), "configuration 'square' is no file; allowed: circle, "),
    ("train", ("--config", "{tmp}/own.py"), "own.py' is no TOML: "),
    ("train", ("--config", "{tmp}/rig.toml"), "rig.toml': table 'mechanics'; allowed: training, residual"),
    ("train", ("--algorithm", "dqn"), "--algorithm: invalid choice: 'dqn' (choose from"),
    ("train", ("--law", "pid"), "--law: invalid choice: 'pid' (choose from"),
    ("train", ("--impedance", "soft"), "--impedance: invalid choice: 'soft' (choose from"),
    ("train", ("--law", "none", "--impedance", "variable"), "impedance = 'variable'; allowed: 'fixed', law = 'none' has no"),
    ("train", ("--seeds", "0"), "--seeds: '0'; allowed: a whole number >= 1"),
    ("train", ("--jobs", "0"), "--jobs: '0'; allowed: a whole number >= 1"),
    ("train", ("--smoothing", "0.3"), "unrecognized arguments: --smoothing 0.3"),
    ("train", ("--authority", "0"), "authority = 0.0; allowed: more than 0, at most 500"),
    ("train", ("--authority", "nan"), "authority = nan; allowed: more than 0, at most 500"),
    ("train", ("--randomize", "some"), "--randomize: invalid choice: 'some' (choose from"),
    ("train", ("--parameters", "{tmp}/rig.toml"), "Mechanics.mass = -3.0 is impossible; allowed: a finite number > 0 (kg)"),
    ("train", ("--out", "{tmp}/own.py"), "own.py/seed_0'"),
]


@pytest.mark.parametrize(("command", "arguments", "message"), BAD)
def test_bad_input_ends_with_status_2_and_one_line_that_says_what_is_allowed(
    command, arguments, message, tmp_path, damaged, monkeypatch, capsys
):
    (tmp_path / "own.py").write_text(OWN)
    (tmp_path / "rig.toml").write_text("[mechanics]\nmass = -3.0\n")
    given = [argument.format(tmp=tmp_path, damaged=damaged) for argument in arguments]
    out = [] if "--out" in given else ["--out", tmp_path / "out"]
    status, printed, complained = call(command, monkeypatch, capsys, *given, *out)
    assert status == 2
    assert printed == ""
    lines = complained.strip().splitlines()
    assert lines[-1].startswith(f"birthsim-{command}: error: ")
    assert message in lines[-1]
    # Before the line there is nothing but the usage that argparse shows.
    assert len(lines) == 1 or lines[0].startswith("usage: ")
    assert "Traceback" not in complained
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("command", COMMANDS)
def test_the_output_folder_is_asked_for(command, monkeypatch, capsys):
    status, _, complained = call(command, monkeypatch, capsys)
    assert status == 2
    assert "the following arguments are required: --out" in complained


def test_bad_input_in_a_shell_leaves_one_line_and_no_traceback(tmp_path):
    done = run("evaluate", "--controller", "nobody", "--out", tmp_path / "out")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1
    assert "controller = 'nobody'; allowed: " in done.stderr


def test_json_is_strict_and_whole_or_not_there(tmp_path):
    path = tmp_path / "some.json"
    write_json(path, {"a": [1.5, math.nan, (math.inf, -math.inf, {"b": None})], "c": "NaN", "d": True})
    assert strict(path) == {"a": [1.5, None, [None, None, {"b": None}]], "c": "NaN", "d": True}
    with pytest.raises(TypeError):
        write_json(path, {"a": object()})
    assert strict(path)["c"] == "NaN"
    assert [found.name for found in tmp_path.iterdir()] == ["some.json"]


def interrupted(command, arguments, seen):
    """A command that gets Ctrl-C once ``seen(stderr so far)`` is true: the finished process's status and stdout."""
    # A process that a script starts in the background would ignore Ctrl-C.
    program = (
        f"import signal; signal.signal(signal.SIGINT, signal.default_int_handler); from {COMMANDS[command]} import main; main()"
    )
    line = [sys.executable, "-c", program, *map(str, arguments)]
    process = subprocess.Popen(line, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, bufsize=0)
    said, until = b"", time.monotonic() + 100
    try:
        while not seen(said.decode(errors="replace")):
            assert time.monotonic() < until, said
            part = process.stderr.read(200)
            assert part, said
            said += part
        process.send_signal(signal.SIGINT)
        printed, rest = process.communicate(timeout=60)
    finally:
        process.kill()
        process.wait()
    assert b"Traceback" not in said + rest
    assert b"leaked" not in said + rest
    return process.returncode, printed.decode()


def test_ctrl_c_during_training_keeps_the_best_policy_and_the_checkpoint(tmp_path, small):
    arguments = ("--config", small, "--steps", 10**8, "--out", tmp_path)
    status, printed = interrupted("train", arguments, lambda said: "steps/s" in said and "4.10k" in said)
    assert status == 130
    assert "interrupted after" in printed
    assert f"policy and checkpoint are kept in {tmp_path}/seed_0/" in printed
    assert load_policy(tmp_path / "seed_0").environment == RESIDUAL
    assert (tmp_path / "seed_0" / "checkpoint.pt").is_file()


@pytest.mark.slow
def test_ctrl_c_ends_all_jobs_in_silence(tmp_path, small):
    arguments = ("--config", small, "--steps", 10**8, "--seeds", 2, "--jobs", 2, "--out", tmp_path)
    status, _ = interrupted("train", arguments, lambda said: said.count("4.10k") > 1)
    assert status == 130
    for seed in (0, 1):
        load_policy(tmp_path / f"seed_{seed}")


def test_ctrl_c_during_an_evaluation_keeps_the_complete_episodes(tmp_path):
    arguments = ("--env", "BirthSIM/Probe-v0", "--episodes", 6400, "--out", tmp_path)
    status, printed = interrupted("evaluate", arguments, lambda said: "episodes 128-255" in said)
    assert status == 0
    assert "of 6400 episodes are complete and kept" in printed
    (result,) = strict(tmp_path / "evaluation.json")["results"]
    assert len(result["seeds"]) >= 128
    assert len(result["seeds"]) % 128 == 0
    assert len(result["episodes"]["settled_rms"]) == len(result["seeds"])


def test_ctrl_c_before_anything_is_complete_ends_with_status_130(tmp_path, monkeypatch, capsys):
    def interrupt(*args, **kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr("baselines.commands.evaluate.evaluate", interrupt)
    status, _, complained = call("evaluate", monkeypatch, capsys, "--out", tmp_path)
    assert status == 130
    assert complained == "birthsim-evaluate: interrupted\n"
