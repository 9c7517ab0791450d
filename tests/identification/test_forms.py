"""What is identified of a rig that has more than the default one, and what is said of forms that the model lacks."""

from pathlib import Path

import numpy as np
import pytest

from baselines.identification.experiment import ASKED, PNEUMATIC, SOFT, STIFF, propose, read_plan
from baselines.identification.fit.free_parameters import FREE_PARAMETERS, coordinates, free_of, rig_at, shown_by
from baselines.identification.identified import identify
from baselines.identification.laboratory import run_plan
from baselines.identification.log.log_columns import PISTONS, POSITIONS
from baselines.identification.log.log_file import read_trial, write_trial
from baselines.identification.log.trial import ENCODERS, TRACKER
from baselines.identification.windows.encoders import slopes_of, zeros_by_tracker
from baselines.identification.windows.prediction import predict
from baselines.identification.windows.windows import ENDS, SUPPLY, admitted_openings, cut, spools_at
from baselines.named import make_controller
from birthsim_env.physics import options
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import parameter_column
from birthsim_env.physics.linkage.geometry import end_effector, inverse_geometry
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import value_of
from tests.identification.trials import OWNER, TRUE, trial

TUBES = {"chambers.tube_length": 1.5, "chambers.pressure_cells": "valve"}


def test_what_the_owner_has_is_asked_and_the_rest_may_be_shown() -> None:
    names = {one.name for one in free_of(OWNER)}
    assert names == {one.name for one in FREE_PARAMETERS}
    assert {"cylinder1.pressure_friction", "cylinder2.pressure_friction", TRACKER} < names
    may = {one.name for one in shown_by(OWNER)}
    assert {"cylinder1.direction_asymmetry", "valves.hysteresis", "valves.exhaust_ratio"} <= may
    assert not may & {"chambers.tube_length", "chambers.tube_diameter"}, "a log of a rig without tubes says nothing of them"
    asked = OWNER.replace({**TUBES, "cylinder1.direction_asymmetry": 0.1})
    more = {one.name for one in free_of(asked)} - names
    assert more == {"chambers.tube_length", "chambers.tube_diameter", "cylinder1.direction_asymmetry"}
    assert ENCODERS in {one.name for one in free_of(OWNER, ENCODERS)}
    assert TRACKER not in {one.name for one in free_of(OWNER, ENCODERS)}


def test_a_search_keeps_to_rigs_that_a_step_can_follow() -> None:
    theta = coordinates(OWNER, FREE_PARAMETERS)
    names = [one.name for one in FREE_PARAMETERS]
    for name, step in (("valves.sonic_conductance", 1.6), ("valves.critical_ratio", 1.0), ("chambers.dead_volume", -0.69)):
        theta[names.index(name)] += step
    rig = rig_at(OWNER, FREE_PARAMETERS, theta)
    assert rig.valves.sonic_conductance == pytest.approx(OWNER.valves.sonic_conductance * np.exp(1.6))
    assert rig.chambers.dead_volume > 5e-6


def test_the_plan_asks_for_soft_and_stiff_cylinders(tmp_path: Path) -> None:
    plan = propose(OWNER, 5.0, 0)
    assert plan.stiffness is not None
    share = plan.stiffness / np.transpose([PNEUMATIC])
    assert share.min() == pytest.approx(SOFT, rel=0.01)
    assert share.max() == pytest.approx(STIFF, rel=0.01)
    plan.write(tmp_path / "plan.csv")
    again = read_plan(tmp_path / "plan.csv", OWNER)
    np.testing.assert_allclose(again.asked(), plan.stiffness, rtol=1e-8)
    rows = [line.rsplit(",", len(ASKED))[0] for line in (tmp_path / "plan.csv").read_text().splitlines()]
    (tmp_path / "old.csv").write_text("\n".join(rows) + "\n")
    assert (read_plan(tmp_path / "old.csv", OWNER).asked() == np.transpose([PNEUMATIC])).all()


