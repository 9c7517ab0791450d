"""Sets of sensors: what they are, what they cost, and which of them nothing cheaper beats."""

from birthsim_env.registry import entry
from lab.studies.sensors_bought import ACCELERATION, ENCODERS, FORCE, GAUGES, PRICES, SETS, TRACKER, frontier


def test_a_set_has_one_sensor_of_the_position_and_is_driven_by_who_senses_what_it_senses() -> None:
    assert len({one.name for one in SETS}) == len(SETS) == 12
    for one in SETS:
        assert (TRACKER in one.parts) is not (ENCODERS in one.parts)
        assert (ENCODERS in one.parts) is one.sensors.startswith("encoders")
        assert (GAUGES in one.parts) is one.sensors.endswith("gauges")
        assert (GAUGES in one.parts or FORCE in one.parts) is (one.controller == "admittance-adaptive")
        assert ("acceleration" in one.file) is (ACCELERATION in one.parts)
        if one.sensors.endswith("gauges") and ACCELERATION not in one.parts:
            assert entry("sensors", one.sensors).needs == {ACCELERATION}


def test_prices_are_ranges_that_say_they_are_assumed_and_add_up() -> None:
    assert all(0 < low < high and "assumed" in said for low, high, said in PRICES.values())
    (one,) = (one for one in SETS if one.parts == (ENCODERS, GAUGES, ACCELERATION))
    assert one.price == (400.0 + 200.0 + 10.0, 1600.0 + 1000.0 + 200.0)


def test_the_frontier_has_what_nothing_cheaper_beats() -> None:
    points = [(5.0, 1.0), (1.0, 4.0), (2.0, 4.5), (3.0, 2.0), (4.0, 2.0)]
    assert frontier(points) == [(1.0, 4.0), (3.0, 2.0), (5.0, 1.0)]
