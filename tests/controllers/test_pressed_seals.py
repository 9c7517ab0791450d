"""What controllers believe of friction is its level at the pressures that they measure."""

import numpy as np
import pytest

from baselines.named import make_controller, uncontrolled_names
from birthsim_env import Parameters, Plant
from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.registry import names
from tests.oracles import closed_loop
from tests.oracles import derived_law as derived

LEVEL, GROWTH = 4.0, 5e-6
FELT = Parameters().replace({"electronics.acceleration_bandwidth": 300.0})
SENSORLESS = "admittance[force_sensor=false,identified=true]"
LAWS = [*(name for name in names("controller") if name not in {"admittance", *uncontrolled_names()}), SENSORLESS]
WITHOUT = {"air-spring"}
"""Controllers that do not look at friction."""

START = Plant(FELT)
START.state = balanced_state(START.lane_parameters, np.zeros((2, 1)), np.full((2, 1), 0.05), closed_loop.PNEUMATIC_STIFFNESS)
PRESSURES = START.pressures
GAUGE = (PRESSURES - FELT.air.atmospheric_pressure)[:, 0]


def rig(*levels: float, growth: float = 0.0, asymmetry: float = 0.0) -> Parameters:
    changes = {}
    for k, level in enumerate(levels, 1):
        each = {"coulomb_friction": level, "pressure_friction": growth, "direction_asymmetry": asymmetry}
        changes |= {f"cylinder{k}.{name}": value for name, value in each.items()}
    return FELT.replace(changes)


def commands(name: str, believed: Parameters) -> np.ndarray:
    """Openings (T, 4) while both pistons go outwards as they should, with chambers that carry them."""
    law, found = make_controller(name, believed), []
    for k in range(60):
        speed = np.full((2, 1), 0.05)
        measured = derived.seen(speed * 1e-3 * k, speed, PRESSURES, believed)
        wanted = closed_loop.holding(measured.position, 2000.0)
        wanted.rows[2:4] = measured.velocity
        found.append(law.command(measured, wanted)[:, 0])
    return np.array(found)


@pytest.mark.parametrize("name", LAWS)
def test_a_controller_believes_the_level_at_the_pressures_and_of_the_way(name: str) -> None:
    pressed = LEVEL + GROWTH * (GAUGE[::2] + GAUGE[1::2])
    there = commands(name, rig(*pressed))
    for believed in (rig(LEVEL, LEVEL, growth=GROWTH), rig(*[LEVEL / 1.25] * 2, growth=GROWTH / 1.25, asymmetry=0.25)):
        np.testing.assert_allclose(commands(name, believed), there, rtol=1e-6, atol=1e-9)
    assert np.array_equal(commands(name, rig(LEVEL, LEVEL)), there) == (name in WITHOUT)
