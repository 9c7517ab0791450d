"""What the console commands have in common: scripts, help, plain errors, strict JSON."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from birthsim.commands.doctor import extras
from birthsim.main import COMMANDS
from birthsim_env.registry import names
from tests.console import ROOT, assert_picture, call, run

HELP = [(name,) for name in COMMANDS] + [("export", "--to", form) for form in names("export")]


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


@pytest.mark.parametrize("words", [(), ("doctor", "--help")])  # not those that list what is registered
def test_help_names_every_command_at_once_and_imports_nothing_heavy(words):
    program = "import sys; from birthsim.main import main; main(); print(*sorted(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program, *words], cwd=ROOT, capture_output=True, text=True, check=True)
    *printed, modules = done.stdout.splitlines()
    assert {"numpy", "numba", "gymnasium", "birthsim_env", "argparse"} & set(modules.split()) == set()
    if words == ():
        assert [line for line in printed if len(line) > 80] == []
        assert [name for name in COMMANDS if not any(line.startswith(f"  {name} ") for line in printed)] == []


def test_what_is_mistyped_is_asked_about(monkeypatch, capsys):
    for word, asked in (
        ("evalute", " (did you mean 'evaluate'?); allowed: what birthsim --help"),
        ("nothing", "; allowed: run, "),
    ):
        status, printed, complained = call(word, monkeypatch, capsys)
        assert (status, printed) == (2, "")
        assert f"command = {word!r}{asked}" in complained.splitlines()[-1]


def test_an_episode_is_printed_and_drawn(monkeypatch, capsys, tmp_path):
    status, printed, _ = call("run", monkeypatch, capsys, "--env", "BirthSIM/Probe-v3", "--out", tmp_path / "out")
    assert status == 0
    assert_picture(tmp_path / "out", "episode")
    rows = [line.split() for line in printed.splitlines() if re.match(r" +\d+ to +\d+ ", line)]
    # The push of the stiffness test is seen, and the end effector gives way to it and not otherwise.
    assert max(float(row[3]) for row in rows) > 5
    assert all(0 <= float(row[4]) <= float(row[5]) for row in rows)
    assert max(float(row[5]) for row in rows) == float(printed.splitlines()[-3].split()[-1])


def test_doctor_names_what_is_missing(monkeypatch, capsys):
    monkeypatch.setattr("birthsim.commands.doctor.found", lambda name: None if name == "optuna" else "1.0")
    status, printed, _ = call("doctor", monkeypatch, capsys)
    assert status == 0
    extras = {line.split()[0]: line for line in printed.partition("extras\n")[2].splitlines()}
    assert [name for name, line in extras.items() if not line.endswith("works")] == ["tune"]
    assert extras["tune"].endswith("pip install -e '.[tune]' in a clone")
    assert max(map(len, printed.splitlines())) <= 80 + len(str(Path.cwd()))


def test_cupy_for_another_cuda_serves_as_the_extras_own(monkeypatch):
    here = {"cupy-cuda13x", "nvidia-cuda-nvcc", "llvmlite"}
    monkeypatch.setattr("birthsim.commands.doctor.found", lambda name: "1.0" if name in here else None)
    assert extras()["cuda"] == []
    here.remove("cupy-cuda13x")
    assert extras()["cuda"] == ["cupy-cuda12x"]


def test_studies_come_with_a_clone(monkeypatch, capsys):
    monkeypatch.setattr("birthsim.commands.study.find_spec", lambda name: None)
    status, printed, complained = call("study", monkeypatch, capsys, "status")
    assert (status, printed) == (2, "")
    assert "allowed: in a clone of the project" in complained


@pytest.mark.parametrize("option", ["--out", "--env", "--reference", "--set", "--policy", "--nobody", "--controller"])
def test_what_is_too_long_is_said_in_short(option, monkeypatch, capsys, tmp_path):
    given = ["--out", str(tmp_path)] * (option != "--out")
    long = {"--reference": "x" * 5000 + ".csv", "--controller": f"pid[{'x' * 5000}=1]", "--set": f"{'x' * 5000}=1"}
    status, _, complained = call("evaluate", monkeypatch, capsys, *given, option, long.get(option, "x" * 5000))
    assert status == 2
    assert len(complained) < 1000
    assert complained.count("\n") == 1


COMPILING = "BirthSIM: compiling numerical kernels, usually 10 to 40 s; the result is cached.\n"
"""What the first command after an installation says besides."""


def test_bad_input_in_a_shell_leaves_one_line_and_no_traceback(tmp_path):
    done = run("evaluate", "--controller", "nobody", "--out", tmp_path / "out")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.removeprefix(COMPILING).count("\n") == 1
    assert "controller = 'nobody'; allowed: " in done.stderr
