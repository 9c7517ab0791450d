"""``studies.residual.beside_law``: several seeds of a policy beside their law, in the same worlds."""

from __future__ import annotations

import shutil
import sys

import pytest

from agents.policy.seeds import SHIPPED
from studies.residual import beside_law


def told(monkeypatch, capsys, *arguments):
    monkeypatch.setattr(sys, "argv", ["beside_law", *arguments])
    beside_law.main()
    return capsys.readouterr()


def rows_of(text):
    """Of the two tables, the rows below their heads."""
    tables = [[line for line in part.splitlines() if line.startswith("| ")] for part in text.split("\n\n| law |")[1:]]
    return [[[cell.strip() for cell in line.split("|")[1:-1]] for line in table] for table in tables]


@pytest.mark.usefixtures("brief")
def test_one_seed_stands_beside_its_law_and_the_mean_of_one_is_itself(monkeypatch, capsys, tmp_path):
    shutil.copytree(SHIPPED / "circle" / "seed_0", tmp_path / "seed_0")
    monkeypatch.setattr(beside_law, "_feel", lambda *_: None)
    (settled,) = rows_of(told(monkeypatch, capsys, "--policy", str(tmp_path), "--sensors", "ideal", "--episodes", "3").out)
    assert [row[0] for row in settled] == ["backstepping-force-first", "seed_0", "all seeds"]
    assert float(settled[1][1]) < float(settled[0][1]), "a law of millimetres, a policy of half of one"
    assert settled[1][3:5] == settled[2][3:5]


@pytest.mark.slow
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
    gained = [float(row[6].split()[0]) for row in felt[1:-1]]
    more = [float(row[4].split()[0]) for row in felt[1:-1]]
    assert more == pytest.approx([float(row[1]) - float(felt[0][1]) for row in felt[1:-1]], abs=0.02)
    assert gained == pytest.approx([errors[0] - own for own in errors[1:]], abs=0.02), "one rig: its mean is the median"


@pytest.mark.slow
def test_other_laws_and_policies_run_in_the_same_worlds(monkeypatch, capsys):
    settled, _ = rows_of(
        told(
            monkeypatch, capsys, *("--policy", "circle_honest_student", "--beside", "backstepping", "circle_honest_student"),
            *("--episodes", "8", "--rigs", "1", "--seed", "86000"),
        ).out
    )  # fmt: skip
    seeds = [f"seed_{k}" for k in range(5)]
    law, other = "backstepping-force-first", "backstepping"
    assert [row[0] for row in settled] == [
        *(law, *seeds, "all seeds", other, f"all seeds, less than {other}"),
        *(f"circle_honest_student {seed}" for seed in seeds), "all seeds, less than circle_honest_student",
    ]  # fmt: skip
    assert [row[1:3] for row in settled[1:6]] == [row[1:3] for row in settled[9:14]], "the same policies, the same worlds"
    assert float(settled[-1][4].split()[0]) == pytest.approx(0.0, abs=1e-9), "the mean over seeds of what differs from it"


@pytest.mark.slow
def test_without_a_force_sensor_no_law_that_reads_one_runs_beside(monkeypatch, capsys):
    with pytest.raises(SystemExit):
        told(
            monkeypatch, capsys, *("--policy", "circle_honest_student", "--beside", "admittance-adaptive"),
            *("--episodes", "1", "--rigs", "1"),
        )  # fmt: skip
    assert "force_sensor = False with law = 'admittance-adaptive'" in capsys.readouterr().err


def test_no_policy_is_one_line(monkeypatch, capsys, tmp_path):
    with pytest.raises(SystemExit):
        told(monkeypatch, capsys, "--policy", str(tmp_path))
    assert len(capsys.readouterr().err.strip().splitlines()) == 1
