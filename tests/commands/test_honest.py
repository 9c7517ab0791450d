"""``studies.honest.command``: a row per law and kind of sensors, a column per hand."""

from __future__ import annotations

import sys

import numpy as np

from baselines.bench.evaluation import Evaluation
from baselines.bench.metrics import UNITS
from studies.comparison.grid import MOVING
from studies.honest import command as honest


def test_moving_hands_have_columns_of_their_own(monkeypatch, tmp_path):
    asked = []

    def quick(environment, law, name, episodes, seed, **setting):
        asked.append((environment, setting["user_force"]))
        value = 1.0 + MOVING.index(setting["user_force"]) if setting["user_force"] else 9.0
        return Evaluation(name, [seed], {metric: [value] for metric in UNITS}, [False])

    floor = {"stiffness_error": np.ones(1), "held_error": np.ones(1)}
    monkeypatch.setattr(honest, "evaluate", quick)
    monkeypatch.setattr(honest, "probe_floor", lambda *_: floor)
    monkeypatch.setattr(sys, "argv", ["honest", "--controller", "backstepping", "--episodes", "1", "--out", str(tmp_path)])
    honest.main()
    assert asked[:5] == [("BirthSIM/Probe-v2", None), *(("BirthSIM/Circle-v1", hand) for hand in (None, *MOVING))]
    table = [line.split("|")[1:-1] for line in (tmp_path / "honest.md").read_text().splitlines() if line.startswith("|")]
    assert {len(row) for row in table} == {7 + len(MOVING)}
    found = dict(zip((cell.strip() for cell in table[0]), table[2], strict=True))
    assert [float(found[f"Circle, {hand} hand"].split(",")[0]) for hand in MOVING] == [1.0, 2.0, 3.0]