def test_play_and_limit_are_the_plants() -> None:
    rig, rows = OWNER.replace({"valves.hysteresis": 0.02, "valves.opening_limit": 0.8}), 300
    whole = trial()
    found = admitted_openings(whole, parameter_column(rig))
    plant = Plant(rig, 1)
    for k in range(rows):
        plant.advance(whole.openings[:, [k]], np.zeros((2, 1)), whole.period)
    # The play at the last row, as the plant's memory has it.
    assert np.allclose(np.clip(plant.memory[:4, 0], -0.8, 0.8), found[:, rows - 1], rtol=0, atol=1e-15)
    assert np.abs(found - whole.openings)[:, :rows].max() > 0.009


@pytest.mark.parametrize(
    "changes", [TUBES, {"air.supply_conductance": 8e-9}, {"friction.law": "gms"}], ids=lambda one: next(iter(one))
)
def test_a_window_of_a_rig_with_options_is_the_plant_alone(changes: dict[str, object]) -> None:
    rig, whole = TRUE.replace(changes), trial()
    windows = cut(whole, rig, 0.05).some(np.array([10]))
    states = windows.state[:, None].copy()
    if "air.supply_conductance" in changes:
        states[SUPPLY] = 6.6e5
    states[list(ENDS)] += 1e4
    pressures, _, _ = predict(windows, [rig], states)
    plant, first = Plant(rig, 1), int(windows.starts[0])
    begun = states[: at.STATES, 0, 0].copy()
    begun[list(at.SPOOLS)] = spools_at(whole.openings, whole.period, windows.starts, 1.0 / rig.valves.time_constant)[:, 0]
    plant.state = begun[:, None]
    further = plant.memory[4:]
    if "air.supply_conductance" in changes:
        further[options.RESERVOIR] = 6.6e5
        plant.lane_parameters[at.SUPPLY], plant.lane_parameters[at.INVERSE_SUPPLY] = 6.6e5, 1.0 / 6.6e5
    if changes is TUBES:
        further[options.TUBES : options.FLOWS, 0] = states[list(ENDS), 0, 0]
        flows = np.empty((8, 1))
        options.mass_flows(plant.state, further, plant.lane_parameters, flows)
        further[options.FLOWS : options.BRISTLES] = flows[:4] - flows[4:]
    rows = list(at.PRESSURES)
    for k in range(windows.length):
        seen = further[options.TUBES : options.FLOWS, 0] if changes is TUBES else plant.state[rows, 0]
        assert np.allclose(pressures[0, 0, k], seen, rtol=1e-12)
        plant.advance(whole.openings[:, [first + k]], np.zeros((2, 1)), whole.period)


def test_the_end_follows_the_pistons() -> None:
    pistons = np.array([[0.02, -0.03], [0.05, 0.01]])
    places = end_effector(pistons, OWNER)
    moved = end_effector(pistons + np.array([[1e-4], [-2e-4]]), OWNER) - places
    found = slopes_of(places.T, OWNER) @ np.array([1e-4, -2e-4])
    np.testing.assert_allclose(found.T, moved, atol=2e-7)
    assert (slopes_of(np.zeros((1, 2)), OWNER) == 0).all(), "where nothing was measured"


