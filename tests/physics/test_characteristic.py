"""The characteristic of a valve and its inverse: numbers worked out by hand, round trips, and the edges of a rig."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import parameter_array
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.pneumatics.characteristic import Edge, common_opening, largest_part, opened_part, opening_of
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.servovalves import LINEAR, MPYE_5_M5
from tests.physics.rigs import UNLIKE

CROSSING = 0.03


def edge_of(overlap: float, curvature: float, share: float = 1.0) -> Edge:
    reach = 1.0 - overlap
    return Edge(overlap, share * (1.0 + curvature) / reach, share * curvature / reach**2)


TENTH = edge_of(0.1, 0.4)


@pytest.mark.parametrize(
    ("opening", "part"),
    # t = 0, 0, 0, 1/4, 1/2, 3/4, 1; t (1.4 - 0.4 t)
    [(-0.6, 0.0), (0.05, 0.0), (0.1, 0.0), (0.325, 0.325), (0.55, 0.6), (0.775, 0.825), (1.0, 1.0)],
)
def test_a_curve_by_hand(opening: float, part: float) -> None:
    assert opened_part(opening, TENTH) == pytest.approx(part, abs=1e-15)
    if part > CROSSING:
        assert opening_of(part, TENTH, CROSSING) == pytest.approx(opening, abs=1e-15)


def test_the_overlap_is_crossed_softly() -> None:
    """A wish of half the crossing gets 3/4 of the overlap, and on top what a spool without one needs: 0.015/1.4 of 0.9."""
    beyond = opening_of(0.5 * CROSSING, edge_of(0.0, 0.4), CROSSING)
    assert beyond == pytest.approx(0.015 / 1.4, rel=0.01)
    assert opening_of(0.5 * CROSSING, TENTH, CROSSING) == pytest.approx(0.075 + 0.9 * beyond, abs=1e-15)
    assert opening_of(0.0, TENTH, CROSSING) == 0.0


overlaps, curvatures, shares, parts = st.floats(0, 0.5), st.floats(-0.9, 0.9), st.floats(0.3, 2.0), st.floats(0, 1)


@given(overlap=overlaps, curvature=curvatures, share=shares, wanted=parts)
def test_the_inverse_beyond_the_crossing(overlap: float, curvature: float, share: float, wanted: float) -> None:
    edge = edge_of(overlap, curvature, share)
    assert largest_part(edge) == pytest.approx(share, rel=1e-12)
    part = CROSSING + (share - CROSSING) * wanted
    opening = opening_of(part, edge, CROSSING)
    assert 0 <= opening <= 1
    assert opened_part(opening, edge) == pytest.approx(part, abs=1e-12)
    assert opening_of(share * 1.01, edge, CROSSING) == pytest.approx(1.0, abs=1e-12)
    assert opening_of(0.5 * CROSSING, edge, CROSSING) <= opening_of(CROSSING, edge, CROSSING)


@given(overlap=overlaps, curvature=curvatures, low=parts, high=parts)
def test_more_stroke_is_more_flow_and_more_flow_more_stroke(overlap: float, curvature: float, low: float, high: float) -> None:
    assume(high - low > 1e-9)
    edge = edge_of(overlap, curvature)
    if high > overlap:
        assert opened_part(low, edge) < opened_part(high, edge)
    assert opening_of(low, edge, CROSSING) < opening_of(high, edge, CROSSING)


edges = st.tuples(overlaps, curvatures, shares)


@given(first=edges, second=edges, share=parts, opening=parts)
def test_edges_that_open_together(
    first: tuple[float, float, float], second: tuple[float, float, float], share: float, opening: float
) -> None:
    one, other = edge_of(*first), edge_of(*second)
    part = share * opened_part(opening, one) + (1 - share) * opened_part(opening, other)
    assume(part > CROSSING)
    found = common_opening(part, share, one, other, CROSSING)
    assert share * opened_part(found, one) + (1 - share) * opened_part(found, other) == pytest.approx(part, abs=1e-9)
    assert common_opening(part, share, one, other, CROSSING) == pytest.approx(
        common_opening(part, 1 - share, other, one, CROSSING), abs=1e-9
    )


def test_a_linear_valve_opens_as_it_is_told_to_the_last_bit() -> None:
    edge, part = edge_of(*LINEAR), np.random.default_rng(0).uniform(0, 1, 1000)
    for one in part.tolist():
        assert opened_part(one, edge) == one
        assert opening_of(one, edge, CROSSING) == one
        assert common_opening(one, 0.3, edge, edge, CROSSING) == one


def test_each_valve_has_the_edges_that_its_sections_say() -> None:
    rows = parameter_array(Parameters().replace(UNLIKE), 1)[:, 0]

    def edge(side: str, valve: str) -> Edge:
        return Edge(*(rows[getattr(at, f"{side}_{number}_{valve}".upper())] for number in ("overlap", "slope", "bend")))

    assert edge("supply", "n2") == pytest.approx(edge_of(*MPYE_5_M5), rel=1e-14)
    assert edge("supply", "p1") == pytest.approx(edge_of(MPYE_5_M5.overlap + 0.02, MPYE_5_M5.curvature), rel=1e-14)
    assert edge("supply", "n1") == pytest.approx(edge_of(MPYE_5_M5.overlap, MPYE_5_M5.curvature - 0.1), rel=1e-14)
    assert edge("supply", "p2") == pytest.approx(edge_of(*MPYE_5_M5, 1.2), rel=1e-14)
    assert edge("exhaust", "p1") == pytest.approx(edge_of(0.06, -0.1, 0.8), rel=1e-14)
    assert edge("exhaust", "n1") == pytest.approx(edge_of(0.06, -0.2, 0.8 * 0.85), rel=1e-14)
    assert edge("exhaust", "n2") == pytest.approx(edge_of(0.0, -0.2, 0.8), rel=1e-14)


def test_a_spool_within_its_overlap_lets_nothing_through_but_leakage() -> None:
    plant = Plant(Parameters().replace({"valves.supply_overlap": 0.1, "valves.exhaust_overlap": 0.06}), 4)
    shut = plant.mass_flows()
    plant.state[list(at.SPOOLS)] = [0.0999, -0.0599, 0.1001, -0.0601]
    opened = plant.mass_flows()
    np.testing.assert_array_equal(opened[:, :2], shut[:, :2])
    assert (opened[:4, 2] > shut[:4, 2]).all()
    assert (opened[4:, 3] > shut[4:, 3]).all()
