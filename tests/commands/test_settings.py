"""The settings of commands: the same by option and by TOML, and names that help lists without an import."""

from dataclasses import replace
from pathlib import Path
from typing import get_args, get_type_hints

import pytest
import tomli_w

from agents.residual.settings import IMPEDANCES
from birthsim.command_line.command import program
from birthsim.command_line.settings import RANDOMIZE, Configured, Randomize
from birthsim.commands import train
from birthsim.main import COMMANDS, load
from birthsim_env.parts.drawn.randomization import RANDOMIZE as WORDS
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.registry import entries, names
from tests.console import assert_says, call

TYPED = [name for name in COMMANDS if name not in ("export", "study")]
EXAMPLES = {
    **{name: (load(name).Settings, COMMANDS[name].example.split()) for name in TYPED},
    **{one.name: (one.made.settings, ["--to", one.name, *one.made.example.split()]) for one in entries("export")},
}
"""Command, or form of an export -> its settings, and the arguments of its example."""


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_is_read_and_says_the_same_as_toml(name, tmp_path):
    settings, line = EXAMPLES[name]
    typed = program(name, settings)(line)
    assert isinstance(typed, settings)
    if not isinstance(typed, Configured):
        return
    said = {key: str(value) if isinstance(value, Path) else value for key, value in vars(typed).items() if value is not None}
    (tmp_path / "own.toml").write_text(tomli_w.dumps(said))
    read = program(name, settings)(["--config", str(tmp_path / "own.toml")])
    assert replace(read, config=None) == typed


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("sensor = 'lab'", ("sensor", "--sensors", "own.toml")),
        ("sensors = 'none'", ("sensors", "none", "ideal", "lab", "honest", "own.toml")),
        ("seed = -1", ("seed", "'-1'", "a whole number from 0 to 4294967295")),
        ("seed = 3.0", ("seed", "'3.0'", "a whole number from 0 to 4294967295")),
        ("seed = [1, 2]", ("seed", "own.toml")),
        ("[world]\nseed = 3", ("[world][seed]", "own.toml", "birthsim run --help")),
        ("seed =", ("--config", "own.toml", "no TOML")),
        ("env = 'BirthSIM/Nowhere-v1'", ("--env 'BirthSIM/Nowhere-v1'",)),
    ],
)
def test_what_is_wrong_in_toml_is_named(content, said, monkeypatch, capsys, tmp_path):
    (tmp_path / "own.toml").write_text(content)
    status, _, complained = call("run", monkeypatch, capsys, "--config", tmp_path / "own.toml", "--out", tmp_path / "x")
    assert status == 2
    assert complained.count("\n") == 1
    assert_says(said, complained)


def test_what_is_typed_counts_more_than_toml(tmp_path):
    (tmp_path / "own.toml").write_text("seed = 4\nset = ['bandwidth=60']\nuser-force = 'sine'\nrandomize = 'all'\n")
    read = program("birthsim run", load("run").Settings)
    given = read(
        ["--config", str(tmp_path / "own.toml"), "--out", "x", "--seed", "5", *["--set", "a=1", "b=2", "--set", "c=3"]]
    )
    assert (given.seed, given.set, given.user_force, given.randomize) == (5, ["a=1", "b=2", "c=3"], "sine", "all")


def test_choices_that_help_lists_are_those_that_there_are(monkeypatch, capsys):
    assert set(get_args(get_args(Randomize)[0])) == set(RANDOMIZE)
    assert set(RANDOMIZE.values()) == set(WORDS)
    hints = get_type_hints(train.Settings)
    assert set(get_args(get_args(hints["impedance"])[0])) == set(IMPEDANCES)
    _, printed, _ = call("run", monkeypatch, capsys, "--help")
    listed = " ".join(printed.split("controllers: ")[1].split("\nexample")[0].split())
    known = [name for kind in ("controller", "policy", "sensors", "hand") for name in names(kind)]
    assert [name for name in (*known, *map(environment_id, names("scenario"))) if name not in listed] == []


@pytest.mark.parametrize("name", ["run", "tune"])
def test_a_sensor_model_that_there_is_not_is_refused_with_those_that_there_are(name, monkeypatch, capsys):
    code, _, said = call(name, monkeypatch, capsys, *COMMANDS[name].example.split(), "--sensors", "none")
    assert code == 2
    assert_says(("sensors", *names("sensors")), said)


@pytest.mark.parametrize(("name", "option"), [("compare", "out"), ("identify", "report")])
def test_a_style_of_figures_that_nothing_draws_is_refused(name, option, tmp_path, monkeypatch, capsys):
    (tmp_path / "log.csv").write_text("time,openings_P1\n0,0\n")
    status, _, complained = call(name, monkeypatch, capsys, tmp_path / "log.csv", "--style", "paper")
    assert status == 2
    assert_says(("--style paper", f"--{option} FOLDER"), complained)


@pytest.mark.slow
def test_what_a_residual_has_learned_is_drawn_for_a_paper(tmp_path, monkeypatch, capsys):
    line = ("--policy", "descent", "--no-pushes", "--style", "paper", "--out", tmp_path)
    status, printed, complained = call("explain", monkeypatch, capsys, *line)
    assert status == 0, complained
    assert sorted(path.name for path in tmp_path.iterdir()) == ["correction.pdf", "residual.json", "residual.md"]
    assert "correction.pdf" in printed
