"""What follows from the declaration of a parameter: its field, its row in kernels, who reads it."""

from dataclasses import dataclass, fields
from types import SimpleNamespace

import numpy as np
import pytest

from birthsim_env.parts.drawn.randomization import SHARED, checked_ranges
from birthsim_env.physics.compiled import lanes
from birthsim_env.physics.rig.declaration import Prior, Section, derived, parameter
from birthsim_env.physics.rig.parameters import DECLARED, SECTIONS, Parameters, parameter_of
from birthsim_env.physics.rig.rows import RIG_ROWS, Substitute, parameters_read, plant_parameters, rows_of


@dataclass(frozen=True)
class Seal(Section, shared=True):
    """A seal."""

    width: float = parameter("m", "of the lip", default=2.0, source="assumed", above=0, most=5, range=(1, 3))
    kind: str = parameter("-", "its material", default="rubber", source="a drawing", choices=("rubber", "leather"))
    square = derived("m2", "width^2", lambda own: own.width * own.width)


def test_a_section_knows_what_is_declared_in_it() -> None:
    assert [one.name for one in fields(Seal)] == list(Seal.parameters) == ["width", "kind"]
    assert list(Seal.derived) == ["square"]
    assert all(one.shared for one in Seal.parameters.values())
    assert Seal(width=3).square == 9
    assert Seal.parameters["width"].allowed == "a finite number > 0 and <= 5 (m)"
    assert "- ``width`` = 2.0 (m): of the lip; assumed; 1 to 3" in str(Seal.__doc__)
    with pytest.raises(ValueError, match=r"Seal\.kind = 'felt' .*'rubber', 'leather'"):
        Seal(kind="felt")
    with pytest.raises(ValueError, match=r"Seal\.width = 0 .*> 0"):
        Seal(width=0)


def test_a_declaration_that_lacks_its_source_is_refused() -> None:
    with pytest.raises(TypeError, match="source"):
        parameter("m", "of the lip", default=2.0)  # type: ignore[call-arg]


@pytest.mark.parametrize(("prior", "value"), [(Prior(0.7), 3.0), (Prior(0.7, floor=1.0), 1.3), (Prior(1.0, scale=0.005), 0.0)])
def test_a_prior_has_a_coordinate_for_every_value(prior: Prior, value: float) -> None:
    assert prior.value(prior.coordinate(value)) == pytest.approx(value)


def test_rows_and_their_numbers_follow_from_the_declarations() -> None:
    names = [row.name for row in RIG_ROWS]
    assert names == list(lanes.PARAMETER_NAMES) == list(lanes.Rig.groups)
    assert len({name.upper() for name in names}) == len(names) == lanes.PARAMETERS
    assert [getattr(lanes, name.upper()) for name in names] == list(range(len(names)))
    # A row with the name of a state would have taken its place.
    assert [getattr(lanes, name.upper()) for name in lanes.STATE_NAMES] == list(range(lanes.STATES))


def test_every_number_of_the_plant_reaches_a_row() -> None:
    numbers = {name for name in DECLARED if not name.startswith("electronics.")}
    # One is an episode's, of the other gamma3 follows.
    assert numbers - plant_parameters() == {"mechanics.impact_speed", "linkage.inclination"}
    assert not any(name.startswith("electronics.") for name in plant_parameters())


def test_who_reads_what() -> None:
    rig = Parameters()
    assert parameters_read(lambda one: one.mechanics.mass + one.chambers.whole_dead_volume, rig) == {
        "mechanics.mass",
        *(f"chambers.{name}" for name in ("dead_volume", "tube_length", "tube_diameter")),
    }
    assert parameters_read(lambda one: one.cylinder1.area_p, rig) == {"cylinder1.piston_diameter"}


def test_rows_of_other_values_than_floats() -> None:
    mass = np.array([2.0, 4.0])
    rows = dict(
        zip(lanes.PARAMETER_NAMES, rows_of(Substitute(lambda name: mass if name == "mechanics.mass" else 0.25)), strict=True)
    )
    np.testing.assert_array_equal(rows["inverse_mass"], [0.5, 0.25])
    sections = {name: part for name, part in vars(Parameters()).items() if name in SECTIONS}
    assert rows_of(SimpleNamespace(**sections)) == rows_of(Parameters())


def test_what_is_shared_cannot_be_drawn() -> None:
    assert SHARED == ("linkage", "geometry", "electronics", "cylinder1.stroke", "cylinder2.stroke", "mechanics.impact_speed")
    assert parameter_of("geometry.k1").shared
    with pytest.raises(ValueError, match=r"randomize\['cylinder1\.stroke'\].*the same in all lanes"):
        checked_ranges({"cylinder1.stroke": (0.1, 0.2)}, Parameters())
