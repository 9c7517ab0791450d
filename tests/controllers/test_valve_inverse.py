"""Openings for wanted mass flows against the valves of the plant."""

import numpy as np
import pytest

from baselines import valve_inverse
from birthsim_env.physics.compiled.lanes import PRESSURES, SPOOLS, Array, Rig, parameter_column
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters

RIG = Parameters()
VALVES = {"default": RIG, "hot, leaking": RIG.replace({"air.temperature": 320.0, "valves.leakage_ratio": 0.08})}
every_valve = pytest.mark.parametrize("rig", VALVES.values(), ids=VALVES)


def flow_ranges(pressures: Array, spools: Array, rig: Parameters) -> tuple[Array, Array, Array]:
    least, most, present = np.empty_like(pressures), np.empty_like(pressures), np.empty_like(pressures)
    valve_inverse.flow_ranges(pressures, spools, Rig(parameter_column(rig)), least, most, present)
    return least, most, present


def openings_for_flows(flows: Array, pressures: Array, rig: Parameters) -> Array:
    openings = np.empty_like(flows)
    valve_inverse.openings_for_flows(flows, pressures, Rig(parameter_column(rig)), openings)
    return openings


def into_chambers(rig: Parameters, pressures: Array, spools: Array) -> Array:
    """Net mass flow of the plant's chambers, kg/s, (4, N), all air as warm as the surroundings."""
    plant = Plant(rig, pressures.shape[1])
    plant.state[list(PRESSURES)], plant.state[list(SPOOLS)] = pressures, spools
    flows = plant.mass_flows()
    return np.asarray(flows[:4] - flows[4:])


@every_valve
def test_flow_ranges_are_those_of_the_plants_valves(rig: Parameters) -> None:
    """Least and most over all openings, and the flow at given spools; pressures also beyond supply and atmosphere."""
    rng, lanes = np.random.default_rng(0), 60
    pressures, spools = rng.uniform(0.6e5, 8.5e5, (4, lanes)), rng.uniform(-1, 1, (4, lanes))
    least, most, present = flow_ranges(pressures, spools, rig)
    every = np.array([into_chambers(rig, pressures, np.full((4, lanes), s)) for s in np.linspace(-1, 1, 41)])
    np.testing.assert_allclose(least, every.min(axis=0), rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(most, every.max(axis=0), rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(present, into_chambers(rig, pressures, spools), rtol=1e-12, atol=1e-15)


@every_valve
def test_openings_for_flows_are_the_inverse(rig: Parameters) -> None:
    """Flow to opening to flow through the plant's valves, and opening to flow to opening; beyond the range fully open.

    Openings amid the overlap, which is crossed softly, let less through than is wanted.
    """
    rng, lanes = np.random.default_rng(1), 200
    pressures, spools = rng.uniform(1.1e5, 6.9e5, (4, lanes)), rng.uniform(-1, 1, (4, lanes))
    least, most, present = flow_ranges(pressures, spools, rig)
    wanted = rng.uniform(least, most)
    got = openings_for_flows(wanted, pressures, rig)
    assert np.abs(got).max() <= 1
    crossed = rig.valves.supply_overlap + rig.valves.crossing
    beyond, still = np.abs(got) > crossed, into_chambers(rig, pressures, np.zeros_like(got))
    through = into_chambers(rig, pressures, got)
    assert 0.8 < beyond.mean() < 1
    np.testing.assert_allclose(through[beyond], wanted[beyond], rtol=0, atol=1e-15)
    assert np.all(np.abs(through - still) <= np.abs(wanted - still) + 1e-15)
    beyond = np.abs(spools) > crossed
    np.testing.assert_allclose(openings_for_flows(present, pressures, rig)[beyond], spools[beyond], rtol=0, atol=1e-12)
    np.testing.assert_array_equal(openings_for_flows(least - 1e-6, pressures, rig), -1.0)
    np.testing.assert_array_equal(openings_for_flows(most + 1e-6, pressures, rig), 1.0)


def test_a_valve_without_driving_pressure_stays_shut() -> None:
    """Above the supply nothing can fill, below the atmosphere nothing can drain: opening would do the contrary."""
    pressures = np.full((4, 2), [8e5, 0.9e5])
    assert not openings_for_flows(np.full((4, 2), [1e-3, -1e-3]), pressures, RIG).any()


def test_no_chamber_counts_as_shorter_than_two_millimetres() -> None:
    p = Rig(parameter_column(RIG))
    for k, half in enumerate((p.half_l1, p.half_l2)):
        beyond = ((0.03, half + 0.03, half - 0.03), (half - 0.0015, 2 * half - 0.0015, 0.002), (-2 * half, 0.002, 3 * half))
        for y, length_p, length_n in beyond:
            air = valve_inverse.air_at(k, 3e5, 3e5, y, 0.0, p)
            assert (air.length_p, air.length_n) == pytest.approx((length_p, length_n))
