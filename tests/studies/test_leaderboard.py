"""The leaderboard: its table is that of its entries, and an entry that breaks a rule or does not repeat is named."""

import json

import numpy as np
import pytest

from birthsim_env.parts.scenarios import environment_id
from lab.studies import leaderboard


def test_the_table_is_that_of_the_entries():
    assert leaderboard.TABLE.read_text(encoding="utf-8") == leaderboard.table()
    rows = [line.split(" | ") for line in leaderboard.table().splitlines()[4:]]
    on_rail = ["rail-admittance-adaptive", "rail-abry"]
    assert [row[1] for row in rows] == ["admittance-adaptive", "pid", "backstepping", *on_rail]
    said = json.loads((leaderboard.ENTRIES / "pid.json").read_text())["results"][0]["episodes"]["settled_rms"]
    assert float(rows[1][7]) == pytest.approx(np.median(said), rel=5e-3)


@pytest.mark.parametrize("path", leaderboard.entries(), ids=lambda path: path.stem)
def test_every_entry_keeps_the_rules(path):
    assert leaderboard.against_rules(json.loads(path.read_text())) == ""


def test_what_breaks_a_rule_is_named(tmp_path):
    said = json.loads((leaderboard.ENTRIES / "pid.json").read_text())
    for change, problem in (
        ({"seed": 3}, "seed = 3; allowed: 80000"),
        ({"user_force": "sine"}, "user_force = 'sine'; allowed: None"),
        ({"set": ["bandwidth=90"]}, "set = ['bandwidth=90']; allowed: None"),
    ):
        (tmp_path / "own.json").write_text(json.dumps({**said, "arguments": said["arguments"] | change}))
        assert leaderboard.problem(tmp_path / "own.json") == problem


def changed(folder, **arguments):
    """An entry in a folder of its own, of the environment as it is now, with other arguments."""
    said = json.loads((leaderboard.ENTRIES / "pid.json").read_text())
    given = said["arguments"] | {"env": environment_id("circle")} | arguments
    (folder / "own.json").write_text(json.dumps({**said, "arguments": given}))
    return folder / "own.json"


MARK = "from pathlib import Path\nPath(__file__).with_name('ran').touch()\nclass Own: pass\n"


@pytest.mark.parametrize(
    "name",
    [
        "{elsewhere}/own.py:Own",
        "../elsewhere/own.py:Own",
        "link.py:Own",
        "./own.py:Own",
        "own.txt:Own",
        "gone.py:Own",
        "folder/own.py:Own",
        "own.py:Own[a=1]",
        "limited:own.py:Own",
        "residual:../elsewhere",
        "residual:{elsewhere}",
        "residual:linked",
        "residual",
        "residual[policy={elsewhere}]",
        "--out=x",
        "--help",
        "-h",
        "pid --out x",
        "pid[bandwidth=nan]",
        "pid[bandwith=60]",
        "pid[bandwidth=60",
        "",
        "pid\n",
        "backsteping",
    ],
)
def test_an_entry_runs_nothing_but_registered_names_and_files_beside_it(name, tmp_path, monkeypatch):
    beside, elsewhere = tmp_path / "entries", tmp_path / "elsewhere"
    for folder in (beside, elsewhere, beside / "folder"):
        folder.mkdir()
        for file in ("own.py", "own.txt"):
            (folder / file).write_text(MARK)
    (beside / "link.py").symlink_to(elsewhere / "own.py")
    (beside / "linked").symlink_to(elsewhere)
    monkeypatch.setattr(leaderboard.subprocess, "run", lambda *_, **__: pytest.fail("a command was run"))
    said = leaderboard.problem(changed(beside, controller=[name.format(elsewhere=elsewhere)]))
    assert "controller" in said
    assert "allowed" in said
    assert not list(tmp_path.rglob("ran"))


@pytest.mark.parametrize(
    "arguments",
    [
        {"env": "--help"},
        {"env": "BirthSIM/Moon-v1"},
        {"policy": "circle"},
        {"controller": ["pid", "lqr"]},
        {"controller": []},
        {"seed": 80000.0},
        {"seed": True},
        {"seed": None},
        {"parameters": "rig.toml"},
        {"reference": "own.py:Own"},
        {"out": "/"},
        {"--out": "x"},
        {"stiffness": []},
    ],
    ids=str,
)
def test_an_entry_has_no_other_arguments(arguments, tmp_path, monkeypatch):
    monkeypatch.setattr(leaderboard.subprocess, "run", lambda *_, **__: pytest.fail("a command was run"))
    assert "allowed" in leaderboard.problem(changed(tmp_path, **arguments))


@pytest.mark.parametrize("name", ["pid[bandwidth=60]", "limited:pid", "admittance-adaptive", "residual:circle", "own.py:Own"])
def test_an_entry_may_name_what_is_registered_and_a_file_beside_it(name, tmp_path):
    (tmp_path / "own.py").write_text(MARK)
    said = leaderboard.entry(changed(tmp_path, controller=[name]))
    assert leaderboard.against_rules(said, tmp_path) == ""
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize(
    "text",
    ["", "{", "[1]", "{}", '{"results": 1}', '{"results": [1]}', '{"a":' * 9000, '{"a": 1' + "0" * 400 + "}"],
    ids=range(8),
)
def test_a_damaged_entry_is_named_and_costs_the_others_nothing(text, tmp_path, monkeypatch, capsys):
    (tmp_path / "x.json").write_text(text)
    with pytest.raises(ValueError, match=r"^entry = .*x\.json' is damaged.*; allowed: "):
        leaderboard.problem(tmp_path / "x.json")
    monkeypatch.setattr(leaderboard, "ENTRIES", tmp_path)
    monkeypatch.setattr(leaderboard, "TABLE", tmp_path / "table.md")
    with pytest.raises(SystemExit):
        leaderboard.main(leaderboard.Settings())
    assert capsys.readouterr().out.startswith("'x': entry = ")
    assert not leaderboard.TABLE.exists()


@pytest.mark.slow
def test_a_file_beside_an_entry_repeats_and_others_there_are_no_modules(tmp_path):
    """What lies beside an entry may have the name of a module, which Python then does not take for it."""
    (tmp_path / "own.py").write_text("from baselines.uncontrolled import ShutValves as Own\n")
    (tmp_path / "numpy.py").write_text(MARK)
    assert leaderboard.problem(changed(tmp_path, controller=["own.py:Own"])) == "other results here"
    assert not (tmp_path / "ran").exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, id=path.stem, marks=() if path.stem in ("pid", "rail-abry") else pytest.mark.weekly)
        for path in leaderboard.entries()
    ],
)
def test_every_entry_repeats(path):
    assert leaderboard.problem(path) == ""


@pytest.mark.slow
def test_a_figure_that_differs_by_its_last_bit_is_found(tmp_path):
    said = json.loads((leaderboard.ENTRIES / "pid.json").read_text())
    returns = said["results"][0]["returns"]["1.0"]
    returns[0] = float(np.nextafter(returns[0], np.inf))
    (tmp_path / "own.json").write_text(json.dumps(said))
    assert leaderboard.problem(tmp_path / "own.json") == "other results here"
