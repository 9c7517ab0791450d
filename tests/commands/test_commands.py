"""What the console commands have in common: scripts, help, plain errors, strict JSON."""

import math
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from agents.policy.files import WEIGHTS
from agents.policy.seeds import policy_folders
from birthsim.door import COMMANDS
from birthsim.export import FORMS
from birthsim_env.files import write_json
from tests.console import OWN, RESIDUAL, ROOT, assert_picture, assert_says, call, run, strict, words

HELP = [(name,) for name in COMMANDS] + [("export", "--to", form) for form in FORMS]


@pytest.mark.parametrize("words", HELP, ids=" ".join)
def test_help_fits_80_columns_and_ends_with_an_example(words, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    status, printed, complained = call(words[0], monkeypatch, capsys, *words[1:], "--help")
    assert (status, complained) == (0, "")
    lines = printed.rstrip().splitlines()
    assert printed.lower().startswith(f"usage: birthsim {words[0]}")
    assert [line for line in lines if len(line) > 80] == []
    assert [line for line in lines if line.startswith("example: ")] == lines[-1:]
    assert lines[-1].startswith(f"example: birthsim {' '.join(words)}")
    # What the example names is an option of the command; those of export are its forms'.
    for option in re.findall(r"(?<= )--[a-z-]+", lines[-1]) if words != ("export",) else ():
        assert option in "\n".join(lines[:-1])


def test_help_of_all_fits_80_columns_and_names_every_command_at_once():
    """Nothing heavy is imported for it."""
    program = "import sys; from birthsim.door import main; main(); print(*sorted(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True)
    *printed, modules = done.stdout.splitlines()
    assert [line for line in printed if len(line) > 80] == []
    assert [name for name in COMMANDS if not any(line.startswith(f"  {name} ") for line in printed)] == []
    assert {"numpy", "numba", "gymnasium", "argparse"} & set(modules.split()) == set()


@pytest.mark.parametrize(
    ("line", "asked"),
    [
        (("evalute",), "command = 'evalute' (did you mean 'evaluate'?); allowed: what birthsim --help"),
        (("export", "--to", "fmux"), "--to 'fmux' (did you mean 'fmu'?); allowed: what birthsim export --help"),
        (("nothing",), "command = 'nothing'; allowed: run, live, "),
        (("export", "--to", "stone"), "--to 'stone'; allowed: onnx, wasm, "),
        (("export",), "--to is missing; allowed: onnx, wasm, "),
        (("evaluate", "--episods", "3", "--out", "x"), "--episods. Did you mean --episodes?"),
        (
            ("evaluate", "--controller", "backsteping", "--out", "x"),
            "(did you mean 'backstepping'?); allowed: a registered name",
        ),
        (("run", "--env", "BirthSIM/Forcep-v1", "--out", "x"), "(did you mean 'BirthSIM/Forceps-v1'?); allowed: BirthSIM/"),
    ],
)
def test_what_is_mistyped_is_asked_about(line, asked, monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    status, printed, complained = call(line[0], monkeypatch, capsys, *line[1:])
    assert (status, printed) == (2, "")
    assert asked in complained.splitlines()[-1]
    assert list(tmp_path.iterdir()) == []


def test_options_come_from_toml_and_what_is_typed_counts_more(monkeypatch, capsys, tmp_path):
    (tmp_path / "own.toml").write_text('env = "BirthSIM/Nowhere-v1"\nout = "x"\n')
    monkeypatch.chdir(tmp_path)
    assert "--env 'BirthSIM/Nowhere-v1'" in call("run", monkeypatch, capsys, "--config", "own.toml")[2]
    typed = call("run", monkeypatch, capsys, "--config", "own.toml", "--env", "BirthSIM/There-v1")[2]
    assert "--env 'BirthSIM/There-v1'" in typed
    assert not (tmp_path / "x").exists()
    (tmp_path / "own.toml").write_text('controller = ["pid"]\n')
    assert_says(("--controller", "2"), call("animate", monkeypatch, capsys, "--config", "own.toml", "--out", "x.gif")[2])


def test_an_episode_is_printed_and_drawn(monkeypatch, capsys, tmp_path):
    status, printed, _ = call("run", monkeypatch, capsys, "--env", "BirthSIM/Probe-v2", "--out", tmp_path / "out")
    assert status == 0
    assert_picture(tmp_path / "out", "episode")
    rows = [line.split() for line in printed.splitlines() if re.match(r" +\d+ to +\d+ ", line)]
    # The push of the stiffness test is seen, and the end effector gives way to it and not otherwise.
    assert max(float(row[3]) for row in rows) > 5
    assert all(0 <= float(row[4]) <= float(row[5]) for row in rows)
    assert max(float(row[5]) for row in rows) == float(printed.splitlines()[-3].split()[-1])


def test_doctor_names_what_is_missing(monkeypatch, capsys):
    monkeypatch.setattr("birthsim.doctor.found", lambda name: None if name == "optuna" else "1.0")
    status, printed, _ = call("doctor", monkeypatch, capsys)
    assert status == 0
    extras = {line.split()[0]: line for line in printed.partition("extras\n")[2].splitlines()}
    assert [name for name, line in extras.items() if not line.endswith("works")] == ["tune"]
    assert extras["tune"].endswith("pip install 'birthsim[tune]'")
    assert max(map(len, printed.splitlines())) <= 80 + len(str(Path.cwd()))


def test_studies_come_with_a_clone(monkeypatch, capsys):
    monkeypatch.setattr("birthsim.study.find_spec", lambda name: None)
    status, printed, complained = call("study", monkeypatch, capsys, "status")
    assert (status, printed) == (2, "")
    assert "allowed: in a clone of the project" in complained


@pytest.fixture(scope="module")
def damaged(tmp_path_factory):
    """A policy folder with a flipped byte."""
    folder = tmp_path_factory.mktemp("policies") / "damaged"
    shutil.copytree(policy_folders("circle")[0], folder)
    content = bytearray((folder / WEIGHTS).read_bytes())
    content[-1] ^= 1
    (folder / WEIGHTS).write_bytes(content)
    return folder


ALL = ("--controller", "backstepping")
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
    ("evaluate", ("--policy", "{tmp}/none"), "none' holds no policy; allowed: a folder that birthsim train wrote"),
    (
        "evaluate",
        ("--controller", "residual", "--policy", "{damaged}"),
        "policy.safetensors is damaged: its checksum is of another",
    ),
    ("evaluate", ("--episodes", "0"), ("--episodes", "'0'", "allowed: a whole number ", "1")),
    ("evaluate", ("--episodes", "-3"), ("--episodes", "'-3'", "allowed: a whole number ", "1")),
    ("evaluate", ("--episodes", "some"), ("--episodes", "'some'", "allowed: a whole number ", "1")),
    ("evaluate", ("--seed", "-1"), ("--seed", "'-1'", "allowed: a whole number from 0 to 4294967295")),
    ("evaluate", ("--sensors", "perfect"), ("--sensors", "perfect", "ideal", "lab", "honest")),
    ("evaluate", ("--randomize", "some"), ("--randomize", "some", "none", "plant", "all")),
    ("evaluate", ("--parameters", "nowhere.toml"), "'nowhere.toml'"),
    ("evaluate", ("--parameters", "{tmp}/rig.toml"), "Mechanics.mass = -3.0 is impossible; allowed: a finite number > 0 and"),
    ("evaluate", ("--out", "{tmp}/own.py"), "own.py'"),
    ("evaluate", ("--cluster", "slurm"), ("--cluster", "slurm", "allowed: ray, or ray:ADDRESS of a running cluster")),
    ("evaluate", ("--cluster", "ray:"), ("--cluster", "ray:", "allowed: ray, or ray:ADDRESS of a running cluster")),
    ("sweep", ("nowhere.toml",), "sweep = 'nowhere.toml' cannot be read: "),
    ("sweep", ("{tmp}/own.py",), "own.py' is no TOML: "),
    ("sweep", ("{tmp}/rig.toml",), "rig.toml': 'mechanics'; allowed: [base], [grid], [draw], [search] and [[map]]"),
    ("comparison", ("--jobs", "0"), ("--jobs", "'0'", "allowed: a whole number ", "1")),
    ("comparison", ("--env", "CartPole-v1"), ("--env", "CartPole-v1", "BirthSIM/Circle-v1")),
    ("comparison", ("--env", RESIDUAL), ("--env", RESIDUAL, "BirthSIM/Circle-v1")),
    ("comparison", ("--controller", "nobody"), "controller = 'nobody'; allowed: backstepping, "),
    ("comparison", ("--controller", "residual"), "--controller 'residual'; allowed: residual:POLICY, "),
    ("comparison", ("--controller", "{tmp}/own.py:Mine"), "own.py' has no 'Mine'; allowed: a name that it defines: "),
    ("comparison", ("--controller", "nowhere.py:Mine"), "controller file 'nowhere.py' does not exist; allowed: "),
    ("comparison", ("--episodes", "0"), ("--episodes", "'0'", "allowed: a whole number ", "1")),
    ("comparison", ("--parameters", "{tmp}/rig.toml"), "Mechanics.mass = -3.0 is impossible; allowed: "),
    ("evaluate", ("--episodes", "2", "--colour", "red"), ("--colour", "allowed: ", "--help")),
    ("figure4", ("--controller", "nobody"), "controller = 'nobody'; allowed: backstepping, "),
    ("figure4", ("--set", "gain=3"), "--set 'gain=3'; allowed for backstepping: weight_compensation, "),
    ("evaluate", ("--reference", "nowhere.csv"), "reference = 'nowhere.csv' cannot be read"),
    ("evaluate", ("--user-force", "gentle"), "user_force = 'gentle'; allowed: a birthsim_env.UserForce, 'steps', 'sine'"),
    (
        "animate",
        ("--reference", "{tmp}/own.py:Mine", "--out", "{tmp}/a.webp"),
        "own.py' has no 'Mine'; allowed: a name that it",
    ),
    ("figure4", ("--sensors", "perfect"), ("--sensors", "perfect", "ideal", "lab", "honest")),
    ("figure4", ("--parameters", "nowhere.toml"), "'nowhere.toml'"),
    ("figure4", ("--out", "{tmp}/own.py"), "own.py'"),
    ("train", ("--env", "BirthSIM/Circle-v1"), ("--env 'BirthSIM/Circle-v1'", "; allowed: BirthSIM/CircleResidual-v1, ")),
    ("train", ("--env", "Pendulum-v1"), "--env 'Pendulum-v1'; allowed: BirthSIM/CircleResidual-v1, "),
    ("train", ("--steps", "0"), ("--steps", "'0'", "allowed: a whole number ", "1")),
    ("train", ("--steps", "1e6"), ("--steps", "'1e6'", "allowed: a whole number ", "1")),
    ("train", ("--seed", "-1"), ("--seed", "'-1'", "allowed: a whole number from 0 to 4294967295")),
    ("train", ("--seed", "4294967296"), ("--seed", "'4294967296'", "allowed: a whole number from 0 to 4294967295")),
    ("train", ("--config", "square"), "configuration = 'square' is no file; allowed: circle, "),
    ("train", ("--config", "{tmp}/own.py"), "own.py' is no TOML: "),
    ("train", ("--config", "{tmp}/rig.toml"), "rig.toml': table 'mechanics'; allowed: training, residual"),
    ("train", ("--algorithm", "dqn"), ("--algorithm", "dqn", "ppo", "sac", "tqc")),
    ("train", ("--law", "pid"), ("law = 'pid'", "backstepping-weight", "none")),
    ("train", ("--impedance", "soft"), ("--impedance", "soft", "fixed", "variable")),
    ("train", ("--law", "none", "--impedance", "variable"), "impedance = 'variable'; allowed: 'fixed', law = 'none' has no"),
    ("train", ("--seeds", "0"), ("--seeds", "'0'", "allowed: a whole number ", "1")),
    ("train", ("--jobs", "0"), ("--jobs", "'0'", "allowed: a whole number ", "1")),
    ("train", ("--smoothing", "0.3"), ("--smoothing", "allowed: ", "--help")),
    ("train", ("--authority", "0"), "authority = 0.0; allowed: more than 0, at most 500"),
    ("train", ("--authority", "nan"), "authority = nan; allowed: more than 0, at most 500"),
    ("train", ("--randomize", "some"), ("--randomize", "some", "none", "plant", "all")),
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
    assert lines[-1].startswith(f"{' '.join(words(command))}: error: ")
    assert_says(message, lines[-1])
    # Before the line there is nothing but the usage that argparse shows.
    assert len(lines) == 1 or lines[0].startswith("usage: ")
    assert "Traceback" not in complained
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("command", ["evaluate", "figure4", "animate", "tune", "train"])
def test_the_output_folder_is_asked_for(command, monkeypatch, capsys):
    status, _, complained = call(command, monkeypatch, capsys)
    assert status == 2
    assert "--out" in complained or (command == "tune" and "--controller" in complained)


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
