"""Estimates: exact without noise, with derivatives that are those of the cost, within their intervals with noise."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from baselines.identification.experiment import propose
from baselines.identification.fit import problem as problems
from baselines.identification.fit.certainty import certainty_of
from baselines.identification.fit.estimate import fit, refine, search
from baselines.identification.fit.free_parameters import (
    FREE_PARAMETERS,
    INSIDE,
    LATENCY,
    FreeParameter,
    coordinates,
    limits,
    rig_at,
)
from baselines.identification.fit.problem import Problem
from baselines.identification.identified import Identified, identify
from baselines.identification.laboratory import run_plan
from baselines.identification.log.trial import Trial
from baselines.identification.windows import starts
from baselines.identification.windows.noise import guessed_noise
from baselines.identification.windows.starts import Noise
from baselines.identification.windows.windows import cut
from baselines.named import make_controller
from birthsim_env.physics.rig.parameters import DECLARED, Parameters, value_of
from birthsim_env.physics.rig.servovalves import LINEAR, MPYE_5_M5
from tests.identification.trials import OWNER, TRUE, part, trial

SOME = tuple(
    one
    for one in FREE_PARAMETERS
    if one.name in ("cylinder1.coulomb_friction", "mechanics.mass", "valves.sonic_conductance", "valves.time_constant")
)
KNOWN = TRUE.replace({one.name: value_of(OWNER, one.name) for one in SOME} | {LATENCY: 0.0})
"""What the owner of ``TRUE`` knows where only ``SOME`` is unknown and positions are shown at once."""


@pytest.mark.slow
def test_without_noise_the_rig_comes_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of neighbouring windows, as in ``refine``: a bristle that a guess bends the wrong way is then found from the one before.
    Of six windows far apart one stayed so on some processors, and took the rest along."""
    monkeypatch.setattr(starts, "CLOSE", 1e-3)
    windows = cut(part(trial("ideal"), 0, 2500), KNOWN, 0.1).some(np.arange(3, 21))
    asked = Problem(windows, Noise(10.0, 1e-5), KNOWN, SOME, lambda: None)
    first = search(asked, coordinates(KNOWN, SOME), 40)
    asked.begin_anew(first.rig, asked.offsets.sizes)
    found = search(asked, first.theta, 40)
    # The search ends at steps of 1e-4; what the owner's spread pulls is far less.
    assert np.abs(found.theta - coordinates(TRUE, SOME)).max() < 2e-4
    assert found.noise.pressure < 2.0
    assert found.noise.position < 2e-6


def problem(noise: Noise | None = None) -> Problem:
    windows = cut(part(trial(), 0, 2000), OWNER, 0.1).some(np.array([3, 9, 14]))
    return Problem(windows, noise or guessed_noise(trial()), OWNER, FREE_PARAMETERS, lambda: None)


def test_the_gradient_is_that_of_the_cost(monkeypatch: pytest.MonkeyPatch) -> None:
    """J'r against central differences of the cost, whose start states and offsets are sought anew at every place.

    The place is near the rig of the log: where residuals are some times the noise start states do not settle (with linear
    valves 5 to 24 standard deviations are left), and such a cost has jumps. The latency is between two rows: straight
    lines between positions have a corner at each.
    """
    monkeypatch.setattr(starts, "CLOSE", 1e-5)
    monkeypatch.setattr(problems, "STILL", 1e-5)
    asked, theta = problem(), coordinates(TRUE.replace({LATENCY: 0.0063}), FREE_PARAMETERS)
    asked.jacobian(theta)  # whose slopes are those of where the start states end
    asked.residuals(theta + 1e-9)
    gradient = asked.jacobian(theta).T @ asked.residuals(theta)
    size = np.linalg.norm(asked.jacobian(theta), axis=0)
    for k in range(len(theta)):
        step = 1e-3 / max(size[k], 1.0)
        sides = [0.5 * np.sum(asked.residuals(theta + sign * step * np.eye(len(theta))[k]) ** 2) for sign in (1.0, -1.0)]
        central = (sides[0] - sides[1]) / (2 * step)
        # In standard deviations of this coordinate; differences leave up to 2e-4.
        assert abs(gradient[k] - central) / size[k] < 1e-3, FREE_PARAMETERS[k].name


