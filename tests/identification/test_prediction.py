"""Predictions are the plant's own motion: against one lane moved alone, and against SciPy's integrator."""

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from baselines.identification.prediction import predict
from baselines.identification.quantities import LATENCY, QUANTITIES, coordinates, rig_at, value_of
from baselines.identification.sensitivities import sensitivities
from baselines.identification.starts import SPREAD
from baselines.identification.trial import Trial
from baselines.identification.windows import FREE, Windows, cut, fresh_rows, spools_at
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from tests.identification.trials import OWNER, TRUE, trial


def spools_before(whole: Trial, starts: NDArray[np.intp], rig: Parameters) -> Array:
    return spools_at(whole.openings, whole.period, starts, 1.0 / rig.valves.time_constant)[0]


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
    rows = fresh_rows(trial())
    rate = len(rows) / (trial().times[-1] - trial().times[0])
    assert abs(rate - TRUE.electronics.position_rate) < 1.0
    assert len(fresh_rows(trial("ideal"))) == len(trial().times) - 1


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


def test_sensitivities_are_central_differences_of_predictions() -> None:
    """Of all start states and all parameters; the latency is no whole number of periods, where tracks have a kink."""
    windows, rig = few(0.03), OWNER.replace({LATENCY: 4.3e-3})
    ours = sensitivities(windows, rig, windows.state, QUANTITIES)
    theta, count, step = coordinates(rig, QUANTITIES), len(FREE) + len(QUANTITIES), 1e-5
    ways = np.concatenate([np.diag(np.full(count, step)), np.diag(np.full(count, -step))])
    rigs = [rig_at(rig, QUANTITIES, theta + way[len(FREE) :]) for way in ways]
    states = np.repeat(windows.state[:, None], 2 * count, axis=1)
    states[list(FREE)] += (ways[:, : len(FREE)] * SPREAD).T[..., None]
    sizes = np.concatenate([SPREAD, np.ones(len(QUANTITIES))])
    for found, reached in zip(ours, predict(windows, rigs, states)[:2], strict=True):
        theirs = (reached[:count] - reached[count:]) / (2 * step)
        off = found * sizes[:, None, None, None] - theirs
        # A step of 1e-5 leaves 1e-10 of truncation and 1e-10 of rounding, over what moves least 1e-6.
        assert np.abs(off).max() < 1e-6 * np.abs(theirs).max()


def test_derivatives_are_those_of_another_integrator() -> None:
    """Along the mass and the conductance, against central differences of SciPy's solution."""
    windows = few(0.03)
    windows = windows.some(np.array([0]))
    start = windows.state[:, 0].copy()
    asked = tuple(one for one in QUANTITIES if one.name in ("mechanics.mass", "valves.sonic_conductance"))
    pressures, _ = sensitivities(windows, OWNER, windows.state, asked)
    start[list(at.SPOOLS)] = spools_before(windows.trial, windows.starts, OWNER)[:, 0]
    for ours, one in zip(pressures[len(FREE) :, 0], asked, strict=True):
        value = value_of(OWNER, one.name)
        rigs = [OWNER.replace({one.name: value * (1 + sign * 1e-4)}) for sign in (1.0, -1.0)]
        high, low = (integrated(windows, rig, start, windows.length) for rig in rigs)
        theirs = (high - low) / 2e-4
        # Runge-Kutta steps of 0.25 ms follow spools and bristles to some 1e-4.
        assert np.abs(ours - theirs).max() < 2e-3 * np.abs(theirs).max()
