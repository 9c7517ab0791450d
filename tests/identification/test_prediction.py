"""Predictions are the plant's own motion: against one lane moved alone, and against SciPy's integrator."""

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from baselines.identification.log.trial import Trial, fresh_rows
from baselines.identification.windows.prediction import predict
from baselines.identification.windows.windows import Windows, cut, spools_at
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from tests.identification.trials import OWNER, TRUE, trial


def spools_before(whole: Trial, starts: NDArray[np.intp], rig: Parameters) -> Array:
    return spools_at(whole.openings, whole.period, starts, 1.0 / rig.valves.time_constant)


def few(length: float = 0.05) -> Windows:
    windows = cut(trial(), OWNER, length)
    return windows.some(np.array([10, 25]))


def alone(windows: Windows, window: int, rig: Parameters, state: Array) -> Array:
    """States (K + 1, 18) of one window, moved by one plant of its own."""
    plant, first = Plant(rig, 1), int(windows.starts[window])
    plant.state = state[:, None]
    states = [plant.state[:, 0].copy()]
    for k in range(windows.length):
        plant.advance(windows.trial.openings[:, [first + k]], np.zeros((2, 1)), windows.trial.period)
        states.append(plant.state[:, 0].copy())
    return np.array(states)


def test_every_window_and_rig_is_the_plant_alone() -> None:
    windows, rigs = few(), [OWNER, TRUE]
    states = np.repeat(windows.state[:, None], 2, axis=1)
    pressures, positions, ends = predict(windows, rigs, states)
    for v, rig in enumerate(rigs):
        spools = spools_before(windows.trial, windows.starts, rig)
        for w in range(2):
            start = windows.state[:, w].copy()
            start[list(at.SPOOLS)] = spools[:, w]
            track = alone(windows, w, rig, start)
            assert pressures[v, w].tobytes() == track[:-1, list(at.PRESSURES)].tobytes()
            assert ends[:, v, w].tobytes() == track[-1].tobytes()
            plant = Plant(rig, len(track))
            plant.state = track.T
            places = plant.end_effector()[:2]
            late = round(rig.electronics.position_latency / windows.trial.period)
            inside = windows.arrived[w] - late >= 0
            inside &= (windows.arrived[w] - late <= windows.length) & windows.valid[w]
            shown = places[:, (windows.arrived[w] - late)[inside]].T
            # Interpolation at a whole number of periods rounds.
            assert np.allclose(positions[v, w][inside], shown, rtol=0, atol=1e-12)


def test_a_latency_between_two_periods_is_interpolated() -> None:
    windows, period = few(), trial().period
    rigs = [OWNER.replace({"electronics.position_latency": late * period}) for late in (4.0, 4.25, 5.0)]
    _, positions, _ = predict(windows, rigs, np.repeat(windows.state[:, None], 3, axis=1))
    assert np.allclose(positions[1], 0.75 * positions[0] + 0.25 * positions[2], rtol=0, atol=1e-9)
    assert np.abs(positions[2] - positions[0]).max() > 1e-5


def test_spools_follow_from_the_openings_before() -> None:
    whole = trial()
    found = spools_before(whole, np.array([0, 40, 200]), TRUE)
    plant = Plant(TRUE, 1)
    state = plant.state.copy()
    state[list(at.SPOOLS)] = 0.0
    plant.state = state
    for k in range(200):
        if k == 40:
            assert np.allclose(plant.state[list(at.SPOOLS), 0], found[:, 1], rtol=0, atol=1e-14)
        plant.advance(whole.openings[:, [k]], np.zeros((2, 1)), whole.period)
    assert np.allclose(plant.state[list(at.SPOOLS), 0], found[:, 2], rtol=0, atol=1e-14)
    assert (found[:, 0] == 0).all()


def test_positions_that_repeat_are_not_fresh() -> None:
    rows = fresh_rows(trial().positions)
    rate = len(rows) / (trial().times[-1] - trial().times[0])
    assert abs(rate - TRUE.electronics.position_rate) < 1.0
    assert len(fresh_rows(trial("ideal").positions)) == len(trial().times) - 1


def integrated(windows: Windows, rig: Parameters, state: Array, periods: int) -> Array:
    """Pressures (periods, 4) of the first window by SciPy's eighth-order method on the plant's derivatives."""
    plant, first, rows = Plant(rig, 1), int(windows.starts[0]), []
    for k in range(periods):
        rows.append(state[list(at.PRESSURES)])
        opening = windows.trial.openings[:, [first + k]]

        def rates(_: float, x: Array, opening: Array = opening) -> Array:
            return plant.derivatives(x[:, None], opening, np.zeros((2, 1)))[:, 0]

        state = solve_ivp(rates, (0.0, windows.trial.period), state, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    return np.array(rows)


def test_derivatives_are_those_of_another_integrator() -> None:
    """Forward differences along the mass and the conductance, one lane each, against central ones of SciPy's solution."""
    windows = few(0.03)
    windows = windows.some(np.array([0]))
    start = windows.state[:, 0].copy()
    for name, step in (("mechanics.mass", 3e-4), ("valves.sonic_conductance", 4e-13)):
        value = getattr(getattr(OWNER, name.split(".")[0]), name.split(".")[1])
        rigs = [OWNER, OWNER.replace({name: value * (1 + 1e-5)})]
        pressures, _, _ = predict(windows, rigs, np.repeat(windows.state[:, None], 2, axis=1))
        ours = (pressures[1, 0] - pressures[0, 0]) / 1e-5
        start[list(at.SPOOLS)] = spools_before(windows.trial, windows.starts, OWNER)[:, 0]
        sides = [integrated(windows, OWNER.replace({name: value + sign * step}), start, windows.length) for sign in (1.0, -1.0)]
        theirs = (sides[0] - sides[1]) / (2 * step) * value
        # Steps of a third of 1 ms follow spools and bristles to some 1e-4; the difference is of the first order, 1e-5.
        assert np.abs(ours - theirs).max() < 2e-3 * np.abs(theirs).max()
