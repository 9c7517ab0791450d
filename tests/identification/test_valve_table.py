"""Overlap and curvature of valves from measured tables, and tables that the form does not fit."""

import numpy as np
import pytest

from baselines.identification.valve_table import fit_valve_table
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from tests.console import call

OPENING = np.linspace(-1, 1, 41)


def flow(opening, overlap=0.08, curvature=0.3):
    """t (1 + c (1 - t)) by hand, of both edges; the exhaust has 0.8 of the conductance, and an overlap of 0.12."""
    t = np.clip((opening - overlap) / (1 - overlap), 0, None)
    back = np.clip((-opening - 0.12) / 0.88, 0, None)
    return t * (1 + curvature * (1 - t)) - 0.8 * back * (1 + curvature * (1 - back))


def written(path, opening, flows, head="opening,flow"):
    path.write_text("\n".join([head, *(f"{a:.6g},{b:.6g}" for a, b in zip(opening, flows, strict=True))]))
    return path


def test_both_edges_are_found_from_flows_in_any_unit_of_their_own(tmp_path):
    rng = np.random.default_rng(0)
    table = written(tmp_path / "valve.csv", OPENING, 88.0 * (flow(OPENING) + rng.normal(0, 0.002, 41)))
    found = fit_valve_table(table)
    rig = Parameters().replace(found.changes(Parameters()))
    valves = rig.valves
    assert (valves.supply_overlap, valves.exhaust_overlap) == pytest.approx((0.08, 0.12), abs=0.005)
    assert (valves.supply_curvature, valves.exhaust_curvature) == pytest.approx((0.3, 0.3), abs=0.02)
    assert valves.exhaust_ratio == pytest.approx(0.8, abs=0.01)
    assert max(found.supply.error, found.exhaust.error) < 0.01


def test_a_table_of_one_valve_changes_that_valve_alone(tmp_path):
    rig = Parameters().replace({"valves.supply_overlap": 0.1, "valves.exhaust_ratio": 0.9})
    found = fit_valve_table(written(tmp_path / "valve.csv", OPENING, flow(OPENING)))
    plant = Plant(rig.replace(found.changes(rig, "N2")))
    before, after = Plant(rig).lane_parameters[:, 0], plant.lane_parameters[:, 0]
    assert after[at.SUPPLY_OVERLAP_N2] == pytest.approx(0.08, abs=1e-4)
    assert after[at.EXHAUST_OVERLAP_N2] == pytest.approx(0.12, abs=1e-4)
    assert after[at.SUPPLY_OVERLAP_P1] == before[at.SUPPLY_OVERLAP_P1] == 0.1


def test_a_table_of_the_supply_serves_both_edges(tmp_path):
    half = np.linspace(0, 1, 21)
    found = fit_valve_table(written(tmp_path / "valve.csv", 100 * half, 100 * flow(half), "opening (%),flow (%)"))
    changes = found.changes(Parameters())
    assert changes["valves.exhaust_overlap"] == changes["valves.supply_overlap"] == pytest.approx(0.08, abs=1e-4)
    assert changes["valves.exhaust_ratio"] == 1.0


@pytest.mark.parametrize(
    ("opening", "flows", "said"),
    [
        (np.linspace(0, 1, 21), np.linspace(0, 1, 21) ** 0.5, "opening of.*allowed: 5 %"),
        (np.linspace(0, 0.5, 21), np.linspace(0, 1, 21), "0.5; allowed: 6 or more, up to 0.9"),
        (np.linspace(0, 1.4, 21), np.linspace(0, 1, 21), "allowed: finite numbers, openings from -1 to 1"),
        (np.zeros(9), np.zeros(9), "openings of 0 alone"),
    ],
    ids=["another form", "half a stroke", "volts", "a shut valve"],
)
def test_tables_that_cannot_serve_are_refused(tmp_path, opening, flows, said):
    with pytest.raises(ValueError, match=said):
        fit_valve_table(written(tmp_path / "valve.csv", opening, flows))


def test_the_command_writes_the_rig(tmp_path, monkeypatch, capsys):
    table, out = written(tmp_path / "valve.csv", OPENING, flow(OPENING)), tmp_path / "rig.toml"
    status, printed, _ = call("identify", monkeypatch, capsys, "--valve-table", str(table), "--out", str(out))
    assert (status, Parameters.from_toml(out).valves.supply_overlap) == (0, pytest.approx(0.08, abs=1e-4))
    assert "edge to the exhaust: overlap 0.120" in printed
    status, _, error = call("identify", monkeypatch, capsys, "--propose", "plan.csv", "--valve", "P1")
    assert status != 0
    assert "--valve-table only" in error