@pytest.mark.parametrize("one", FREE_PARAMETERS, ids=lambda one: one.name)
def test_coordinates_go_there_and_back(one: FreeParameter) -> None:
    value = value_of(TRUE, one.name)
    assert one.prior.value(one.prior.coordinate(value)) == pytest.approx(value, rel=1e-12)
    low, high = limits(OWNER, (one,))
    for edge in (low, high):
        rig_at(OWNER, (one,), edge)
    known = value_of(OWNER, one.name)
    at_least = INSIDE if known == DECLARED[one.name].least else 0.0
    assert low[0] <= one.prior.coordinate(known) + at_least < high[0]


def test_the_noise_is_found_from_the_log_alone() -> None:
    found, board = guessed_noise(trial()), TRUE.electronics
    assert found.pressure == pytest.approx(board.pressure_noise, rel=0.1)
    assert found.position == pytest.approx(board.position_noise, rel=0.1)


def test_noise_that_grows_is_found_whatever_jumps() -> None:
    """Of noise from 0.05 to 0.4 mm on moving pistons; one sample in 500 jumps by 20 mm."""
    rng, still = np.random.default_rng(5), part(trial(), 0, 4000)
    sizes = np.geomspace(5e-5, 4e-4, 4000)
    jumps = 0.02 * (rng.random((2, 4000)) < 0.002)
    moved = 0.5 + 0.1 * np.sin(np.linspace(0.0, 9.0, 4000)) + sizes * rng.normal(size=(2, 4000)) + jumps
    found = guessed_noise(dataclasses.replace(still, positions=moved)).position
    assert found == pytest.approx(float(np.sqrt(np.mean(sizes**2))), rel=0.05)


def test_a_start_with_a_bristle_bent_the_wrong_way_is_mended() -> None:
    windows = cut(part(trial(), 0, 2500), TRUE)
    noise = guessed_noise(trial())
    wrong = dataclasses.replace(windows, state=windows.state.copy())
    free = np.zeros((len(windows.starts), len(windows.free)))
    fine = starts.begun_anew(windows, noise, TRUE, free)
    cost = np.sum(starts.predicted(windows, noise, [TRUE], fine[None])[0] ** 2, axis=1)
    rows = windows.length * 4 + 2 * windows.valid.sum(axis=1)
    # 1000 squares of standard normal numbers and more: their sum is within 15 % of their number.
    assert (np.abs(cost / rows - 1) < 0.15).all()
    wrong.state[list(starts.BRISTLES)] *= -1
    again = starts.begun_anew(wrong, noise, TRUE, free)
    mended = np.sum(starts.predicted(wrong, noise, [TRUE], again[None])[0] ** 2, axis=1)
    assert (np.abs(mended / rows - 1) < 0.15).all()


@pytest.mark.slow
def test_with_noise_the_rig_is_within_its_intervals() -> None:
    ticks: list[int] = []
    found = identify(trial(), OWNER, 0, tick=lambda: ticks.append(1))
    rows = {row.name: row for row in found.rows}
    late = rows.pop(LATENCY)
    assert abs(late.value - (TRUE.electronics.position_latency - 0.5e-3)) < 5e-4  # 6 ms is shown in the sixth row
    told = [row for row in rows.values() if row.determined]
    assert len(told) >= 12
    # Fifteen intervals of 95 %, and not a far miss.
    outside = [row.name for row in told if not row.low <= value_of(TRUE, row.name) <= row.high]
    assert len(outside) <= 2
    assert value_of(found.rig, "mechanics.mass") == pytest.approx(3.6, rel=5e-3)
    assert value_of(found.rig, "valves.time_constant") == pytest.approx(0.0055, rel=0.02)
    assert max(found.misfit) < 1.1
    assert len(ticks) > 5


