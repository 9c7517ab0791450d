"""The observer of spools and chamber pressures: against exact lags, closed forms, and (6) integrated by SciPy."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from baselines.estimation.chamber_observer import Chambers, observe
from birthsim_env.loop.signals import Joints
from birthsim_env.physics.compiled.lanes import Array, Rig, parameter_column
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.servovalves import LINEAR
from tests.oracles import derived_law

PERIOD = 1e-3
BLIND = 1e-9
"""1/s: a bandwidth at which the cells are not believed."""

ANOTHER = Parameters().replace(
    {
        "cylinder1.stroke": 0.24,
        "cylinder1.rod_diameter": 0.014,
        "cylinder2.piston_diameter": 0.032,
        "chambers.dead_volume": 2.2e-5,
        "valves.time_constant": 0.007,
        "valves.leakage_ratio": 0.02,
        "valves.critical_ratio": 0.4,
        "air.temperature": 310.0,
        "air.polytropic_index": 1.35,
        "air.supply_pressure": 6.2e5,
    }
)
TIGHT = Parameters().replace({"valves.leakage_ratio": 0.0, "valves.time_constant": 0.006})
"""Valves that do not leak."""

START = np.array([[1.6e5], [5.5e5], [3.0e5], [2.2e5]])
"""Pa, in chambers P1, N1, P2, N2."""


class Observer:
    """The kernel with what a stage keeps for it, over N lanes."""

    def __init__(self, rig: Parameters, bandwidth: float, lanes: int = 1, period: float = PERIOD) -> None:
        self._numbers = (Rig(parameter_column(rig)), period, 1.0 - math.exp(-bandwidth * period))
        self._chambers, self.fresh = Chambers(np.zeros((Chambers.size, lanes))), np.ones(lanes)
        self.spools, self.openings = self._chambers.spool, self._chambers.opening

    def update(self, measured: Array, joints: Array) -> Array:
        observe(self._chambers, np.ascontiguousarray(measured), Joints(joints), *self._numbers, self.fresh)
        self.fresh[:] = 0.0
        return self._chambers.pressure


def resting(lanes: int) -> Array:
    """Joints (4, N) of pistons that do not move."""
    return np.repeat([[0.02], [-0.05], [0.0], [0.0]], lanes, axis=1)


def swinging(time: float) -> Array:
    """Joints (4,) of pistons on their ways: up to 0.6 and 1 m/s."""
    rate = np.array([13.0, 9.0])
    return np.concatenate([[0.045, 0.11] * np.sin(rate * time), rate * [0.045, 0.11] * np.cos(rate * time)])


def volumes(joints: Array, rig: Parameters) -> tuple[Array, Array]:
    """Of chambers P1, N1, P2, N2 with their dead volumes, m3, and their rates, m3/s; (4,) each."""
    found, rates = [], []
    for i, cylinder in enumerate((rig.cylinder1, rig.cylinder2)):
        for area, sign in zip(derived_law.areas(cylinder), (1.0, -1.0), strict=True):
            found.append(rig.chambers.dead_volume + area * (cylinder.stroke / 2 + sign * joints[i]))
            rates.append(sign * area * joints[2 + i])
    return np.array(found), np.array(rates)


def lagging(start: Array, opening: Array, since: Any, rig: Parameters) -> Array:
    """Spools a time ``since`` after their valves were told to go from ``start`` to ``opening``."""
    return np.asarray(opening + (start - opening) * np.exp(-since / rig.valves.time_constant))


HOLD = 0.008
"""s for which every command of ``commands`` is held."""


def commands(count: int) -> Array:
    """Openings (count, 4) that fill and vent chambers in turn, fully at times."""
    openings = np.random.default_rng(8).uniform(-0.2, 0.2, (count, 4))
    openings += np.where((np.arange(count)[:, None] + [0, 5, 8, 13]) // 5 % 2 == 0, 0.4, -0.4)
    openings[3], openings[6, ::2] = [1.0, -1.0, -1.0, 1.0], -1.0
    return openings


def truth(rig: Parameters, openings: Array, times: Array) -> tuple[Array, Array]:
    """Spools and pressures (T, 4) at ``times`` by (6) with V = V0 + S L and ISO 6358 flows, valves shut at first."""
    spools, air, found = np.zeros(4), START[:, 0].copy(), []
    for block, opening in enumerate(openings):
        begin, first = block * HOLD, spools

        def slope(time: float, p: Array, begin: float = begin, first: Array = first, opening: Array = opening) -> Array:
            volume, rate = volumes(swinging(time), rig)
            open_by = lagging(first, opening, time - begin, rig)
            flow = np.array([derived_law.net_flow(s, own, rig) for s, own in zip(open_by, p, strict=True)])
            gas_t = rig.air.gas_constant * rig.air.temperature
            return np.asarray(rig.air.polytropic_index * (gas_t * flow - p * rate) / volume)

        own = times[(times > begin - 1e-9) & (times < begin + HOLD - 1e-9)]
        path = solve_ivp(slope, (begin, begin + HOLD), air, t_eval=[*own, begin + HOLD], rtol=1e-8, atol=1e-2)
        found += [np.concatenate([lagging(first, opening, t - begin, rig), p]) for t, p in zip(own, path.y.T, strict=False)]
        air, spools = path.y[:, -1], lagging(first, opening, HOLD, rig)
    return np.array(found)[:, :4], np.array(found)[:, 4:]


@pytest.mark.parametrize("rig", [Parameters(), ANOTHER], ids=["default", "another rig"])
def test_what_was_commanded_tells_spools_and_pressures(rig: Parameters) -> None:
    """0.16 s blind: spools exactly, pressures but for what Euler's step leaves, half as much with half the period."""
    openings, errors = commands(20), []
    for period in (1e-3, 5e-4):
        times = period * np.arange(round(20 * HOLD / period))
        spools, pressures = truth(rig, openings, times)
        estimator, found, joints = Observer(rig, BLIND, period=period), [], np.zeros((4, 1))
        for time, spool in zip(times, spools, strict=True):
            found.append(estimator.update(START, joints)[:, 0].copy())
            np.testing.assert_allclose(estimator.spools[:, 0], spool, rtol=0, atol=1e-12)
            joints, estimator.openings[:, 0] = swinging(time)[:, None], openings[int(time / HOLD + 1e-6)]
        errors.append(np.abs(found - pressures).max(axis=0))
    assert np.ptp(pressures, axis=0).min() > 4e4, "there must be something to predict"
    assert np.all(errors[0] < 0.03 * np.ptp(pressures, axis=0))
    np.testing.assert_allclose(errors[1] / errors[0], 0.5, rtol=0, atol=0.06)


