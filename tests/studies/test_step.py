"""The study of steps: what it makes of its pieces, and that a piece has the step that it asks for."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from birthsim_env.physics.step import DEFAULT, METHOD
from lab.studies.accuracy.errors import LAWS
from lab.studies.step import pieces, study, tables

PLACE = "BirthSIM/Circle-v1 ideal"


def course(off):
    """Two rigs at two marks, the first ``off`` m and Pa away, the second at its stop."""
    position, pressure = np.zeros((2, 2, 2)), np.ones((2, 4, 2))
    position[1, 0], pressure[1, 2] = [off, 1.0], [1 + off, 3.0]
    return {"strong": {"position": position.tolist(), "pressure": pressure.tolist(), "clear": [True, False]}}


def loops(values, lost=(False,) * 4):
    return {PLACE: {"metrics": {"settled_rms": values, "unrest": [None] * 4}, "lost": list(lost)}}


@pytest.fixture
def found():
    return {
        **{(where, "courses", law): course(off) for law in LAWS for where, off in zip(OFF, OFF.values(), strict=True)},
        **{
            (method, "seconds", turn): {"64": (turn + 2) * cost}
            for method, cost in COSTS.items()
            for turn in range(study.TURNS)
        },
        ("rk4", "loops", "pid"): loops([1.0, 2.0, 3.0, 9.0]),
        ("rk3", "loops", "pid"): loops([1.1, 2.2, 3.3, 9.0], (False, False, False, True)),
    }


OFF = {study.EXACT: 0.0, ("rk4", 0.25e-3): 1e-7, ("rk3", 0.25e-3): 2e-7, study.MEASURED[2]: 4e-7}
COSTS = {"rk4": 8e-6, "rk3": 4e-6}


def test_differences_are_paired_and_leave_out_lost_worlds_and_rigs_at_their_stops(found):
    kept = study._kept(SimpleNamespace(beside=("rk3",)), found)
    (row,) = kept["loops"]
    assert (row["controller"], row["metric"], row["step"], row["worlds"], row["lost"]) == (
        "pid",
        "settled_rms",
        "rk3",
        3,
        [0, 1],
    )
    assert [row[name] for name in ("mean", "scatter", "difference", "spread")] == pytest.approx([2.0, 1.0, 0.2, 0.1])
    assert tables.relative(row) == pytest.approx(0.2)
    assert tables.is_biased(row)
    assert not tables.is_biased({**row, "spread": 0.2})
    largest = [one["position_m"][1] for one in kept["courses"]["lugre"]["strong"]["rows"]]
    assert largest == pytest.approx([1e-7, 2e-7, 4e-7])
    assert kept["courses"]["lugre"]["strong"]["rigs"] == 1


def test_tables_have_every_law_step_and_controller(found):
    text = tables.tables(study._kept(SimpleNamespace(beside=("rk3",)), found))
    for law in LAWS:
        assert f"| {law} | strong, 1 rigs | rk3 | 0.333 | 0.4 | 0.4 |" in text
    assert "| rk4 | 16 | 1.00 |\n| rk3 | 8 | 0.50 |" in text
    assert "| pid | 1 | 0 | 1 | 0.2 | 0.2 | 0 and 1 |" in text


def test_a_piece_of_this_process_is_measured_here_and_another_elsewhere(monkeypatch):
    asked = []
    monkeypatch.setattr(pieces, "_elsewhere", lambda method, function, settings: asked.append((method, function)) or {})
    monkeypatch.setattr(pieces, "RUNS", 1)
    assert set(pieces.seconds(METHOD, 0)) == set(map(str, pieces.LANES))
    assert pieces.seconds("rk3" if METHOD == DEFAULT else DEFAULT, 0) == {}
    assert asked == [("rk3" if METHOD == DEFAULT else DEFAULT, "seconds")]


def test_another_process_has_the_step_that_is_asked_for(monkeypatch):
    def ran(line, input, env, **_):
        assert "import courses" in line[-1]
        return SimpleNamespace(stdout=json.dumps([env["BIRTHSIM_STEP"], json.loads(input)]))

    monkeypatch.setattr(pieces.subprocess, "run", ran)
    other, settings = "rk3" if METHOD == DEFAULT else DEFAULT, {"step": 1e-3, "law": "lugre", "rigs": 1, "seed": 0}
    assert pieces.courses(other, **settings) == [other, {"method": other, **settings}]
