"""The linear model against finite differences, the second model, formulas of stiffness, valve gains, and the plant's motion."""

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from birthsim_env import Parameters, Plant, balanced_pressures, linearize, linearize_lanes
from birthsim_env.gradients.linear.model import LinearModel
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage import geometry
from lab.studies.gradients.states import plant_of
from tests.console import call, strict
from tests.physics.rigs import OTHER, PRESSED

COULOMB = {"friction.law": "coulomb"}
DRY = {f"cylinder{k}.{name}_friction": 0.0 for k in (1, 2) for name in ("coulomb", "pressure")}
RIGS = {
    "default": {},
    "other": OTHER,
    "pressed": PRESSED,
    "elasto-plastic": {"friction.law": "elasto_plastic"},
    "Coulomb": COULOMB,
}
SCALES = np.array([*[0.1] * 4, *[1e-4] * 2, *[1e5, 300.0] * 4, *[1.0] * 8, 10.0, 10.0])
"""Size of each state, opening and force."""
STEP = np.finfo(float).eps ** (1 / 3)
"""Of central differences, relative to ``SCALES``: their truncation, its square, and rounding, eps over it, are both 4e-11."""
ALLOWED = 1e-8
"""Relative to the largest entry of a row: 4e-11 times the curvature of the steepest characteristics."""
MISSING = "python-control is not installed: pip install -e '.[control]'"


def pose_of(rig: Parameters, y1: float, y2: float) -> Array:
    return geometry.end_effector(np.array([y1, y2]), rig)


def differences(function, x: Array, scales: Array) -> Array:
    """Jacobian of a function of columns by central differences."""
    step = np.diag(STEP * scales)
    return (function(x[:, None] + step) - function(x[:, None] - step)) / (2 * STEP * scales)


def assert_same(found: Array, expected: Array, scales: Array, allowed: float = ALLOWED) -> None:
    size = (np.abs(expected) * scales).max(axis=1, keepdims=True)
    assert np.all(np.abs(found - expected) * scales <= allowed * size)


def plant_jacobian(rig: Parameters, model: LinearModel) -> Array:
    plant = Plant(rig, 24)
    point = np.concatenate([model.at.state, model.at.openings, model.at.force])
    return differences(lambda s: plant.derivatives(s[:18], s[18:22], s[22:]), point, SCALES)


@pytest.mark.parametrize("openings", [(0.0, 0.0, 0.0, 0.0), (0.2, -0.3, -0.15, 0.02)], ids=["shut", "open"])
@pytest.mark.parametrize("name", RIGS)
def test_a_stuck_model_is_the_plants_central_difference(name: str, openings: tuple[float, ...]) -> None:
    rig = Parameters().replace(RIGS[name])
    pose = pose_of(rig, 0.03, -0.07)
    pressures = balanced_pressures(rig, pose) + np.array([2e3, 0.0, -3e3, 0.0])
    model = linearize(rig, pose, pressures, openings=openings, force=(1.0, -2.0))
    kept = [at.STATE_NAMES.index(signal.name) for signal in model.states]
    assert len(kept) == (16 if name == "Coulomb" else 18)
    expected = plant_jacobian(rig, model)[kept]
    assert_same(np.hstack([model.A, model.B]), expected[:, [*kept, *range(18, 24)]], SCALES[[*kept, *range(18, 24)]])
    still = Plant(rig).derivatives(model.at.state[:, None], model.at.openings[:, None], model.at.force[:, None])[:, 0]
    np.testing.assert_allclose(model.at.rates, still, rtol=1e-12, atol=1e-12)
    if name != "Coulomb":
        np.testing.assert_allclose(model.at.rates[[at.V1, at.V2]], 0.0, atol=1e-12)
        assert np.all(np.abs(model.at.state[[at.Z1, at.Z2]]) > 1e-6)


def test_a_sliding_model_is_a_plant_without_dry_friction() -> None:
    rig = Parameters().replace(OTHER)
    model = linearize(rig, pose_of(rig, 0.03, -0.07), friction="sliding", openings=(0.2, -0.3, 0.0, 0.15))
    smooth = rig.replace({**COULOMB, **DRY})
    kept = [at.STATE_NAMES.index(signal.name) for signal in model.states]
    assert not {at.Z1, at.Z2} & set(kept)
    np.testing.assert_allclose(model.at.rates[[at.V1, at.V2]], 0.0, atol=1e-12)
    columns = [*kept, *range(18, 24)]
    assert_same(np.hstack([model.A, model.B]), plant_jacobian(smooth, model)[np.ix_(kept, columns)], SCALES[columns])


