"""What an identification says of the rig that it found."""

from types import SimpleNamespace

import pytest

from baselines.identification.identified import Identified, Row
from baselines.identification.starts import Noise
from birthsim_env.physics.rig.parameters import Parameters

NOISE = Noise(500.0, 1e-4)


def said(name, value, determined=True):
    """Lines about controllers that are tuned for other rigs, where one figure was found."""
    row = Row(name, 3.0, value, 0.9 * value, 1.1 * value, determined)
    found = Identified((row,), Parameters(), None, SimpleNamespace(weakest=()), NOISE, NOISE)  # type: ignore[arg-type]
    return [line for line in found.words() if "tuned" in line]


@pytest.mark.parametrize(("name", "inside", "outside"), [
    ("mechanics.mass", (2.0, 5.0), (1.4, 7.0)),
    ("electronics.position_latency", (0.002, 0.015), (0.018,)),
    ("valves.time_constant", (0.0015, 0.008), (0.012,)),
])  # fmt: skip
def test_a_rig_for_which_no_controller_is_tuned_is_named(name, inside, outside):
    for value in inside:
        assert said(name, value) == []
    for value in outside:
        (line,) = said(name, value)
        assert line.startswith(f"{name} is outside {inside[0]:g} to {inside[1]:g} ")
        assert "--parameters" in line
        assert said(name, value, determined=False) == [], "what the log does not tell is the owner's"


def test_the_bore_has_no_range_that_could_be_left():
    assert said("cylinder1.piston_diameter", 0.05) == []
