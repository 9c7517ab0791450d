"""A log beside rigs: what a model is off, when it leaves the log, and which of several is nearest."""

import dataclasses
import math

import numpy as np
import pytest

import birthsim
from baselines.identification.comparing.compared import Candidate, Comparison, compare
from baselines.identification.comparing.free_run import first_beyond, followed, limits_of, rows_ahead
from baselines.identification.comparing.ranking import ranked
from baselines.identification.comparing.report import data_of, printed
from baselines.identification.comparing.signals import Signal, Track, error_of, pistons_of, scores_of, signals_of
from baselines.identification.experiment import propose
from baselines.identification.fit.budget import Budget
from baselines.identification.laboratory import run_plan
from baselines.identification.log.trial import Trial, fresh_rows
from baselines.identification.windows.windows import windows_at
from baselines.named import make_controller
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.linkage.geometry import inverse_geometry
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from tests.identification.trials import OWNER, TRUE, part, trial

HEAVY = TRUE.replace({"mechanics.mass": 1.2 * TRUE.mechanics.mass})
PRESSURES = ["pressures_P1", "pressures_N1", "pressures_P2", "pressures_N2"]


def beside(log: Trial, **rigs: Parameters) -> Comparison:
    return compare([Candidate(name, rig, log) for name, rig in rigs.items()])


@pytest.fixture(scope="module")
def ranked_rigs() -> Comparison:
    """The rig that made a log, one that is too heavy, and the first one again."""
    return beside(trial(), heavy=HEAVY, true=TRUE, again=TRUE)


def test_the_error_of_a_signal_is_what_a_hand_works_out() -> None:
    signal = Signal("pressures_P1", "Pa", noise=2.0, motion=10.0)
    measured = np.array([[5.0, 5.0, np.nan, 5.0], [5.0, np.nan, np.nan, 5.0]])
    error = np.array([[1.0, -3.0, 9.0, 2.0], [0.0, 7.0, 7.0, 4.0]])
    track = Track(signal, np.array([[0.0, 1.0, 2.0, 3.0], [4.0, 5.0, 6.0, 7.0]]), measured, error)
    found = error_of(track)
    assert found.rms == pytest.approx(6.0**0.5)  # 1 + 9 + 4 + 0 + 16 over 5 samples that were measured
    assert (found.largest, found.at) == (4.0, 7.0)
    assert found.share == pytest.approx(0.6**0.5 / 10.0**0.5)
    assert found.over_noise == pytest.approx(1.5**0.5)
    np.testing.assert_allclose(track.off, [(14 / 3) ** 0.5, 8**0.5])
    other = dataclasses.replace(track, signal=Signal("position_x", "m", 1.0, 1.0), error=0.0 * error)
    np.testing.assert_allclose(scores_of((track, other)), [14 / 3 / 4 / 2, 8 / 4 / 2])
    beyond, after = first_beyond(track, 2.5, np.array([0.0, 4.0]))
    np.testing.assert_array_equal(beyond, [1.0, 7.0])
    np.testing.assert_array_equal(after, [1.0, 3.0])
    assert np.isinf(first_beyond(track, 4.0, np.zeros(2))[0]).all()


def test_a_model_without_numbers_is_infinitely_wrong() -> None:
    signal = Signal("pressures_P1", "Pa", 2.0, 10.0)
    track = Track(signal, np.zeros((1, 2)), np.ones((1, 2)), np.array([[1.0, np.nan]]))
    assert math.isinf(error_of(track).rms)
    assert math.isinf(track.off[0])
    assert first_beyond(track, 5.0, np.zeros(1))[0][0] == 0.0


def test_the_rig_that_made_a_log_is_off_by_no_more_than_the_noise(ranked_rigs: Comparison) -> None:
    """14 numbers of a start state take as much of the noise from a window; what is left scatters by 1 / sqrt(2 N)."""
    true = ranked_rigs.rigs[1]
    for names, noise in ((PRESSURES, 500.0), (["position_x", "position_y"], 1e-4)):
        own = [track for track in true.tracks if track.signal.name in names]
        error = np.concatenate([track.error[np.isfinite(track.measured)] for track in own])
        left = 1.0 - 14.0 * len(true.starts) / error.size
        scatter = 4.0 / (2.0 * error.size) ** 0.5
        assert left**0.5 - scatter < np.sqrt(np.mean(error**2)) / noise < 1.0 + scatter
    # A free run drifts by what a start state is off, a thousandth of the motion in 3 s.
    assert min(leaving.after for leaving in true.free.leaves) > 2.5
    assert all(here.after[1] > 1.0 for here in true.ahead)
    assert not true.taken.full(TRUE)


