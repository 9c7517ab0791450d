"""What headings say: one name in many forms, and a unit that is never lost."""

import pytest

from birthsim_env.tables.headings import concept, is_like_force, name_and_unit
from birthsim_env.tables.units import unit_of

SAID = {
    # heading: its concept, its unit
    "time": ("time", ""),
    "Time (s)": ("time", "s"),
    "time_ms": ("time", "ms"),
    "t [\u00b5s]": ("time", "\u00b5s"),
    "Elapsed Time / s": ("time", "s"),
    "openings_P1 [%]": ("openings_P1", "%"),
    "openings_P1 %": ("openings_P1", "%"),
    "openings_P1%": ("openings_P1", "%"),
    "valve P1 (-)": ("openings_P1", "-"),
    "pressures[P1]": ("pressures_P1", ""),
    "pressures[P1] [bar]": ("pressures_P1", "bar"),
    "p_N2_kPa": ("pressures_N2", "kPa"),
    "P1 pressure (bar abs)": ("pressures_P1", "bar abs"),
    "X_Value": ("time", ""),
    "stiffness N/mm": ("stiffness", "N/mm"),
    "stiffness_N/m": ("stiffness", "N/m"),
    "Fx_m": ("fxm", ""),
    "Fz_kN": ("fzkn", "kN"),
    "Fz (hand) [kN]": ("fzhand", "kN"),
    "pos_s": ("poss", ""),
    "": ("", ""),
    "(s)": ("s", ""),
}


@pytest.mark.parametrize("heading", SAID)
def test_a_heading_is_a_name_and_a_unit(heading: str) -> None:
    name, unit = name_and_unit(heading)
    assert (concept(name), unit) == SAID[heading]


@pytest.mark.parametrize(
    ("word", "si"),
    [
        *(("ms", ("s", 1e-3)), ("MS", ("s", 1e-3)), ("\u00b5s", ("s", 1e-6)), ("\u03bcs", ("s", 1e-6)), ("Sec", ("s", 1.0))),
        *(("lbf", ("N", 4.4482216152605)), ("kgf", ("N", 9.80665)), ("daN", ("N", 10.0))),
        *(("mN", ("N", 1e-3)), ("MN", ("N", 1e6)), ("KN", ("N", 1e3)), ("Mn", None), ("mPa", ("Pa", 1e-3))),
        *(
            ("MPa", ("Pa", 1e6)),
            ("mpa", None),
            ("BAR", ("Pa", 1e5)),
            ("barg", None),
            ("", None),
            ("kg", None),
            ("%", ("1", 1e-2)),
        ),
    ],
)
def test_units_in_any_case_unless_they_could_be_two(word: str, si: tuple[str, float] | None) -> None:
    assert unit_of(word) == si


@pytest.mark.parametrize(
    "name",
    [
        *("temperature", "voltage", "valve_feedback", "fs", "flow", "offset", "factor", "file", "Foot", "x_f", "fft"),
        *("hand_position_x", "f_max"),
    ],
)
def test_what_is_like_no_force(name: str) -> None:
    assert not is_like_force(name, "")
