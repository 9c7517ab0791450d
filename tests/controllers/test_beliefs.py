"""Beliefs of each lane: a lane that is told a rig is the controller made with that rig, and goes over to another one softly."""

from contextlib import closing
from typing import Any

import gymnasium
import numpy as np
import pytest

from baselines.admittance import belief
from baselines.admittance.rows import Memory
from baselines.driving import driving
from baselines.named import make_controller
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage.geometry import end_effector
from birthsim_env.physics.rig.parameters import Parameters, load_parameters

OTHER = {
    "mechanics.mass": 6.5,
    "air.supply_pressure": 5.5e5,
    "cylinder1.piston_diameter": 0.028,
    "cylinder2.coulomb_friction": 20.0,
    "valves.time_constant": 0.006,
    "chambers.dead_volume": 2e-5,
}
OTHER_TRACKER = Parameters().replace({"electronics.position_noise": 2e-3})
OTHER_FRICTION = Parameters().replace({"friction.law": "gms"})

KINDS = [
    ("", "ideal", None),
    ("", "honest", None),
    ("learn=false", "lab", None),
    ("force_sensor=false", "lab", None),
    ("force_sensor=false", "honest", "examples/acceleration_sensor_rig.toml"),
    ("force_sensor=false,identified=true", "lab", None),
]


def openings(law: Any, rig: Parameters, sensors: str, lanes: int, steps: int = 60) -> Array:
    """Openings (steps, 4, lanes) at the ends of control periods of Probe with a hand, in equal worlds."""
    env: Any = gymnasium.make_vec(
        "BirthSIM/Probe-v3", num_envs=lanes, sensors=sensors, parameters=rig, policy_period=0.001, actuation=driving(law, None)
    )
    with closing(env):
        env.reset(seed=[11] * lanes)
        found = []
        for _ in range(steps):
            env.step(np.zeros(env.action_space.shape, dtype=np.float32))
            found.append(env.unwrapped.simulation.openings.copy())
        return np.array(found)


def named(options: str) -> str:
    return f"admittance[{options}]" if options else "admittance"


@pytest.mark.parametrize(("options", "sensors", "file"), KINDS)
def test_a_lane_that_is_told_a_rig_has_the_bits_of_a_controller_made_with_it(options, sensors, file):
    rig = load_parameters(file)
    other = rig.replace(OTHER)
    law: Any = make_controller(named(f"{options},own_beliefs=true".lstrip(",")), rig)
    law.believe([rig, other])
    both = openings(law, rig, sensors, 2)
    for lane, own in enumerate((rig, other)):
        alone = openings(make_controller(named(options), own), rig, sensors, 1)
        np.testing.assert_array_equal(both[:, :, lane], alone[:, :, 0])


def test_untold_lanes_have_the_bits_of_the_law():
    rig = Parameters()
    plain, own = (
        openings(make_controller(name, rig), rig, "honest", 3) for name in ("admittance", "admittance[own_beliefs=true]")
    )
    np.testing.assert_array_equal(plain, own)


class Driven:
    """A law with beliefs in two lanes that carry out the same Probe, one period after the other."""

    def __init__(self, sensors: str = "lab") -> None:
        self.law: Any = make_controller("admittance[own_beliefs=true]")
        self.env: Any = gymnasium.make_vec(
            "BirthSIM/Probe-v3", num_envs=2, sensors=sensors, policy_period=0.001, actuation=driving(self.law, None)
        )
        self.env.reset(seed=[5, 5])

    def run(self, periods: int) -> Array:
        found = []
        for _ in range(periods):
            self.env.step(np.zeros(self.env.action_space.shape, dtype=np.float32))
            found.append(self.env.unwrapped.simulation.openings.copy())
        return np.array(found)


def test_a_lane_goes_over_to_what_it_is_told_as_the_low_pass_says_and_without_a_jump():
    driven = Driven()
    with closing(driven.env):
        before = driven.run(300)
        assert (before[:, :, 0] == before[:, :, 1]).all()
        # A third more mass and a fifth less supply: a controller made with these would begin with other openings.
        driven.law.believe(Parameters().replace({"mechanics.mass": 4.0, "air.supply_pressure": 5.6e5}), np.array([False, True]))
        after = driven.run(50)
        left = np.exp(-50 * 0.001 / belief.TIME)
        np.testing.assert_allclose(driven.law.believed("mass"), [3.0, 4.0 - left], rtol=1e-12)
        usual = np.abs(np.diff(before[-100:], axis=0)).max()
        assert np.abs(after[0, :, 1] - after[0, :, 0]).max() < usual, "less than openings change anyway from period to period"
        assert (after[-1, :, 0] != after[-1, :, 1]).any(), "what is told matters"
        driven.law.reset(np.array([False, True]))
        assert driven.law.believed("mass").tolist() == [3.0, 4.0], "a lane begins anew with what it was told"


