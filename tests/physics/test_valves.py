"""Servovalves: ISO 6358 flows, the spool's lag and the exact inverses of the characteristic, through the plant itself."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from birthsim_env.physics.compiled.lanes import PRESSURES, SPOOLS, TEMPERATURES, Array
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.pneumatics import air, valves
from birthsim_env.physics.pneumatics.characteristic import edge_of
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.servovalves import LINEAR, MPYE_5_M5, Curve
from lab.studies.accuracy import second_model

C, B, CL = 3.9e-9, 0.30, 0.005 * 3.9e-9
RHO0, T0, SUPPLY, ATMOSPHERE = 1.185, 293.15, 7.0e5, 1.013e5
"""Assumed: sonic conductance, critical ratio, leakage; ISO 6358 reference state; absolute pressures."""
CROSSING = 0.03
VALVES = {curve: valves.Valve(*[edge_of(*curve, 1.0)] * 2, C, CL, CROSSING) for curve in (LINEAR, MPYE_5_M5)}
VALVE = VALVES[LINEAR]
curves = st.sampled_from([LINEAR, MPYE_5_M5])
"""The second is the default rig's."""
CURVED = {
    **{"valves.supply_overlap": 0.1, "valves.supply_curvature": 0.4, "valves.exhaust_overlap": 0.04},
    **{"valves.exhaust_curvature": -0.3, "valves.exhaust_ratio": 0.7, "valve_n1.supply_overlap": 0.05},
}
"""Edges that differ, so that one begins to open before the other where a cylinder has one valve."""


def both_ways(conductance: float, pa: float, ta: float, pb: float, tb: float) -> float:
    """ISO 6358 mass flow from a to b, kg/s, by the second model; negative when it runs the other way."""
    (up, warm, down), sign = ((pa, ta, pb), 1) if pa > pb else ((pb, tb, pa), -1)
    return sign * float(second_model.orifice(conductance, up, warm, down, B, RHO0, T0))


def opened(spool: float, curve: Curve) -> float:
    """Part of the conductance that is open, by the second model."""
    return float(second_model.opened(spool, np.array([*curve, 1.0])))


def plant_flows(pressure: Array, temperature: Array, spool: Array, changes: dict[str, float] | None = None) -> Array:
    """``Plant.mass_flows`` with all four chambers of each lane in one condition, as (2, N): supplied and exhausted."""
    lanes = np.size(pressure)
    plant = Plant(Parameters().replace(changes or {}), lanes)
    plant.state[list(PRESSURES)], plant.state[list(TEMPERATURES)], plant.state[list(SPOOLS)] = pressure, temperature, spool
    flows = plant.mass_flows().reshape(2, 4, lanes)
    assert np.all(flows == flows[:, :1]), "the four chambers have equal valves"
    return flows[:, 0]


def test_flows_of_the_plant_are_iso_6358_everywhere() -> None:
    rng = np.random.default_rng(0)
    pressure, temperature = rng.uniform(0.3e5, 12e5, 2000), rng.uniform(200, 450, 2000)
    spool = rng.uniform(-1, 1, 2000)
    spool[:200] = 0
    supplied, exhausted = plant_flows(pressure, temperature, spool)
    for p, t, s, got_in, got_out in zip(pressure, temperature, spool, supplied, exhausted, strict=True):
        into, out_of = (C * opened(stroke, MPYE_5_M5) + CL for stroke in (s, -s))
        assert got_in == pytest.approx(both_ways(into, SUPPLY, T0, p, t), rel=1e-12)
        assert got_out == pytest.approx(both_ways(out_of, p, t, ATMOSPHERE, T0), rel=1e-12)
    assert (supplied < 0).any(), "flow back into the supply must have occurred"
    assert (exhausted < 0).any(), "flow in from the atmosphere must have occurred"


