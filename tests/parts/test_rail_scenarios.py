"""Scenarios of one cylinder: places, pushes and setpoints along any rail, and a hand that holds the carriage."""

import math

import numpy as np
import pytest

import birthsim
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.parts.position_steps import PositionSteps
from birthsim_env.parts.scenarios import find_scenario
from birthsim_env.physics.rig.parameters import Parameters

TILT = math.radians(50.0)
ALONG = np.array([math.cos(TILT), math.sin(TILT)])
BENCH = Parameters().replace(
    {"linkage.kind": "rail", "linkage.inclination": TILT, "cylinder2.stroke": 0.3, "geometry.k2": 0.6, "mechanics.mass": 5.0}
)
"""A bench with another stroke, farther from its pivot, on a slope."""


def motion(trajectory, times, seed=0):
    """Rows (8, len(times)) of one lane."""
    trajectory.prepare(1)
    trajectory.begin(0, stream(seed, 0, "reference"))
    return np.stack([trajectory.sample(np.array([t]))[:, 0] for t in times], axis=1)


def test_steps_go_to_their_places_at_minimum_jerk_and_rest():
    rows = motion(find_scenario("rail-steps").on(BENCH).nominal()[0], np.linspace(0.0, 16.0, 1601))
    times, gone = np.linspace(0.0, 16.0, 1601), ALONG @ rows[:2] - 0.6
    np.testing.assert_allclose(rows[:2], np.outer(ALONG, gone + 0.6), atol=1e-12)
    places = 0.3 * np.array([0.0, 0.2, -0.2, 0.05, 0.0625, 0.0])
    for k, start in enumerate((1.0, 4.0, 7.0, 10.0, 13.0)):
        u = np.clip(times - start, 0.0, 1.0)
        move = (times >= start) & (times < start + 3.0)
        expected = places[k] + (places[k + 1] - places[k]) * (10 * u**3 - 15 * u**4 + 6 * u**5)
        np.testing.assert_allclose(gone[move], expected[move], atol=1e-12)
        rests = (times > start + 1.0) & (times < start + 3.0)
        np.testing.assert_array_equal(rows[2:, rests], 0.0)
    np.testing.assert_allclose(gone[times < 1.0], 0.0, atol=1e-12)


def test_stiffness_steps_while_the_push_holds_along_the_rail():
    target, hand, schedule = find_scenario("rail-stiffness").on(BENCH).nominal()
    times = np.linspace(0.0, 17.0, 1701)
    np.testing.assert_allclose(motion(target, times)[:2], np.outer(0.6 * ALONG, np.ones(1701)))
    hand.prepare(1)
    hand.begin(0, stream(0, 0, "user_force"))
    pushes = hand.force(times[:, None], np.zeros((2, 1)), np.zeros((2, 1)))[:, :, 0]
    np.testing.assert_allclose(pushes, 30.0 * np.outer(np.clip(times - 1.0, 0.0, 1.0), ALONG), atol=1e-9)
    schedule.prepare(1)
    schedule.begin(0, stream(0, 0, "stiffness"))
    asked = [schedule.sample(np.array([t]))[0, 0] for t in (0.0, 4.99, 5.0, 8.99, 9.0, 12.99, 13.0, 17.0)]
    assert asked == [1000.0, 1000.0, 2000.0, 2000.0, 4000.0, 4000.0, 2000.0, 2000.0]


@pytest.mark.parametrize("name", ["Rail", "RailSteps", "RailStiffness"])
def test_every_drawn_episode_of_a_bench_stays_within_its_stroke(name):
    env = birthsim.make_vec(f"BirthSIM/{name}-v0", 128, parameters=BENCH, randomize="scenario")
    env.reset(seed=0)
    trajectory = env.unwrapped.simulation.trajectory
    for t in np.linspace(0.0, 17.0, 341):
        gone = ALONG @ trajectory.sample(np.full(128, t))[:2] - 0.6
        assert np.abs(gone).max() < 0.15 * (0.52 if t < 17.0 else 1.0)


def test_the_spring_gives_way_as_it_is_asked_to():
    """Where the carriage is after each step of stiffness, from its positions alone: force over stiffness."""
    env = birthsim.make_vec("BirthSIM/RailStiffness-v0", 1, parameters=BENCH, policy_period=0.001)
    law, gone = birthsim.make_controller("admittance", BENCH), []
    env.reset(seed=0)
    for k in range(17_000):
        *_, info = env.step(law.command(env.unwrapped.measurement, env.unwrapped.reference)[2:].T)
        if k in (4900, 8900, 12_900, 16_900):
            gone.append(float(ALONG @ info["position"][0]) - 0.6)
    np.testing.assert_allclose(gone, [0.03, 0.015, 0.0075, 0.015], rtol=0.03)


def test_a_hand_of_the_package_holds_the_carriage():
    """The hand ``guided`` moves the carriage by its own springs, against the target that stays, and feels only the rail."""
    still = birthsim.FixedTarget(tuple(0.6 * ALONG))
    found = birthsim.evaluate(
        "BirthSIM/Rail-v0", "admittance", episodes=2, progress=False, parameters=BENCH, reference=still, user_force="guided"
    )
    env = birthsim.make("BirthSIM/Rail-v0", parameters=BENCH, reference=still, user_force="guided")
    env.reset(seed=0)
    felt = [env.step(np.zeros(2, np.float32))[4] for _ in range(400)]
    pushes = np.array([info["user_force"] for info in felt])
    assert np.abs(pushes @ ALONG).max() > 1.0
    np.testing.assert_allclose(pushes @ [-ALONG[1], ALONG[0]], 0.0, atol=1e-9)
    assert found.metrics["error_max_x"][0] > 1.0


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"middle": 0.5}, ("middle", "0.5", "(x, y)")),
        ({"starts": ()}, ("starts", "an entry per move")),
        ({"places": (0.1, 0.2)}, ("places", "(0.1, 0.2)", "1")),
        ({"starts": (1.0, 1.5), "places": (0.1, 0.0)}, ("starts", "(1.0, 1.5)", "1.0")),
        ({"lasts": 0.0}, ("lasts", "0.0", "0.001")),
        ({"places": ("far",)}, ("places", "far")),
    ],
)
def test_steps_that_cannot_be_are_refused_by_name(arguments, named):
    with pytest.raises(ValueError, match=named[0]) as refused:
        PositionSteps(**arguments)
    assert all(word in str(refused.value) for word in named)