def noisier(whole: Trial, pressure: float, position: float) -> Trial:
    """A trial with more noise, position samples held as before."""
    rng = np.random.default_rng(2)
    moved = np.any(np.diff(whole.positions, axis=1, prepend=np.nan) != 0, axis=0)
    sample = np.cumsum(moved) - 1
    shaken = whole.positions + position * rng.normal(size=(2, sample[-1] + 1))[:, sample]
    return dataclasses.replace(
        whole, pressures=whole.pressures + pressure * rng.normal(size=whole.pressures.shape), positions=shaken
    )


@pytest.fixture(scope="module")
def hidden() -> Identified:
    """Under noise eighty times that of a laboratory."""
    return identify(noisier(part(trial(), 500, 3000), 4e4, 1e-2), OWNER, 0)


@pytest.mark.slow
@pytest.mark.weekly
def test_where_noise_hides_friction_the_owners_law_is_kept(hidden: Identified) -> None:
    assert hidden.laws.chosen == "lugre"
    assert hidden.laws.rivals
    assert [line for line in hidden.words() if line.startswith("friction.law = lugre, KEPT: the log cannot tell ")]


@pytest.mark.slow
@pytest.mark.weekly
def test_what_the_log_cannot_tell_keeps_the_owners_value(hidden: Identified, tmp_path: Path) -> None:
    """No log tells then how a bristle is damped."""
    rows = {row.name: row for row in hidden.rows}
    kept = rows["friction.bristle_damping"]
    assert not kept.determined
    assert kept.value == OWNER.friction.bristle_damping == hidden.rig.friction.bristle_damping
    assert kept.low < kept.value < kept.high
    assert rows["valves.sonic_conductance"].determined
    hidden.write(tmp_path / "rig.toml", "shaken.csv")
    text = (tmp_path / "rig.toml").read_text()
    assert "# friction.bristle_damping = 150 N s/m, KEPT: the log cannot tell it, it may be " in text
    assert Parameters.from_toml(tmp_path / "rig.toml") == hidden.rig
    assert "least known: " in text


def test_fewer_parameters_are_fitted_anew_from_a_fit() -> None:
    """A fit of some parameters is the same from wherever it begins."""
    short = part(trial(), 0, 2200)
    owner = TRUE.replace({"mechanics.mass": 3.0, "valves.sonic_conductance": 3.9e-9})
    mass = tuple(one for one in FREE_PARAMETERS if one.name in ("mechanics.mass", "valves.sonic_conductance"))
    first = fit(short, owner, 0, mass)
    again = refine(short, first, owner, mass)
    deviation = certainty_of(first).deviation
    assert (np.abs(first.theta - again.theta) < 0.1 * deviation).all()
    assert (np.abs(first.theta - coordinates(TRUE, mass)) < 4 * deviation).all()


BELIEVED = OWNER.replace(LINEAR.changes())
"""A rig whose owner takes its valves for linear."""


def log_of(**more: float) -> Trial:
    """5 s of the proposed experiment on a rig with the catalogue's valves, under a law that believes in linear ones."""
    rig = TRUE.replace({name.replace("__", "."): value for name, value in more.items()})
    return run_plan(propose(OWNER, 5.0, 0), [rig], make_controller("backstepping", BELIEVED), "lab", 5)[0]


@pytest.mark.slow
def test_the_curve_of_the_valves_is_found_from_five_seconds() -> None:
    found = identify(log_of(), BELIEVED, 0)
    rows = {row.name: row for row in found.rows}
    for name, true in MPYE_5_M5.changes().items():
        assert rows[name].determined
        assert rows[name].value == pytest.approx(true, rel=0.01 if name.endswith("overlap") else 0.03)
    assert rows["mechanics.mass"].value == pytest.approx(TRUE.mechanics.mass, rel=0.01)
    assert not [line for line in found.words() if "fit worse" in line or "more than noise" in line]


@pytest.mark.slow
@pytest.mark.weekly
def test_a_valve_unlike_the_others_is_named() -> None:
    (line,) = [line for line in identify(log_of(valve_n2__supply_overlap=0.03), OWNER, 0).words() if "fit worse" in line]
    assert line.startswith("pressures_N2")