def test_nominal_flow_is_100_litres_per_minute() -> None:
    """Nominal flow as data sheets state it: 6 bar gauge upstream, 5 bar gauge downstream, reference state ANR."""
    changes = {"air.supply_pressure": 7.013e5, "valves.leakage_ratio": 0.0}
    supplied, exhausted = plant_flows(np.array([6.013e5]), np.array([T0]), np.array([1.0]), changes)
    assert supplied[0] / RHO0 * 60000 == pytest.approx(100, rel=0.1)
    assert exhausted[0] == 0


def per_conductance(pressure: float, temperature: float) -> tuple[float, float]:
    """Flows through a supply and an exhaust orifice of conductance 1 (fill, drain)."""
    return both_ways(1.0, SUPPLY, T0, pressure, temperature), both_ways(1.0, pressure, temperature, ATMOSPHERE, T0)


inside = st.floats(1.02 * ATMOSPHERE, 0.98 * SUPPLY)
warmth = st.floats(230, 400)


@given(pressure=inside, temperature=warmth, spool=st.floats(-1, 1), curve=curves)
def test_opening_for_flow_inverts_the_plants_net_flow(pressure: float, temperature: float, spool: float, curve: Curve) -> None:
    """But for flows with which the overlap is crossed, of which less than ``CROSSING`` of what a valve lets through is left."""
    here = np.array([pressure]), np.array([temperature]), np.array([spool]), curve.changes()
    supplied, exhausted = plant_flows(*here)
    opening = valves.opening_for_flow(supplied[0] - exhausted[0], *per_conductance(pressure, temperature), VALVES[curve])
    if curve is LINEAR or opened(abs(spool), curve) > CROSSING:
        assert opening == pytest.approx(spool, abs=1e-12)
    else:
        assert opening * spool > -1e-15
        assert opened(abs(opening), curve) <= opened(abs(spool), curve) * (1 + 1e-9)


@given(pressure=inside, temperature=warmth, wish=st.floats(-2, 2), curve=curves)
def test_opening_for_flow_saturates_beyond_full_opening_only(
    pressure: float, temperature: float, wish: float, curve: Curve
) -> None:
    full = np.repeat(pressure, 2), np.repeat(temperature, 2), np.array([-1.0, 1.0]), curve.changes()
    supplied, exhausted = plant_flows(*full)
    least, most = supplied - exhausted
    wanted = wish * max(-least, most)
    driving = per_conductance(pressure, temperature)
    opening = valves.opening_for_flow(wanted, *driving, VALVES[curve])
    assert -1 <= opening <= 1
    # The root of the characteristic ends a rounding away from full opening.
    if wanted > most:
        assert opening == pytest.approx(1, abs=1e-15)
    elif wanted < least:
        assert opening == pytest.approx(-1, abs=1e-15)
    else:
        got_in, got_out = plant_flows(np.array([pressure]), np.array([temperature]), np.array([opening]), curve.changes())
        left = 0.0 if curve is LINEAR else CROSSING * C * max(driving)
        assert got_in[0] - got_out[0] == pytest.approx(wanted, abs=left + 1e-12 * max(-least, most))


def test_valve_stays_shut_where_opening_would_let_air_run_the_other_way() -> None:
    shut = ((SUPPLY, 1e-4, 0.0), (8e5, 1e-4, 0.0), (ATMOSPHERE, -1e-4, 0.0), (0.9e5, -1e-4, 0.0))
    for pressure, wanted, expected in (*shut, (6.9e5, 1e-2, 1.0)):
        assert valves.opening_for_flow(wanted, *per_conductance(pressure, T0), VALVE) == expected
    fill, drain = per_conductance(3e5, T0)
    assert valves.opening_for_flow(CL * (fill - drain), fill, drain, VALVE) == 0, "what leaks anyway needs no opening"


fractions = st.floats(0.5, 8.0)


