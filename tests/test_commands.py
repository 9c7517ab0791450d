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


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """A policy folder of birthsim-train, and the process that made it."""
    folder = tmp_path_factory.mktemp("policies") / "deeper" / "policy"
    done = run("train", "--env", RESIDUAL, "--steps", "60000", "--seed", "3", "--authority", "60", "--out", folder)
    return folder, done


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
                *("no-studies", "out"),
            ),
        ),
        ("figure4", ("controller", "sensors", "parameters", "out")),
        ("train", ("env", "steps", "seed", "sensors", "randomize", "authority", "parameters", "out")),
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
    assert sorted(path.name for path in folder.iterdir()) == [CONFIGURATION, WEIGHTS, "training.json"]
    reached, policy = strict(folder / "training.json"), load_policy(folder)
    assert (policy.environment, policy.settings.authority, policy.training["seed"]) == (RESIDUAL, 60.0, 3)
    assert reached["policy"]["pooled_mm"] < reached["law"]["pooled_mm"]
    assert f"law         {reached['law']['pooled_mm']:7.2f} mm" in done.stdout
    assert f"residual    {reached['policy']['pooled_mm']:7.2f} mm" in done.stdout
    assert "below the law" in done.stdout
    assert "training:" in done.stderr  # the progress bar
    medians = []
    for name, arguments in (("named", ("--controller", "residual")), ("unnamed", ())):
        options = ("--env", "BirthSIM/Probe-v0", "--policy", folder, "--episodes", 2, "--seed", 900, "--out", tmp_path / name)
        status, printed, _ = call("evaluate", monkeypatch, capsys, *arguments, *options)
        assert status == 0
        assert "residual: median" in printed
        results = strict(tmp_path / name / "evaluation.json")["results"]
        assert [result["controller"] for result in results] == ["backstepping", "residual"]
        medians.append([result["episodes"]["settled_rms"] for result in results])
    assert medians[0] == medians[1]
    assert not np.array_equal(*medians[0])


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
        (folder / name).write_bytes((trained[0] / name).read_bytes())
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
    (
        "evaluate",
        ("--controller", "residual"),
        "--controller residual needs --policy DIR, the folder that birthsim-train wrote",
    ),
    ("evaluate", ("--controller", "residual", "--policy", "{tmp}/none"), "none' has no policy.json; allowed: a folder that"),
    ("evaluate", ("--policy", "{tmp}/none"), "none' has no policy.json; allowed: a folder that birthsim-train wrote"),
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
    ("evaluate", ("--jobs", "2"), "--jobs and --no-studies; allowed: with --all"),
    ("evaluate", ("--no-studies",), "--jobs and --no-studies; allowed: with --all"),
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
    ("train", ("--authority", "0"), "authority = 0.0; allowed: more than 0, at most 500"),
    ("train", ("--authority", "nan"), "authority = nan; allowed: more than 0, at most 500"),
    ("train", ("--randomize", "some"), "--randomize: invalid choice: 'some' (choose from"),
    ("train", ("--parameters", "{tmp}/rig.toml"), "Mechanics.mass = -3.0 is impossible; allowed: a finite number > 0 (kg)"),
    ("train", ("--out", "{tmp}/own.py"), "own.py'"),
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


def test_ctrl_c_during_training_keeps_the_best_policy(tmp_path):
    arguments = ("--env", RESIDUAL, "--steps", 10**8, "--out", tmp_path)
    status, printed = interrupted("train", arguments, lambda said: "steps/s" in said and "16.4k" in said)
    assert status == 0
    assert "interrupted after" in printed
    assert "below the law" in printed
    assert load_policy(tmp_path).environment == RESIDUAL
    assert strict(tmp_path / "training.json")["curve"][0]["steps"] == 0


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