def test_a_heavier_rig_is_worse_where_its_weight_is_seen(ranked_rigs: Comparison) -> None:
    heavy, true = ranked_rigs.rigs[:2]
    errors = {error.signal.name: error.over_noise for error in heavy.errors}
    assert max(errors, key=lambda name: errors[name]) == "position_y"  # along which it falls
    assert errors["position_y"] > 10.0
    leaves = {leaving.signal.name: leaving for leaving in heavy.free.leaves}
    assert leaves["position_y"].after < 0.25
    assert leaves["position_y"].limit == pytest.approx(1e-3, rel=0.2)  # 10 times 0.1 mm
    # It falls by half of what it is too heavy, on the air: the model is below the log, which is then more than the model. The
    # rig that made the log drifts too, by what its start state is off.
    falls, drifts = (
        np.nanmean(next(track.error for track in rig.free.tracks if track.signal.name == "position_y")) for rig in (heavy, true)
    )
    assert falls > 10.0 * abs(drifts)
    # What sensors may add is bounded by the file, so that no weight hides in cells.
    assert np.abs(heavy.taken.biases).max() <= 2.0 * HEAVY.electronics.pressure_bias * (1 + 1e-9)
    assert heavy.taken.distortion <= 2.0 * HEAVY.electronics.position_distortion * (1 + 1e-9)
    assert any("pressure_bias" in line for line in heavy.taken.full(HEAVY))


def test_rigs_are_ranked_and_equal_ones_are_told_as_equal(ranked_rigs: Comparison) -> None:
    first, second, last = ranked_rigs.places
    assert ({first.name, second.name}, last.name) == ({"true", "again"}, "heavy")
    assert (second.more, second.low, second.high, second.is_worse) == (0.0, 0.0, 0.0, False)
    assert last.is_worse
    assert 0.0 < last.low < last.more < last.high
    said = printed(ranked_rigs)
    assert "the log does not tell true and again apart" in said
    assert "true is nearer to the log than heavy" in said


def test_an_interval_holds_what_windows_scatter_by() -> None:
    """Two rigs of one error in 400 windows: against the standard error of their paired difference."""
    rng = np.random.default_rng(5)
    common, one, other = rng.chisquare(50, 400) / 50, rng.normal(0, 0.05, 400), rng.normal(0, 0.05, 400)
    first, second = ranked({"one": common + one, "other": common + other})
    assert not second.is_worse
    expected = np.std(one - other) / 400**0.5 / 2.0  # of roots of numbers about 1
    assert (second.high - second.low) / 2.0 == pytest.approx(1.96 * expected, rel=0.1)
    assert ranked({"one": common, "other": common + 0.1 + other})[1].is_worse
    assert first.more == 0.0


RESTED = OWNER.replace({"electronics.position_latency": 0.0})


def made(openings: np.ndarray, rig: Parameters, sensors: bool = True) -> tuple[Trial, np.ndarray]:
    """The log of a plant that openings (4, T) move from rest, with the noise of sensors or without, and its states (18, T)."""
    plant, period, rng = Plant(rig, 1), 1e-3, np.random.default_rng(3)
    states, places = [], []
    for opening in openings.T:
        states.append(plant.state[:, 0].copy())
        places.append(plant.end_effector()[:2, 0])
        plant.advance(opening[:, None], np.zeros((2, 1)), period)
    states, count = np.transpose(states), openings.shape[1]
    noise = rng.normal(size=(6, count)) * sensors
    pressures = states[list(at.PRESSURES)] + 500.0 * noise[:4]
    positions = np.transpose(places) + 1e-4 * noise[4:]
    return Trial(period * np.arange(count), openings, pressures, positions, np.zeros((2, count))), states