@given(pp=inside, pn=inside, tp=warmth, tn=warmth, fraction_p=fractions, fraction_n=fractions, spool=st.floats(-1, 1))
def test_opening_for_active_flow_inverts_one_valve_per_cylinder(
    pp: float, pn: float, tp: float, tn: float, fraction_p: float, fraction_n: float, spool: float
) -> None:
    linear = LINEAR.changes()
    supplied, exhausted = plant_flows(np.array([pp, pn]), np.array([tp, tn]), np.array([spool, -spool]), linear)
    flow_p, flow_n = supplied - exhausted
    active = fraction_p * flow_p - fraction_n * flow_n
    at = (*per_conductance(pp, tp), *per_conductance(pn, tn), fraction_p, fraction_n, VALVE, VALVE)
    assert valves.opening_for_active_flow(active, *at) == pytest.approx(spool, abs=1e-12)
    most, least = (
        fraction_p * (q[0][0] - q[1][0]) - fraction_n * (q[0][1] - q[1][1])
        for q in (plant_flows(np.array([pp, pn]), np.array([tp, tn]), np.array([s, -s]), linear) for s in (1.0, -1.0))
    )
    assert valves.opening_for_active_flow(most + 1e-3, *at) == 1
    assert valves.opening_for_active_flow(least - 1e-3, *at) == -1


def test_a_valve_opens_however_small_the_driving_pressure() -> None:
    """A twentieth of a Pa kg/m3 drives 1e-10 kg/s at an opening of a half; only without any the valve stays shut."""
    tight = VALVE._replace(leakage=0.0)
    assert valves.opening_for_flow(1e-10, 0.05, 1.0, tight) == pytest.approx(1e-10 / (C * 0.05))
    assert valves.opening_for_flow(-1e-10, 1.0, 0.05, tight) == pytest.approx(-1e-10 / (C * 0.05))
    assert valves.opening_for_flow(1e-10, 0.0, 1.0, tight) == 0.0
    assert valves.opening_for_flow(-1e-10, 1.0, -0.05, tight) == 0.0


@pytest.mark.parametrize("changes", [{}, CURVED], ids=["default", "curved"])
@given(pp=inside, pn=inside, tp=warmth, tn=warmth, fraction_p=fractions, fraction_n=fractions, spool=st.floats(-1, 1))
def test_openings_invert_the_flows_of_valves_with_a_curve(
    changes: dict[str, float], pp: float, pn: float, tp: float, tn: float, fraction_p: float, fraction_n: float, spool: float
) -> None:
    """By the plant's flows: exactly where the overlap is behind, and within the part that crosses it before."""
    plant = Plant(Parameters().replace(changes))
    plant.state[list(PRESSURES), 0], plant.state[list(TEMPERATURES), 0] = [pp, pn, pp, pn], [tp, tn, tp, tn]
    at_p, at_n = per_conductance(pp, tp), per_conductance(pn, tn)
    full = C * max(fraction_p * max(at_p), fraction_n * max(at_n))
    valve_p, valve_n = (air.valve_of(plant.lane_parameters, 0, k) for k in (0, 1))

    def flows(opening: float, other: float) -> Array:
        plant.state[list(SPOOLS), 0] = [opening, other, opening, other]
        supplied, exhausted = plant.mass_flows()[:2, 0], plant.mass_flows()[4:6, 0]
        return np.asarray(supplied - exhausted)

    alone = flows(spool, spool)
    both = [valves.opening_for_flow(q, *a, v) for q, a, v in zip(alone, (at_p, at_n), (valve_p, valve_n), strict=True)]
    assert flows(*both) == pytest.approx(alone, abs=0.031 * C * max(*at_p, *at_n))
    weights = np.array([fraction_p, -fraction_n])
    active = float(weights @ flows(spool, -spool))
    opened = valves.opening_for_active_flow(active, *at_p, *at_n, fraction_p, fraction_n, valve_p, valve_n)
    assert weights @ flows(opened, -opened) == pytest.approx(active, abs=0.031 * 2 * full)
    if abs(spool) > 0.5:
        assert [*both, opened] == pytest.approx([spool] * 3, abs=1e-9)