def test_outputs_are_the_jacobian_and_the_slope_of_9() -> None:
    rig = Parameters().replace(OTHER)
    piston = np.array([0.03, -0.07])
    model = linearize(rig, geometry.end_effector(piston, rig))
    jacobian = geometry.jacobian(piston, rig)
    np.testing.assert_allclose(model.C[:2, [at.Y1, at.Y2]], jacobian, rtol=1e-12)
    np.testing.assert_allclose(model.C[2:4, [at.V1, at.V2]], jacobian, rtol=1e-12)
    assert not model.D.any()

    def forces(s: Array) -> Array:
        rows = []
        for c, (y, pp, pn) in ((rig.cylinder1, (at.Y1, at.PP1, at.PN1)), (rig.cylinder2, (at.Y2, at.PP2, at.PN2))):
            a, b, half = s[pp] * c.area_p, s[pn] * c.area_n, c.stroke / 2
            rows += [a - b - rig.air.atmospheric_pressure * (c.area_p - c.area_n)]
            rows += [rig.air.polytropic_index * (a / (half + s[y]) + b / (half - s[y]))]
        return np.array(rows)[[0, 2, 1, 3]]

    assert_same(model.C[4:8], differences(forces, model.at.state, SCALES[:18]), SCALES[:18])
    np.testing.assert_allclose(model.at.outputs[4:8], forces(model.at.state), rtol=1e-12)
    np.testing.assert_array_equal(model.C[8:], np.eye(18)[list(at.PRESSURES)])


def test_along_a_trajectory_lanes_have_the_differences_of_their_plants() -> None:
    """Moving lanes on rigs drawn at random; 1 % of their rates may stand nearer to a kink than the difference is wide."""
    plant, opening, force = plant_of(64, 9)
    found = linearize_lanes(plant, opening, force)
    np.testing.assert_allclose(found.rates, plant.derivatives(plant.state, opening, force), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found.outputs[:4], plant.end_effector(), rtol=1e-12, atol=1e-14)
    point = np.concatenate([plant.state, opening, force])
    slopes = np.concatenate([found.A, found.B], axis=2)
    off = np.empty((24, 18, 64))
    for k, size in enumerate(STEP * SCALES):
        way = size * np.eye(24)[:, [k]]
        high, low = (plant.derivatives(s[:18], np.clip(s[18:22], -1, 1), s[22:]) for s in (point + way, point - way))
        off[k] = np.abs(slopes[:, :, k].T - (high - low) / (2 * size)) * SCALES[k]
    share = off / np.max(np.abs(slopes) * SCALES, axis=2).T
    inside = np.abs(opening).max(axis=0) < 0.99
    assert np.quantile(share[:, :, inside], 0.99) < ALLOWED


@pytest.mark.slow
def test_options_of_a_rig_have_their_states() -> None:
    """At rest the motion over 10 us is the matrix exponential of A, B; shut valves leak 1e-6 of a pressure meanwhile."""
    given = {"air.supply_conductance": 2e-8, "chambers.tube_length": 0.5, "mechanics.mode_frequency": 20.0}
    rig, hand = Parameters().replace(given), np.array([6.0, -4.0])
    model = linearize(rig, pose_of(rig, 0.03, -0.07), force=hand)
    assert len(model.states) == 31
    # The handle, the piston's end and its bristle carry the hand.
    np.testing.assert_allclose(model.at.rates[[at.V1, at.V2, 21, 22]], 0.0, atol=1e-9)
    sizes = np.concatenate([SCALES[:18], [1e5, 0.1, 0.1, 0.1, 0.1], np.full(4, 1e5), np.full(4, 1e-4), SCALES[18:]])
    step, duration = 1e-5 * sizes, 1e-5
    ways = np.concatenate([np.diag(step), -np.diag(step)], axis=1)
    plant = Plant(rig, ways.shape[1])
    plant.state = model.at.state[:18, None] + ways[:18]
    plant.memory[4:17] = model.at.state[18:31, None] + ways[18:31]
    plant.advance(ways[31:35], hand[:, None] + ways[35:], duration)
    reached = np.concatenate([plant.state, plant.memory[4:17]])
    found = (reached[:, :37] - reached[:, 37:]) / (2 * step)
    whole = np.zeros((37, 37))
    whole[:31] = np.hstack([model.A, model.B])
    expected = expm(duration * whole)[:31]
    still = np.eye(31, 37)
    assert_same((found - still) / duration, (expected - still) / duration, sizes, 1e-4)


