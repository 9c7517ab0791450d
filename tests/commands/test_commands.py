"""What the console commands have in common: scripts, help, plain errors, strict JSON."""

from __future__ import annotations

import math
import re
import shutil
from importlib.metadata import entry_points

import pytest

from agents.policy.files import WEIGHTS
from agents.policy.seeds import policy_folders
from baselines.commands import start
from baselines.work.files import write_json
from tests.console import COMMANDS, OWN, RESIDUAL, call, run, strict


def test_the_scripts_of_the_package_are_these_commands():
    scripts = {point.name: point for point in entry_points(group="console_scripts") if point.name.startswith("birthsim-")}
    for command, module in COMMANDS.items():
        assert scripts[f"birthsim-{command}"].value == "baselines.commands.start:command"
        assert start._module(command).__name__ == module
    assert all(callable(point.load()) for point in scripts.values())


@pytest.mark.parametrize(
    ("command", "options"),
    [
        (
            "evaluate",
            (
                *(
                    "all",
                    "env",
                    "controller",
                    "policy",
                    "episodes",
                    "seed",
                    "sensors",
                    "randomize",
                    "parameters",
                    "jobs",
                    "cluster",
                ),
                *("reference", "stiffness", "user-force", "set", "no-studies", "studies-only", "out"),
            ),
        ),
        ("figure4", ("controller", "set", "sensors", "parameters", "out")),
        ("sweep", ("jobs", "cluster", "out")),
        (
            "train",
            (
                *("config", "env", "algorithm", "law", "impedance", "steps", "until", "seed", "seeds", "jobs", "sensors"),
                *("randomize", "authority", "parameters", "out"),
            ),
        ),
    ],
)
def test_help_names_every_option_and_touches_nothing(command, options, monkeypatch, capsys):
    status, printed, complained = call(command, monkeypatch, capsys, "--help")
    assert (status, complained) == (0, "")
    assert printed.startswith(f"usage: birthsim-{command}")
    for option in options:
        assert f"--{option}" in printed, option
    assert printed.count("\n  --") == len(options)


@pytest.fixture(scope="module")
def damaged(tmp_path_factory):
    """A policy folder with a flipped byte."""
    folder = tmp_path_factory.mktemp("policies") / "damaged"
    shutil.copytree(policy_folders("circle")[0], folder)
    content = bytearray((folder / WEIGHTS).read_bytes())
    content[-1] ^= 1
    (folder / WEIGHTS).write_bytes(content)
    return folder


