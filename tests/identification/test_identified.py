"""What an identification says of the rig that it found."""

from types import SimpleNamespace

import numpy as np
import pytest

from baselines.identification.fit.laws import Laws
from baselines.identification.identified import Identified, Row
from baselines.identification.windows.force_offset import ForceOffset
from baselines.identification.windows.starts import Noise
from birthsim_env.physics.rig.parameters import Parameters

NOISE = Noise(500.0, 1e-4)
NO_FORCE = ForceOffset(np.array([0.2, 0.9]), np.array([0.01, 0.3]))


FOUND = Laws("lugre", "lugre", {"lugre": 1.0, "coulomb": 0.0, "elasto_plastic": 0.0}, 19)


def made(
    rows=(),
    noise=NOISE,
    pull=NO_FORCE,
    biases=(0.0, 900.0, -4000.0, 5000.0),
    ended=True,
    left=(1.0, 0.9, 1.1, 1.0),
    laws=FOUND,
):
    fit = SimpleNamespace(problem=SimpleNamespace(offsets=SimpleNamespace(biases=biases)), ended=ended)
    certainty = SimpleNamespace(weakest=())
    notes = ("left out: a row",)
    return Identified(rows, Parameters(), fit, certainty, noise, NOISE, notes, pull, np.array(left), laws)  # type: ignore[arg-type]


def said(name, value, determined=True):
    """Lines about controllers that are tuned for other rigs, where one figure was found."""
    found = made((Row(name, 3.0, value, 0.9 * value, 1.1 * value, determined),))
    return [line for line in found.words() if "tuned" in line]


def warned(**differences):
    """Lines that a good fit lacks."""
    good = made().words()
    return [
        line
        for line in made(**differences).words()
        if line not in good and "residuals over" not in line and "noise of" not in line
    ]


def test_causes_of_a_bad_fit_are_named():
    (line,) = warned(noise=Noise(600.0, 1e-4))
    assert "offset of the force sensor" in line
    (line,) = warned(pull=ForceOffset(np.array([-3.0, 0.5]), np.array([0.1, 0.1])))
    assert "a constant force of (-3, 0.5) N acts on the rig" in line
    (line,) = warned(biases=(0.0, -95e3, 0.0, 0.0))
    assert line.startswith("pressures_N1 seems to be 9.5e+04 Pa too low")
    (line,) = warned(left=(1.05, 1.0, 1.1, 1.6))
    assert line.startswith("pressures_N2 fit worse")
    assert "[valve_n2]" in line
    (line,) = warned(ended=False)
    assert "evaluations" in line


def test_a_friction_law_is_named_with_how_sure_it_is():
    line, believed = warned(laws=Laws("lugre", "elasto_plastic", {"lugre": 0.004, "coulomb": 0.0, "elasto_plastic": 0.996}, 19))
    assert line.startswith("friction.law = elasto_plastic, probability 0.996: lugre and coulomb predict ")
    assert line.endswith("(19 windows); was lugre")
    assert believed.startswith("controllers believe the presliding of lugre, whatever friction.law is")
    (line,) = warned(laws=Laws("lugre", "lugre", {"lugre": 0.3, "coulomb": 0.0, "elasto_plastic": 0.7}, 19))
    assert line.startswith("friction.law = lugre, KEPT: the log cannot tell lugre 0.30, elasto_plastic 0.70 apart; coulomb ")
    line, _ = warned(laws=Laws("lugre", "coulomb", {}, 0))
    assert line == "friction.law = coulomb, as given: no other law was tried"


def test_a_bad_fit_of_the_motion_says_that_no_friction_law_fits():
    (line,) = warned(noise=Noise(500.0, 1.3e-4))
    assert "in the positions: another law of friction (none of lugre, coulomb and elasto_plastic fits; not tried: " in line
    assert "--friction-law gms), friction along the stroke" in line


def test_what_was_left_out_stands_in_the_file_of_the_rig(tmp_path):
    made().write(tmp_path / "rig.toml", "log.csv")
    assert (tmp_path / "rig.toml").read_text().splitlines()[1] == "# left out: a row"


@pytest.mark.parametrize(
    ("name", "inside", "outside"),
    [
        ("mechanics.mass", (2.0, 5.0), (1.4, 7.0)),
        ("electronics.position_latency", (0.002, 0.015), (0.018,)),
        ("valves.time_constant", (0.0012, 0.008), (0.012,)),
    ],
)
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
