"""``agents.commands.beside_law``: several seeds of a policy beside their law, in the same worlds."""

from __future__ import annotations

import sys

import pytest

from agents.commands import beside_law


def told(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["beside_law", *arguments])
    beside_law.main()
    return capsys.readouterr()


def rows_of(text):
    """Of the two tables, the rows below their heads."""
    tables = [[line for line in part.splitlines() if line.startswith("| ")] for part in text.split("\n\n| |")[1:]]
    return [[[cell.strip() for cell in line.split("|")[1:-1]] for line in table] for table in tables]


def test_a_trained_policy_is_better_than_its_law_on_ideal_sensors(monkeypatch, capsys):
    settled, felt = rows_of(
        told(
            monkeypatch, capsys, *("--policy", "circle", "--sensors", "ideal"), *("--episodes", "16", "--rigs", "1"),
            *("--seed", "86000"),
        ).out
    )  # fmt: skip
    medians = [float(row[1]) for row in settled if row[1]]
    assert len(medians) >= 2
    assert max(medians[1:]) < medians[0], "a law of millimetres, policies of half of one"
    assert [row[0] for row in felt] == [row[0] for row in settled]
    errors = [float(row[3]) for row in felt if row[3]]
    assert max(errors[1:]) < errors[0], "own error under a multisine hand"
    gained = [float(row[5].split()[0]) for row in felt[1:-1]]
    assert gained == pytest.approx([errors[0] - own for own in errors[1:]], abs=0.02), "one rig: its mean is the median"


def test_no_policy_is_one_line(monkeypatch, capsys, tmp_path):
    with pytest.raises(SystemExit):
        told(monkeypatch, capsys, "--policy", str(tmp_path))
    assert len(capsys.readouterr().err.strip().splitlines()) == 1