def test_a_tracker_tells_the_zeros_of_encoders() -> None:
    rng, whole, off = np.random.default_rng(3), trial("ideal"), np.array([8e-5, -1.2e-4])
    pistons = inverse_geometry(whole.positions, OWNER)
    shown = np.repeat(whole.positions[:, ::4], 4, axis=1)[:, : len(whole.times)]
    late = np.concatenate([np.repeat(shown[:, :1], 7, axis=1), shown[:, :-7]], axis=1)
    noise = np.repeat(1e-4 * rng.normal(size=(2, len(whole.times) // 4 + 1)), 4, axis=1)[:, : len(whole.times)]
    board = OWNER.replace({"electronics.position_distortion": 1e-4})
    found = zeros_by_tracker(whole.times, pistons + off[:, None], late + noise, board)
    assert found.latency == pytest.approx(0.007, abs=1.1e-3)
    assert (found.deviation < 3e-5).all(), "some thousand samples of 0.1 mm"
    assert (np.abs(found.offset - off) < 4 * found.deviation).all()
    assert "0.08" in found.words() or "0.07" in found.words()


def test_logs_of_encoders_and_of_both_come_back(tmp_path: Path) -> None:
    made = run_plan(propose(OWNER, 4.0, 3), [TRUE], make_controller("backstepping", OWNER), "encoders", 11)[0]
    assert made.counted is not None
    write_trial(made, tmp_path / "log.csv", OWNER)
    head = (tmp_path / "log.csv").read_text().splitlines()[0]
    assert all(name in head for name in PISTONS)
    assert not any(name in head for name in POSITIONS)
    again = read_trial(tmp_path / "log.csv", OWNER)
    np.testing.assert_allclose(again.positions, made.positions, atol=1e-9)
    np.testing.assert_allclose(again.counted, OWNER.electronics.encoder_offset)
    rows = np.loadtxt(tmp_path / "log.csv", delimiter=",", skiprows=1)
    tracked = np.hstack([rows, made.positions.T + 1e-4 * np.random.default_rng(0).normal(size=(len(rows), 2))])
    np.savetxt(tmp_path / "both.csv", tracked, delimiter=",", header=f"{head},{','.join(POSITIONS)}", comments="")
    both = read_trial(tmp_path / "both.csv", OWNER)
    assert both.counted is not None
    assert (both.counted < OWNER.electronics.encoder_offset).all()
    assert any(note.startswith("by the tracker") for note in both.notes)


@pytest.mark.slow
@pytest.mark.weekly
def test_friction_by_pressure_and_direction_is_found_from_five_seconds() -> None:
    true = {"cylinder1.pressure_friction": 9e-6, "cylinder2.pressure_friction": 2.5e-6, "cylinder1.direction_asymmetry": 0.12}
    rig = TRUE.replace(true)
    log = run_plan(propose(OWNER, 5.0, 0), [rig], make_controller("backstepping", OWNER), "lab", 5)[0]
    found = identify(log, OWNER, 0)
    rows = {row.name: row for row in found.rows}
    for name, value in true.items():
        assert rows[name].determined, name
        # An interval of 95 %, half as wide again: one of three is outside 95 % in a seventh of all logs.
        reach = 0.75 * (rows[name].high - rows[name].low)
        assert abs(rows[name].value - value) < reach, name
    assert rows["cylinder1.coulomb_friction"].value == pytest.approx(TRUE.cylinder1.coulomb_friction, rel=0.05)
    assert value_of(found.rig, "cylinder1.direction_asymmetry") == rows["cylinder1.direction_asymmetry"].value


@pytest.mark.slow
def test_encoders_tell_friction_and_their_zeros() -> None:
    log = run_plan(propose(OWNER, 4.0, 3), [TRUE], make_controller("backstepping", OWNER), "encoders", 11)[0]
    found = identify(log, OWNER, 0)
    rows = {row.name: row for row in found.rows}
    assert rows["cylinder1.coulomb_friction"].value == pytest.approx(TRUE.cylinder1.coulomb_friction, rel=0.01)
    assert len([line for line in found.words() if line.startswith("the encoder of cylinder")]) == 2
    off, deviation = found.zeros
    assert (deviation < OWNER.electronics.encoder_offset).all()
    assert (np.abs(off) < OWNER.electronics.encoder_offset + 4 * deviation).all()
    assert not [line for line in found.words() if "more than noise" in line]


@pytest.mark.slow
@pytest.mark.weekly
def test_a_supply_line_is_named() -> None:
    rig = TRUE.replace({"air.supply_conductance": 6e-9})
    log = run_plan(propose(OWNER, 5.0, 0), [rig], make_controller("backstepping", OWNER), "lab", 5)[0]
    assert [line for line in identify(log, OWNER, 0).words() if "the supply's pressure varies" in line]
