"""The leaderboard: its table is that of its entries, and an entry that breaks a rule or does not repeat is named."""

import json

import numpy as np
import pytest

from studies import leaderboard


def test_the_table_is_that_of_the_entries():
    assert leaderboard.TABLE.read_text(encoding="utf-8") == leaderboard.table()
    rows = [line.split(" | ") for line in leaderboard.table().splitlines()[2:]]
    assert [row[1] for row in rows] == ["admittance-adaptive", "pid", "backstepping"]
    said = json.loads((leaderboard.ENTRIES / "pid.json").read_text())["results"][0]["episodes"]["settled_rms"]
    assert float(rows[1][4]) == pytest.approx(np.median(said), rel=5e-3)


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


@pytest.mark.slow
@pytest.mark.parametrize("path", leaderboard.entries(), ids=lambda path: path.stem)
def test_every_entry_repeats(path):
    assert leaderboard.problem(path) == ""


@pytest.mark.slow
def test_a_figure_that_differs_by_its_last_bit_is_found(tmp_path):
    said = json.loads((leaderboard.ENTRIES / "pid.json").read_text())
    returns = said["results"][0]["returns"]["1.0"]
    returns[0] = float(np.nextafter(returns[0], np.inf))
    (tmp_path / "own.json").write_text(json.dumps(said))
    assert leaderboard.problem(tmp_path / "own.json") == "other results here"