ALL = ("--all", "--controllers", "backstepping")
BAD = [
    ("evaluate", ("--env", "BirthSIM/Square-v1"), "--env 'BirthSIM/Square-v1'; allowed: BirthSIM/Circle-v1, "),
    ("evaluate", ("--env", "CartPole-v1"), "--env 'CartPole-v1'; allowed: BirthSIM/Circle-v1, "),
    ("evaluate", ("--controller", "nobody"), "controller = 'nobody'; allowed: backstepping, admittance, "),
    (
        "evaluate",
        ("--controller", "nowhere.py:Mine"),
        "controller file 'nowhere.py' does not exist; allowed: path/to/file.py:Name",
    ),
    ("evaluate", ("--controller", "{tmp}/own.py:Mine"), "own.py' has no 'Mine'; allowed: a name that it defines: "),
    ("evaluate", ("--controller", "residual", "--policy", "{tmp}/none"), "none' holds no policy; allowed: a folder that"),
    ("evaluate", ("--policy", "{tmp}/none"), "none' holds no policy; allowed: a folder that birthsim-train wrote"),
    (
        "evaluate",
        ("--controller", "residual", "--policy", "{damaged}"),
        "policy.safetensors is damaged: its checksum is of another",
    ),
    ("evaluate", ("--episodes", "0"), "--episodes: '0'; allowed: a whole number >= 1"),
    ("evaluate", ("--episodes", "-3"), "--episodes: '-3'; allowed: a whole number >= 1"),
    ("evaluate", ("--episodes", "some"), "--episodes: 'some'; allowed: a whole number >= 1"),
    ("evaluate", ("--seed", "-1"), "--seed: '-1'; allowed: a whole number from 0 to 4294967295"),
    ("evaluate", ("--sensors", "perfect"), "--sensors: invalid choice: 'perfect' (choose from"),
    ("evaluate", ("--randomize", "some"), "--randomize: invalid choice: 'some' (choose from"),
    ("evaluate", ("--parameters", "nowhere.toml"), "'nowhere.toml'"),
    ("evaluate", ("--parameters", "{tmp}/rig.toml"), "Mechanics.mass = -3.0 is impossible; allowed: a finite number > 0 and"),
    ("evaluate", ("--out", "{tmp}/own.py"), "own.py'"),
    ("evaluate", ("--no-studies",), "--no-studies and --studies-only; allowed: with --all"),
    ("evaluate", ("--cluster", "slurm"), "--cluster: 'slurm'; allowed: ray, or ray:ADDRESS of a running cluster"),
    ("evaluate", ("--cluster", "ray:"), "--cluster: 'ray:'; allowed: ray, or ray:ADDRESS of a running cluster"),
    ("sweep", ("nowhere.toml",), "sweep = 'nowhere.toml' cannot be read: "),
    ("sweep", ("{tmp}/own.py",), "own.py' is no TOML: "),
    ("sweep", ("{tmp}/rig.toml",), "rig.toml': 'mechanics'; allowed: [base], [grid], [draw], [search] and [[map]]"),
    ("evaluate", ("--all", "--jobs", "0"), "--jobs: '0'; allowed: a whole number >= 1"),
    ("evaluate", (*ALL, "--env", "CartPole-v1"), "--env 'CartPole-v1' with --all; allowed: BirthSIM/Circle-v1, "),
    ("evaluate", (*ALL, "--env", RESIDUAL), f"--env '{RESIDUAL}' with --all; allowed: BirthSIM/Circle-v1, "),
    ("evaluate", (*ALL, "--randomize", "none"), "--randomize 'none' with --all; allowed: scenario, all"),
    ("evaluate", ("--all", "--policy", "{tmp}/none"), "--policy with --all; allowed: without it"),
    ("evaluate", ("--all", "--controllers", "nobody"), "--controller 'nobody' with --all; allowed: backstepping, "),
    ("evaluate", ("--all", "--controllers", "residual"), "--controller 'residual' with --all; allowed: backstepping, "),
    ("evaluate", ("--all", "--controllers", "{tmp}/own.py:Mine"), "own.py' has no 'Mine'; allowed: a name that it defines: "),
    ("evaluate", ("--all", "--controllers", "nowhere.py:Mine"), "controller file 'nowhere.py' does not exist; allowed: "),
    ("evaluate", ("--all", "--episodes", "0"), "--episodes: '0'; allowed: a whole number >= 1"),
    ("evaluate", ("--all", "--parameters", "{tmp}/rig.toml"), "Mechanics.mass = -3.0 is impossible; allowed: "),
    ("evaluate", ("--episodes", "2", "--colour", "red"), "unrecognized arguments: --colour red"),
    ("figure4", ("--controller", "nobody"), "controller = 'nobody'; allowed: backstepping, "),
    ("figure4", ("--set", "gain=3"), "--set 'gain=3'; allowed for backstepping: weight_compensation, "),
    ("evaluate", ("--reference", "nowhere.csv"), "reference = 'nowhere.csv' cannot be read"),
    ("evaluate", ("--user-force", "gentle"), "user_force = 'gentle'; allowed: a birthsim_env.UserForce, 'steps', 'sine'"),
    (
        "animate",
        ("--reference", "{tmp}/own.py:Mine", "--out", "{tmp}/a.webp"),
        "own.py' has no 'Mine'; allowed: a name that it",
    ),
    ("figure4", ("--sensors", "perfect"), "--sensors: invalid choice: 'perfect' (choose from"),
    ("figure4", ("--parameters", "nowhere.toml"), "'nowhere.toml'"),
    ("figure4", ("--out", "{tmp}/own.py"), "own.py'"),
    ("train", ("--env", "BirthSIM/Circle-v1"), "--env 'BirthSIM/Circle-v1'; allowed: BirthSIM/CircleResidual-v1, "),
    ("train", ("--env", "Pendulum-v1"), "--env 'Pendulum-v1'; allowed: BirthSIM/CircleResidual-v1, "),
    ("train", ("--steps", "0"), "--steps: '0'; allowed: a whole number >= 1"),
    ("train", ("--steps", "1e6"), "--steps: '1e6'; allowed: a whole number >= 1"),
    ("train", ("--seed", "-1"), "--seed: '-1'; allowed: a whole number from 0 to 4294967295"),
    ("train", ("--seed", "4294967296"), "--seed: '4294967296'; allowed: a whole number from 0 to 4294967295"),
    ("train", ("--config", "square"), "configuration = 'square' is no file; allowed: circle, "),
    ("train", ("--config", "{tmp}/own.py"), "own.py' is no TOML: "),
    ("train", ("--config", "{tmp}/rig.toml"), "rig.toml': table 'mechanics'; allowed: training, residual"),
    ("train", ("--algorithm", "dqn"), "--algorithm: invalid choice: 'dqn' (choose from"),
    ("train", ("--law", "pid"), "law = 'pid'; allowed: 'backstepping', 'backstepping-weight', "),
    ("train", ("--impedance", "soft"), "--impedance: invalid choice: 'soft' (choose from"),
    ("train", ("--law", "none", "--impedance", "variable"), "impedance = 'variable'; allowed: 'fixed', law = 'none' has no"),
    ("train", ("--seeds", "0"), "--seeds: '0'; allowed: a whole number >= 1"),
    ("train", ("--jobs", "0"), "--jobs: '0'; allowed: a whole number >= 1"),
    ("train", ("--smoothing", "0.3"), "unrecognized arguments: --smoothing 0.3"),
    ("train", ("--authority", "0"), "authority = 0.0; allowed: more than 0, at most 500"),
    ("train", ("--authority", "nan"), "authority = nan; allowed: more than 0, at most 500"),
    ("train", ("--randomize", "some"), "--randomize: invalid choice: 'some' (choose from"),
    ("train", ("--parameters", "{tmp}/rig.toml"), "Mechanics.mass = -3.0 is impossible; allowed: a finite number > 0 and"),
    ("train", ("--out", "{tmp}/own.py"), "own.py' is a file; allowed: a folder"),
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


@pytest.mark.parametrize("command", ["evaluate", "figure4", "animate", "tune", "stability", "train"])
def test_the_output_folder_is_asked_for(command, monkeypatch, capsys):
    status, _, complained = call(command, monkeypatch, capsys)
    assert status == 2
    assert re.search(r"the following arguments are required: (--controller, )?--out\n", complained)


COMPILING = "BirthSIM: compiling numerical kernels, usually 10 to 40 s; the result is cached.\n"
"""What the first command after an installation says besides."""


@pytest.mark.parametrize(
    ("command", "arguments", "message"),
    [
        ("evaluate", ("--controller", "nobody"), "controller = 'nobody'; allowed: "),
        pytest.param("figure4", ("--parameters", "nowhere.toml"), "'nowhere.toml'", marks=pytest.mark.slow),
    ],
)
def test_bad_input_in_a_shell_leaves_one_line_and_no_traceback(tmp_path, command, arguments, message):
    done = run(command, *arguments, "--out", tmp_path / "out")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.removeprefix(COMPILING).count("\n") == 1
    assert message in done.stderr


def test_json_is_strict_and_whole_or_not_there(tmp_path):
    path = tmp_path / "some.json"
    write_json(path, {"a": [1.5, math.nan, (math.inf, -math.inf, {"b": None})], "c": "NaN", "d": True})
    assert strict(path) == {"a": [1.5, None, [None, None, {"b": None}]], "c": "NaN", "d": True}
    with pytest.raises(TypeError):
        write_json(path, {"a": object()})
    assert strict(path)["c"] == "NaN"
    assert [found.name for found in tmp_path.iterdir()] == ["some.json"]
