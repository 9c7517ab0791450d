"""The adaptive law and the one without a force sensor."""

from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from baselines.admittance.rows import Constants, Memory
from baselines.bench.evaluation import evaluate
from baselines.named import make_controller
from birthsim_env.parts.drawn.randomization import documented_ranges
from birthsim_env.physics.rig.parameters import Parameters
from lab.studies.comparison.grid import as_described
from lab.studies.honest.sensor_floor import circle_floor, motion_floor, probe_floor
from tests.oracles import closed_loop

RIG = Parameters()


def openings(name, sensors, believed=RIG, rig=RIG, shown=lambda seen: {}, **gains):
    """Openings (120, 4, 3) of a law on the circle; ``shown(seen)`` is what it is shown instead."""
    law = make_controller(name, believed, **gains)
    env = gymnasium.make_vec(
        "BirthSIM/Circle-v2", num_envs=3, sensors=sensors, policy_period=0.001, randomize=True, parameters=rig
    )
    env.reset(seed=[40, 41, 42])
    told = []
    for _ in range(120):
        told.append(law.command(replace(env.measurement, **shown(env.measurement)), env.reference))
        env.step(told[-1].T)
    env.close()
    return np.array(told)


def test_with_exact_sensors_and_no_rate_it_is_the_law_that_does_not_learn():
    np.testing.assert_array_equal(
        openings("admittance-adaptive", "ideal", friction_rate=0.0), openings("admittance-backstepping", "ideal")
    )


@pytest.mark.parametrize("factor", [0.5, pytest.param(1.6, marks=pytest.mark.slow)])
def test_friction_that_is_not_as_believed_is_learned_on_a_circle(factor):
    true = closed_loop.slippery(factor)
    law = make_controller("admittance-adaptive", RIG)
    result = evaluate("BirthSIM/Circle-v2", law, "adaptive", 1, 0, progress=False, parameters=true)
    levels = Memory(law._memories[0]).friction.level[:, 0]
    assert not result.lost[0]
    np.testing.assert_allclose(levels, factor, rtol=0.2)


def exact(**electronics):
    """A rig whose honest sensors have only these errors of scale and place."""
    names = ("force_gain_error", "force_crosstalk", "position_distortion", "position_scale_error")
    return RIG.replace({f"electronics.{name}": electronics.get(name, 0.0) for name in names})


def test_floor_of_a_scale_error_is_that_error_and_of_none_nothing():
    """x shown = x + s (x - registration): the place moves by 1/(1 + s) of what is asked for."""
    assert all(np.abs(values).max() < 1e-9 for values in probe_floor(exact(), 4, 0).values())
    floor = np.abs(probe_floor(exact(position_scale_error=0.01), 16, 0)["stiffness_error"])
    assert 0.6 < floor.max() <= 1.2  # drawn within 20 % of 1 %, times a number in [-1, 1)


def test_sensors_as_described_are_the_same_in_all_worlds():
    rig = as_described(Parameters().replace({"electronics.force_bias": 0.5}))
    drawn = documented_ranges(rig, "honest")
    assert drawn["electronics.force_bias"] == (0.5, 0.5)
    assert drawn["electronics.position_noise"] == (1e-4, 1e-4)
    assert drawn["mechanics.mass"] == documented_ranges(Parameters(), "honest")["mechanics.mass"]


def moving(rig, lanes):
    """``motion_floor`` (lanes,), mm, of the worlds of ``circle_floor``."""
    world = {"parameters": rig, "sensors": "honest", "randomize": True}
    env = gymnasium.make_vec("BirthSIM/CircleResidual-v2", num_envs=lanes, **world)
    found = motion_floor(env, rig, 0)
    env.close()
    return found


@pytest.mark.slow
def test_on_circles_a_scale_and_a_gain_leave_their_share():
    """Scale s: the distance from the registration times s/(1 + s); gain g: g times the displacement asked for; else nothing."""
    assert np.abs(circle_floor(exact(), 4, 0)).max() < 1e-9
    scaled = circle_floor(exact(position_scale_error=0.01), 16, 0)
    assert scaled.min() > 0.0
    assert scaled.max() < 0.012 * 400.0, "places are within 400 mm of the registration"
    assert moving(exact(), 4).max() < 1e-9
    assert moving(exact(position_scale_error=0.01), 16) == pytest.approx(scaled, rel=0.1), "a mass moves it by millimetres"
    gained = circle_floor(exact(force_gain_error=0.01), 16, 0)
    assert 0.0 < gained.max() < 0.03 * 1e3 * 40.0 / 500.0, "40 N at 500 N/m, 1 % drawn up to threefold"


@pytest.mark.parametrize(("seed", "most"), [(396, 20.0), (642, 10.0)])
def test_a_noisy_late_tracker_makes_no_lasting_swing(seed, most):
    """Worlds in which a gain that fell to 0.35 of itself made the head swing by 118 and 22 mm; now it is 8 and 3 mm or so."""
    law = make_controller("admittance-adaptive", Parameters())
    found = evaluate("BirthSIM/Probe-v3", law, "adaptive", 1, seed, progress=False, sensors="honest", randomize=True).metrics
    assert max(found["hunting_x"][0], found["hunting_y"][0]) < most


def test_a_head_heavier_than_five_kilograms_rests_with_less_gain():
    """By how much, the law's own test says."""

    def told(name, sampled, **gains):
        found = Constants(make_controller(name, RIG, **gains).controller_stages(sampled)[0].constants).gains
        return found.rest_gain, found.heavy

    anything = 1e9
    assert told("admittance-adaptive", True) == (36.0, 5.0)
    assert told("admittance-adaptive", True, rest_gain=50.0) == (50.0, anything), "a gain that is asked for is what it has"
    assert told("admittance-adaptive", False) == (90.0, anything)
    assert told("admittance-sensorless", True) == (45.0, anything)


def test_known_friction_lets_the_head_rest_without_a_force_sensor() -> None:
    """Rows of issue 32, honest sensors, the rig known: within 4 % of the stiffness, 0.2 mm at rest, 25 l/min of air."""
    law = make_controller("admittance[force_sensor=false,identified=true]", RIG)
    found = evaluate("BirthSIM/Probe-v3", law, "identified", 16, 91_000, progress=False, sensors="honest", randomize=False)
    figures = {name: found.summary()[name]["median"] for name in ("stiffness_error", "unrest", "air")}
    assert abs(figures["stiffness_error"]) < 4.0
    assert figures["unrest"] < 0.2
    assert figures["air"] < 25.0
    assert not any(found.lost)