def steps(count: int, seed: int) -> np.ndarray:
    """Openings of four valves (4, count) that step every 40 ms, small enough for the pistons to stay away from the stops."""
    return np.repeat(np.random.default_rng(seed).uniform(-0.2, 0.2, (4, count // 40)), 40, axis=1)


def test_a_free_run_of_the_exact_rig_is_the_plants_own_trajectory() -> None:
    log, states = made(steps(1000, 1), RESTED, sensors=False)
    first = np.array([0], dtype=np.intp)
    fresh = fresh_rows(log.positions)
    windows = windows_at(log, RESTED, first, 999, fresh, states[:, first], Budget.of(log))
    for track in followed(windows, RESTED, signals_of(log, RESTED)):
        assert np.isfinite(track.measured).sum() > 900
        assert np.nanmax(np.abs(track.error)) <= 1e-9 * (
            np.nanmax(np.abs(track.measured)) if track.signal.unit == "Pa" else 1.0
        )
    # And another rig leaves it, so that the comparison can fail.
    other = RESTED.replace({"mechanics.mass": 1.001 * RESTED.mechanics.mass})
    error = followed(windows, other, signals_of(log, RESTED))[5].error
    assert np.nanmax(np.abs(error)) > 1e-6


def test_another_valve_is_found_in_its_chamber_once_it_opens() -> None:
    openings = np.zeros((4, 2400))
    openings[2, 1200:] = 0.25 * np.sin(2 * np.pi * 4.0 * 1e-3 * np.arange(1200))
    log, _ = made(openings, RESTED)
    wider = RESTED.replace({"valve_p2.supply_conductance": 0.3, "valve_p2.exhaust_conductance": 0.3})
    found = beside(log, wider=wider, true=RESTED)
    wide = found.rigs[0]
    before = wide.starts + found.window <= 1.2
    shut = {track.signal.name: track.off / track.signal.noise for track in wide.tracks}
    for name, sizes in shut.items():
        assert sizes[before].max() < 1.3, name
    assert max(shut, key=lambda name: shut[name][~before].max()) == "pressures_P2"
    assert [place.name for place in found.places] == ["true", "wider"]
    assert found.places[1].is_worse
    assert wide.worst[0].start >= 1.2 - found.window
    assert wide.worst[0].signal.name == "pressures_P2"
    left = {leaving.signal.name: leaving.at for leaving in wide.free.leaves}
    assert min(left, key=lambda name: left[name]) == "pressures_P2"
    assert left["pressures_P2"] > 1.2
    # What the rig does there: before, all valves are shut.
    does = {part.what: part for part in wide.doings}
    assert does["valves shut"].count == before.sum()
    assert does["valves shut"].pressures < 1.1 < 2.0 < does["all"].pressures
    assert "valves shut" not in wide.worst[0].does


RAIL = Parameters().replace({"linkage.kind": "rail", "linkage.inclination": math.radians(30.0)})
OTHER_RAIL = RAIL.replace({"cylinder2.coulomb_friction": 18.0})


def test_a_rail_is_judged_by_its_only_cylinder() -> None:
    plan = propose(RAIL, duration=4.0)
    log = run_plan(plan, [OTHER_RAIL], make_controller("backstepping", RAIL), "encoders", 0)[0]
    found = beside(log, file=RAIL, true=OTHER_RAIL)
    assert [signal.name for signal in found.signals] == ["pressures_P", "pressures_N", "position"]
    assert [place.name for place in found.places] == ["true", "file"]
    assert found.places[1].is_worse
    true = {error.signal.name: error for error in found.rigs[1].errors}
    assert true["position"].over_noise < 1.1
    assert true["pressures_P"].rms == pytest.approx(500.0, rel=0.1)
    assert found.signals[2].motion == pytest.approx(np.std(np.hypot(*log.positions)), rel=0.01)
    file, own = (min(leaving.after for leaving in one.free.leaves) for one in found.rigs)
    assert file < 0.3 < own


def test_encoders_are_judged_by_what_they_count() -> None:
    log = part(trial("encoders"), 0, 2200)
    log = dataclasses.replace(log, counted=np.full(2, TRUE.electronics.encoder_offset))
    found = beside(log, true=TRUE, heavy=HEAVY)
    assert [signal.name for signal in found.signals] == [*PRESSURES, "piston_y1", "piston_y2"]
    assert all(error.over_noise < 1.15 for error in found.rigs[0].errors)
    assert found.places[0].name == "true"
    np.testing.assert_allclose(pistons_of(log.positions.T, TRUE).T, inverse_geometry(log.positions, TRUE), atol=1e-12)


def test_what_was_not_measured_is_left_out_and_a_gap_ends_a_free_run() -> None:
    log = part(trial(), 0, 3000)
    pressures, unknown = log.pressures.copy(), np.zeros(3000, dtype=np.bool_)
    pressures[1, 300:340] = np.nan
    unknown[1900:1940] = True
    log = dataclasses.replace(log, pressures=pressures, unknown=unknown)
    (found,) = beside(log, true=TRUE).rigs
    assert all(error.over_noise < 1.1 for error in found.errors)
    assert np.isnan(found.tracks[1].measured).sum() == 40
    assert found.free.at_gap
    assert found.free.end == pytest.approx(log.times[1900])
    assert not [start for start in found.starts if log.times[1900] - 0.25 < start < log.times[1940]]
    np.testing.assert_array_equal(rows_ahead(log)[[0, 1899, 1900, 1940, 2999]], [1900, 1, 0, 1059, 0])
    early = np.zeros(3000, dtype=np.bool_)
    early[500:540] = True
    (found,) = beside(dataclasses.replace(log, unknown=early), true=TRUE).rigs
    assert found.free.start > log.times[540]  # the longer stretch
    assert found.free.end == log.times[2999]
    assert not found.free.at_gap


def test_limits_are_multiples_of_the_noise_or_what_is_asked() -> None:
    signals = (Signal("pressures_P1", "Pa", 500.0, 1.0), Signal("position_x", "m", 1e-4, 1.0))
    assert limits_of(signals, 10.0) == {"pressures_P1": 5000.0, "position_x": pytest.approx(1e-3)}
    assert limits_of(signals, 4.0, pressure=2e4) == {"pressures_P1": 2e4, "position_x": pytest.approx(4e-4)}
    assert limits_of(signals, 4.0, position=0.01)["position_x"] == 0.01


def test_every_figure_of_the_tables_is_in_the_data(ranked_rigs: Comparison) -> None:
    data = data_of(ranked_rigs, "log.csv")
    heavy = data["rigs"][0]
    assert heavy["windows"]["errors"][5]["rms"] == ranked_rigs.rigs[0].errors[5].rms
    assert heavy["free_run"]["leaves"][5]["signal"] == "position_y"
    assert data["ranking"][2]["name"] == "heavy"
    assert len(heavy["free_run"]["curves"]["pressures_P1"]["time"]) <= 1000
    assert birthsim.Parameters.from_dict(heavy["parameters"]) == HEAVY


@pytest.mark.parametrize(
    ("rig", "named"),
    [(RAIL, "linkage.kind"), (OWNER.replace({"mechanics.mode_frequency": 20.0}), "mechanics.mode_frequency")],
)
def test_rigs_that_cannot_be_beside_the_log_are_refused(rig: Parameters, named: str) -> None:
    with pytest.raises(ValueError, match=f"{named} = .*; allowed"):
        beside(part(trial(), 0, 2100), true=TRUE, other=rig)


@pytest.mark.parametrize("more", [{"chambers.tube_length": 1.0}, {"valves.hysteresis": 0.03}])
def test_what_a_rig_has_besides_is_played_too(more: dict[str, float]) -> None:
    rig = OWNER.replace(more)
    log = part(run_plan(propose(OWNER, 4.0, 3), [rig], make_controller("backstepping", OWNER), "lab", 11)[0], 0, 2500)
    found = beside(log, without=OWNER, true=rig)
    assert [place.name for place in found.places] == ["true", "without"]
    assert found.places[1].is_worse
    assert found.places[0].error < 1.0
    without, true = (min(leaving.after for leaving in one.free.leaves) for one in found.rigs)
    assert without < 0.5 < true
