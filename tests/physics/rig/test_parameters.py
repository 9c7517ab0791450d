"""Parameters: every parameter has unit, source and limits; impossible rigs are refused by name; TOML files come back equal."""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from birthsim_build.fmu.description import exponents
from birthsim_env.physics.compiled.lanes import PARAMETER_NAMES, parameter_array, parameter_column
from birthsim_env.physics.rig.parameters import DECLARED, SECTIONS, Parameters, load_parameters, parameter_of, value_of
from tests.physics.rigs import LAWS


def test_every_parameter_has_unit_meaning_source_and_a_line_in_the_docstring() -> None:
    for dotted, one in DECLARED.items():
        section, _, name = dotted.partition(".")
        exponents(one.unit)  # of SI units
        assert min(len(one.about), len(one.source)) >= 4, dotted
        lines = (SECTIONS[section].__doc__ or "").splitlines()
        found = [f"({one.unit}): {one.about}; {one.source}" in line for line in lines if line.startswith(f"- ``{name}``")]
        assert found == [True], dotted
        assert parameter_of(dotted) is one


def test_ranges_are_ordered_and_possible() -> None:
    ranges = {name: one.range for name, one in DECLARED.items() if one.range}
    assert ranges["mechanics.mass"] == (2, 5)
    for name, (low, high) in ranges.items():
        assert low < high, name
        for end in (low, high):
            assert value_of(Parameters().replace({name: float(end)}), name) == end


def test_figures_of_table_1() -> None:
    """Bore 25 mm and rod 10 mm give the 295 N and 247 N of Table I at 6 bar gauge."""
    rig = Parameters()
    for cylinder in (rig.cylinder1, rig.cylinder2):
        assert 6e5 * cylinder.area_p == pytest.approx(295, abs=0.5)
        assert 6e5 * cylinder.area_n == pytest.approx(247, abs=0.6)
    assert (rig.cylinder1.stroke, rig.cylinder2.stroke) == (0.2, 0.4)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, "wide", None, True, [1.0]], ids=str)
def test_what_is_no_number_is_refused_by_the_name_of_every_field(value: Any) -> None:
    for dotted, one in DECLARED.items():
        section, _, name = dotted.partition(".")
        message = f"{type(SECTIONS[section]).__name__}.{name} = {value!r} is impossible; allowed: "
        with pytest.raises(ValueError, match="^" + re.escape(message)) as error:
            Parameters().replace({dotted: value})
        if not one.choices:
            assert f"({one.unit})" in str(error.value)


@settings(max_examples=25)
@given(mass=st.floats(2, 5), gamma3=st.floats(-3, 3), volume=st.floats(5e-6, 25e-6), law=st.sampled_from(LAWS))
def test_toml_file_gives_the_same_rig_back(tmp_path_factory: Any, mass: float, gamma3: float, volume: float, law: str) -> None:
    changes = {"mechanics.mass": mass, "geometry.gamma3": gamma3, "chambers.dead_volume": volume, "friction.law": law}
    rig, path = Parameters().replace(changes), tmp_path_factory.mktemp("rig") / "rig.toml"
    rig.to_toml(path)
    assert Parameters.from_toml(path) == load_parameters(str(path)) == rig
    assert Parameters.from_dict(rig.to_dict()) == rig


def test_toml_file_names_only_what_differs(tmp_path: Path) -> None:
    path = tmp_path / "laboratory.toml"
    path.write_text("[mechanics]\nmass = 4\n[friction]\nlaw = 'coulomb'\n")
    assert load_parameters(path) == Parameters().replace({"mechanics.mass": 4.0, "friction.law": "coulomb"})


def test_columns_of_the_kernels_follow_their_names() -> None:
    rig = Parameters().replace({"mechanics.mass": 4.5, "cylinder1.coulomb_friction": 10.0, "friction.static_ratio": 1.5})
    column = dict(zip(PARAMETER_NAMES, parameter_column(rig), strict=True))
    expected = {"mass": 4.5, "fc1": 10, "fc2": 11.7, "static_ratio": 1.5, "fp1": 5e-6, "k1": 0.43, "half_l2": 0.2, "gamma": 1.4}
    expected |= {"d_squares": 0.35**2 + 0.25**2, "d_product": 2 * 0.35 * 0.25, "perimeter1": math.pi * 0.025}
    expected |= {"leakage": 0.005 * 3.9e-9, "index": 1.2, "breakaway": 0.7, "steepness": 1 / 0.3}
    assert {name: column[name] for name in expected} == pytest.approx(expected, rel=1e-14)
    for law in (*LAWS, "gms"):
        column = dict(zip(PARAMETER_NAMES, parameter_column(rig.replace({"friction.law": law})), strict=True))
        assert (column["lugre"], column["gms"], column["bristled"]) == (law == "lugre", law == "gms", law != "coulomb")
    both = parameter_array([Parameters(), rig], 2)
    np.testing.assert_array_equal(both, np.stack([parameter_column(Parameters()), parameter_column(rig)], axis=1))
    np.testing.assert_array_equal(parameter_array(rig, 3), np.repeat(both[:, 1:], 3, axis=1))