def test_a_small_sine_moves_the_plant_as_the_frequency_response_says() -> None:
    """A hand of 0.05 N at 2 Hz on a rig without dry friction and leakage; the plant's answer over the last of 16 periods."""
    rig = Parameters().replace({**COULOMB, **DRY, "valves.leakage_ratio": 0.0})
    pose, frequency, periods, samples = pose_of(rig, 0.02, -0.05), 2.0, 16, 250
    model = linearize(rig, pose, friction="sliding")
    plant = Plant(rig)
    plant.state[:] = model.at.state[:, None]
    time = np.arange(periods * samples) / (frequency * samples)
    push = 0.05 * np.sin(2 * np.pi * frequency * time)
    path = []
    for now in push:
        path.append(plant.end_effector()[:2, 0])
        plant.advance(np.zeros((4, 1)), np.array([[now], [0.0]]), 1 / (frequency * samples))
    last = slice(-samples, None)
    # Each force is held for one sample: the first harmonic is late by half of one.
    late = time[last] - 0.5 / (frequency * samples)
    turn = np.exp(2j * np.pi * frequency * late)
    basis = np.stack([turn.imag, turn.real, np.ones(samples), late])
    sine, cosine, _, _ = np.linalg.lstsq(basis.T, np.array(path)[last], rcond=None)[0]
    found = (sine + 1j * cosine) / 0.05
    expected = model.frequency_response([frequency])[0, :2, 4]
    # The amplitude, 5e-5 m, over the length of a chamber, 0.1 m, is the size of what a linear model leaves out: 5e-4.
    assert np.all(np.abs(found - expected) < 2e-3 * np.abs(expected).max())


def test_edges_of_the_pressures_are_finite() -> None:
    rig = Parameters().replace({"cylinder1.coulomb_friction": 1e3, "cylinder2.coulomb_friction": 1e3})
    edges = [rig.air.atmospheric_pressure, rig.air.supply_pressure] * 2
    model = linearize(rig, pose_of(rig, 0.0, 0.0), edges)
    assert np.isfinite(model.A).all()
    assert_same(model.A, plant_jacobian(rig, model)[:, :18], SCALES[:18], 1e-4)


def test_names_units_and_arrays_belong_together_and_cannot_be_changed() -> None:
    model = linearize(None, (0.5, 0.0))
    assert model.A.shape == (len(model.states), len(model.states))
    assert model.B.shape == (len(model.states), len(model.inputs))
    assert model.C.shape == (len(model.outputs), len(model.states))
    assert model.D.shape == (len(model.outputs), len(model.inputs))
    assert model.states[0] == ("y1", "m")
    assert model.states[13] == ("Tn2", "K")
    assert [signal.unit for signal in model.inputs] == ["1"] * 4 + ["N"] * 2
    with pytest.raises(ValueError, match="read-only"):
        model.A[0, 0] = 1.0


def test_python_control_gives_the_same_response() -> None:
    control = pytest.importorskip("control", reason=MISSING)
    model = linearize(None, (0.5, 0.0), friction="sliding")
    space = model.to_control()
    assert isinstance(space, control.StateSpace)
    for labels, signals in (
        (space.state_labels, model.states),
        (space.input_labels, model.inputs),
        (space.output_labels, model.outputs),
    ):
        assert list(labels) == [signal.name for signal in signals]
    frequency = np.array([0.1, 1.0, 10.0])
    theirs = space(2j * np.pi * frequency).transpose(2, 0, 1)
    np.testing.assert_allclose(theirs, model.frequency_response(frequency), rtol=1e-6, atol=1e-12)


def test_without_python_control_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(ImportError, match=r"pip install -e .\.\[control\]."):
        linearize(None, (0.5, 0.0)).to_control()


@pytest.mark.slow
def test_the_study_finds_resonance_and_bandwidth(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A sliding rig's resonance is that of its slowest mode: damping moves the peak by zeta^2 < 1 %, the grid by 0.4 %."""
    status, printed, _ = call("responses", monkeypatch, capsys, "--jobs", "1", "--out", tmp_path)
    assert status == 0
    curves = strict(tmp_path / "responses.json")["figures"]
    assert [len(each) for each in curves.values()] == [4] * 4
    assert all(one["bandwidth"] > 0 for each in curves.values() for one in each)
    pose = (0.5, 0.0)
    model = linearize(None, pose, balanced_pressures(None, pose, (5200.0, 2700.0)), friction="sliding")
    modes = np.linalg.eigvals(model.A)
    slowest = min(abs(mode) for mode in modes if mode.imag > 5) / (2 * np.pi)
    (found,) = (one for one in curves["hand Fy to y"] if (one["friction"], one["stiffness"]) == ("sliding", "high"))
    assert found["resonance"] == pytest.approx(slowest, rel=0.02)
    assert f"| hand Fy to y | sliding | high | {found['size']:.3g} mm/N | {found['resonance']:.3g} |" in printed
    assert (tmp_path / "frequency_responses.png").stat().st_size > 20_000
