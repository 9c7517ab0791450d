"""``agents.commands.beside_law``: several seeds of a policy beside their law, in the same worlds."""

from __future__ import annotations

import sys

import pytest

from agents.commands import beside_law


def told(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["beside_law", *arguments])
    beside_law.main()
    return capsys.readouterr()


def test_a_trained_policy_is_better_than_its_law_on_ideal_sensors(monkeypatch, capsys):
    out = told(monkeypatch, capsys, "--policy", "circle", "--sensors", "ideal", "--episodes", "16", "--seed", "86000").out
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in out.splitlines() if line.startswith("|")]
    medians = [float(row[1]) for row in rows[2:] if row[1]]
    assert len(medians) >= 2
    assert max(medians[1:]) < medians[0], "a law of millimetres, policies of half of one"


def test_no_policy_is_one_line(monkeypatch, capsys, tmp_path):
    with pytest.raises(SystemExit):
        told(monkeypatch, capsys, "--policy", str(tmp_path))
    assert len(capsys.readouterr().err.strip().splitlines()) == 1