@pytest.mark.parametrize("mass", [1.5, 2.0, 4.5, 6.0])
def test_a_resting_head_that_is_said_to_be_heavier_or_lighter_does_not_stir_the_valves(mass):
    """What the weight explains less, the observers explain more, at once: no opening notices a weight that is told wrongly."""
    driven = Driven("honest")
    with closing(driven.env):
        before = driven.run(500)
        driven.law.believe(Parameters().replace({"mechanics.mass": mass}), np.array([False, True]))
        after = driven.run(20)
        usual = np.abs(np.diff(before[-100:], axis=0)).max()
        # Without it 1.4 to 3 times as much in the first period; what is left is the loop, which moves another mass.
        assert np.abs(after[0, :, 1] - after[0, :, 0]).max() < 0.5 * usual


def test_what_a_rig_explains_less_of_the_acceleration_the_observer_explains_more():
    """At rest, of a piston's acceleration only the force of its chambers depends on the mass, by F/(m kappa^2)."""
    rig = Parameters()
    driven = Driven("ideal")
    with closing(driven.env):
        driven.run(500)
        driven.law.believe(rig.replace({"mechanics.mass": 2.0}), np.array([False, True]))
        driven.run(1)
        memory = Memory(driven.law._memories[-1])
        now = driven.law.believed("mass")[1]
        pressure = memory.chambers.pressure[:, 1] - rig.air.atmospheric_pressure
        places = memory.joints.position[:, 1] + 1e-6 * np.array([[-1.0, 0.0], [1.0, 0.0]])
        kappa = np.linalg.norm(np.diff([end_effector(place, rig) for place in places], axis=0)) / 2e-6
        area = np.pi / 4 * np.array([rig.cylinder1.piston_diameter**2, rig.cylinder2.piston_diameter**2])
        rod = np.pi / 4 * np.array([rig.cylinder1.rod_diameter**2, rig.cylinder2.rod_diameter**2])
        force = area * pressure[::2] - (area - rod) * pressure[1::2]
        untold, told = memory.pistons.disturbance.T
    np.testing.assert_allclose(told - untold, force * (1 / 3.0 - 1 / now) / np.array([kappa**2, 1.0]), rtol=2e-3, atol=1e-5)


def test_a_lane_that_is_told_a_rig_forgets_the_level_of_friction_that_it_had_learned():
    driven = Driven()
    with closing(driven.env):
        driven.run(20)
        memory = Memory(driven.law._memories[-1])
        memory.friction.level[:] = 1.8  # nothing slides, so that nothing is learned meanwhile
        driven.law.believe(Parameters().replace({"cylinder2.coulomb_friction": 15.0}), np.array([False, True]))
        driven.run(50)
        left = np.exp(-50 * 0.001 / belief.TIME)
        np.testing.assert_allclose(Memory(driven.law._memories[-1]).friction.level, [[1.8, 1.0 + 0.8 * left]] * 2, rtol=1e-12)


def test_each_lane_declares_the_mass_that_it_believes_in():
    law: Any = make_controller("admittance[own_beliefs=true]")
    law.believe([Parameters(), Parameters().replace({"mechanics.mass": 5.0})])
    driven = Driven()
    with closing(driven.env):
        mass = law.declared_impedance(driven.env.unwrapped.reference).mass
    np.testing.assert_array_equal(mass[0, 0], [3.0, 5.0])


@pytest.mark.parametrize(
    ("options", "arguments", "words"),
    [
        ("", (Parameters(),), ("own_beliefs", "True")),
        ("own_beliefs=true", ([Parameters()] * 2, np.array([True, False])), ("rig has 2", "1 lanes")),
        ("finds_rig=true", (Parameters(),), ("finds_rig", "own_beliefs = True alone")),
        ("own_beliefs=true", ("rig.toml",), ("rig", "a Parameters")),
        ("own_beliefs=true", ([],), ("rig", "one for each lane")),
        ("own_beliefs=true", (Parameters(), np.array([1.0, 0.0])), ("lanes", "True or False")),
        ("own_beliefs=true", (OTHER_TRACKER,), ("electronics.position_noise", "0.0001")),
        ("own_beliefs=true", (OTHER_FRICTION,), ("friction.law", "'lugre'")),
    ],
)
def test_what_cannot_be_believed_is_refused_by_name(options, arguments, words):
    law: Any = make_controller(named(options))
    with pytest.raises(ValueError, match=words[0]) as refusal:
        law.believe(*arguments)
    assert all(word in str(refusal.value) for word in words)


@pytest.mark.parametrize(
    ("options", "rig", "words"),
    [
        ("finds_rig=true,force_sensor=false", None, ("finds_rig", "force_sensor is True")),
        ("finds_rig=true", {"cylinder1.viscous_friction": 0.0}, ("cylinder1.viscous_friction", "more than 0")),
        ("finds_rig=true", {"linkage.kind": "rail"}, ("finds_rig", "two cylinders")),
        ("finds_rig=maybe", None, ("finds_rig", "True or False")),
    ],
)
def test_a_rig_is_found_only_where_it_can_be(options, rig, words):
    with pytest.raises(ValueError, match=words[0]) as refusal:
        make_controller(named(options), Parameters().replace(rig or {}))
    assert words[1] in str(refusal.value)