def test_the_lag_is_integrated_over_the_period() -> None:
    """Choked supply, pistons at rest, no leakage: P = P0 + k r T C rho Ps (integral of s dt)/V, without an error of steps.

    Of linear valves, of which this integral is known.
    """
    rig, period, tau, rng = TIGHT.replace(LINEAR.changes()), 4e-3, 0.006, np.random.default_rng(1)
    estimator, pressures = Observer(rig, BLIND, period=period), np.full((4, 1), 1.1e5)
    spool, expected = np.zeros(4), np.full(4, 1.1e5)
    density = rig.air.reference_density * math.sqrt(rig.air.reference_temperature / rig.air.temperature)
    choked = rig.valves.sonic_conductance * density * rig.air.supply_pressure
    gain = rig.air.polytropic_index * rig.air.gas_constant * rig.air.temperature * choked
    gain /= volumes(resting(1)[:, 0], rig)[0]
    for _ in range(12):
        found = estimator.update(pressures, resting(1))[:, 0]
        np.testing.assert_allclose(found, expected, rtol=1e-9)
        opening = rng.uniform(0.0, 0.4, 4)
        estimator.openings[:, 0] = opening
        gone = lagging(spool, opening, period, rig)
        expected = expected + gain * (opening * period - tau * (gone - spool))
        spool = gone
    assert 1.2e5 < expected.min() < expected.max() < rig.valves.critical_ratio * rig.air.supply_pressure


@pytest.mark.parametrize("bandwidth", [50.0, 150.0, 600.0])
@pytest.mark.parametrize("period", [2.5e-4, 1e-3, 4e-3])
def test_noise_of_the_cells_is_averaged(bandwidth: float, period: float) -> None:
    """Nothing flows: the mean is true, the variance a first-order filter's, fraction/(2 - fraction), uncorrelated cells."""
    lanes, noise, fraction = 1000, 500.0, 1 - np.exp(-bandwidth * period)
    estimator, rng, kept = Observer(TIGHT, bandwidth, lanes, period), np.random.default_rng(2), []
    settled = math.ceil(8 / (bandwidth * period))
    for tick in range(settled + 60):
        measured = START + noise * rng.normal(size=(4, lanes))
        estimate = estimator.update(measured, resting(lanes))
        if tick >= settled:
            kept.append(estimate - START)
    error = np.array(kept)
    assert np.mean(error**2) == pytest.approx(noise**2 * fraction / (2 - fraction), rel=0.05)
    assert np.abs(error.mean(axis=(0, 2))).max() < 0.1 * noise
    assert np.abs(np.corrcoef(error[-1]) - np.eye(4)).max() < 0.15


def test_exact_cells_are_believed_bit_for_bit() -> None:
    rng = np.random.default_rng(5)
    measured, openings = rng.uniform(0.5e5, 9e5, (20, 4, 5)), rng.uniform(-1, 1, (20, 4, 5))
    joints = np.array([[0.09], [0.19], [1.0], [1.0]]) * rng.uniform(-1, 1, (20, 4, 5))
    estimator = Observer(Parameters(), math.inf, 5)
    for pressures, opening, now in zip(measured, openings, joints, strict=True):
        assert np.array_equal(estimator.update(pressures, now), pressures)
        estimator.openings[:] = opening
    started = Observer(Parameters(), 150.0, 5)
    assert np.array_equal(started.update(measured[0], joints[0]), measured[0]), "a start, too"
    assert not started.spools.any()


@pytest.mark.parametrize("period", [2.5e-4, 1e-3, 1e-2])
def test_pistons_past_their_strokes_leave_pressures_that_can_be(period: float) -> None:
    """Deeper than the dead volume is long, where a chamber would have none left: the believed one keeps its dead volume."""
    rig = Parameters().replace({"chambers.dead_volume": 5e-6, "electronics.control_period": period})
    past = np.array([[0.112, -0.112], [-0.212, 0.212], [1.0, -1.0], [-1.0, 1.0]])
    estimator, rng, cells = Observer(rig, 150.0, 2, period), np.random.default_rng(6), np.full((4, 2), 4e5)
    for _ in range(200):
        pressures = estimator.update(cells, past * rng.choice([-1, 1], (4, 1)))
        assert 1e5 < pressures.min() <= pressures.max() < 1e6
        estimator.openings[:] = rng.choice([-1.0, 1.0], (4, 2))
