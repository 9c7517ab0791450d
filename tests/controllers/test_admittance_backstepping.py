"""The law behind the admittance: the jerk that it gives, resting pistons, gains at rest, valve lead, and gains that yield."""

import numpy as np
import pytest

from baselines.admittance import law as admittance_law
from baselines.admittance.controller import LEAST_FRACTION
from baselines.admittance.estimator import fresh_memory
from baselines.admittance.rows import Estimate, Gains, Memory
from baselines.estimation.observers import assumed_parameters
from baselines.estimation.rows import AssumedParameters
from birthsim_env.loop.rows import Seen
from birthsim_env.loop.signals import Measurement
from birthsim_env.physics.compiled.lanes import SPOOLS, Array
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.servovalves import LINEAR
from tests.oracles import linkage_by_points as by_points
from tests.oracles import rigid_body
from tests.oracles.closed_loop import AT_ONCE
from tests.physics.rigs import TILTED

PERIOD = 1e-3

RIG = Parameters().replace(AT_ONCE)
"""Its openings let through what the law wants."""


def remembered(lanes: int) -> Memory:
    """The memory of a law that has just started."""
    return Memory(np.repeat(fresh_memory(Parameters(), False)[:, None], lanes, axis=1))


REST = {
    "pneumatic_gain": 30.0, "gain": 60.0, "rest_gain": 60.0, "rest_push": 1.0, "dead_zone": 0.0, "oscillation": 0.06,
    "heavy": 1e9, "swing": 0.0, "yielding": 0.9, "least_fraction": LEAST_FRACTION, "most_falls": 1.0,
}  # fmt: skip
"""Gains of a law of which nothing is under test."""


def commanded(
    rig,
    now,
    motion,
    user=0.0,
    unseen=0.0,
    memory=None,
    told=0.0,
    spools=0.0,
    rest=0.0,
    moving=1.0,
    pneumatic=None,
    lead_time=None,
    **gains,
):
    """Openings (4, N) of the kernel; without ``lead_time`` and with shut spools they are those that the law wants."""
    lanes = motion.shape[1]
    seen, estimate = Seen(np.zeros((Seen.size, lanes))), Estimate(np.zeros((Estimate.size, lanes)))
    memory = remembered(lanes) if memory is None else memory
    memory.inertia.mass[:], estimate.inputs.inverse_mass[:] = rig.mechanics.mass, 1.0 / rig.mechanics.mass
    seen.asked.rows[10:14] = np.concatenate([now.stiffness, 0 * now.stiffness]) if pneumatic is None else pneumatic
    memory.joints.position[:], memory.joints.speed[:], memory.chambers.pressure[:] = now.piston, now.speed, now.pressures
    memory.chambers.spool[:], memory.pistons.rest[:], seen.feedforward.rows[:] = spools, rest, told
    estimate.motion.rows[:], estimate.inputs.force[:], estimate.unseen[:], estimate.inputs.moving[:] = (
        motion,
        user,
        unseen,
        moving,
    )
    # A spool that follows as fast as it does by itself is told where to go, no further.
    quickness = 1 - np.exp(-PERIOD / (lead_time or rig.valves.time_constant))
    numbers = Gains.numbers(quickness=quickness, **(REST | gains))
    admittance_law.command(seen, memory, estimate, Gains(numbers), AssumedParameters(assumed_parameters(rig)))
    return seen.opening


def near(now: rigid_body.Instant, rig: Parameters, user: Array, seed: int, fraction: float = 1.0) -> tuple[Array, Measurement]:
    """A motion (8, N) that the rig nearly has."""
    rng, measured = np.random.default_rng(seed), rigid_body.seen(now, rig, user)
    motion = fraction * np.repeat([1e-4, 2e-3, 0.3, 10.0], 2)[:, None] * rng.uniform(-1, 1, (8, user.shape[1]))
    motion[:2] += measured.position
    motion[2:4] += measured.velocity
    return motion, measured


@pytest.mark.parametrize("rig", [RIG, TILTED.replace(AT_ONCE)], ids=["default", "another rig"])
@pytest.mark.parametrize("fraction", [0.0, 1.0], ids=["told of nothing", "told of forces"])
def test_the_end_effector_gets_the_jerk_that_the_law_states(rig: Parameters, fraction: float) -> None:
    """j = jr - 3 c (a - ar) - (3 c^2 + 2)(v - vr) - (c^3 + 2 c)(x - xr), a with what is unseen and with what it is told."""
    lanes, c, rng = 60, 60.0, np.random.default_rng(2)
    now = rigid_body.near_balance(rig, lanes, seed=0, speed=0.05, push=4.0)
    user, disturbance_force = rng.uniform(-4, 4, (2, lanes)), rng.uniform(-4, 4, (2, lanes))
    told = fraction * np.concatenate([rng.uniform(-4, 4, (2, lanes)), rng.uniform(-200, 200, (2, lanes))])
    motion, measured = near(now, rig, user, seed=1)
    openings = commanded(rig, now, motion, user, disturbance_force, told=told, gain=c)
    free = rigid_body.rendered(openings, rig)
    assert free.sum() > 0.7 * lanes
    a, jerk = rigid_body.acceleration_and_jerk(openings, now, rig, disturbance_force + told[:2], user)
    growing = by_points.newton_force(rigid_body.pose_of(now.piston, rig), now.piston[1] + rig.geometry.k2, *told[2:])
    wanted = motion[6:8] - 3 * c * (a - motion[4:6]) - (3 * c**2 + 2) * (measured.velocity - motion[2:4])
    wanted -= (c**3 + 2 * c) * (measured.position - motion[:2])
    jerk += growing / rig.mechanics.mass
    np.testing.assert_allclose(jerk[:, free], wanted[:, free], rtol=1e-6, atol=1e-5 * np.abs(wanted).max())


@pytest.mark.parametrize("cylinder", [0, 1])
@pytest.mark.parametrize(("resting", "push"), [(1.0, 3.0), (1.0, 1.0), (0.4, 3.0)])
def test_what_rests_is_left_alone_within_the_dead_zone(cylinder: int, resting: float, push: float) -> None:
    """Errors beyond it weigh ``rest_push``; a piston that half rests has half the zone and half of what ``rest_push`` adds."""
    rig, zone = RIG, 1e-4
    now = rigid_body.near_balance(rig, 1, seed=4, speed=0.0, push=0.0)
    sizes = np.array([0.0, 0.3, 0.99, 1.5])
    now = rigid_body.Instant(*(np.repeat(part, len(sizes), axis=1) for part in now))
    nothing = np.zeros((2, len(sizes)))
    motion, _ = near(now, rig, nothing, seed=1, fraction=0.0)
    pose = rigid_body.pose_of(now.piston, rig)
    along = pose.beam if cylinder == 1 else pose.across
    motion[:2] -= zone * sizes * along
    rest = np.zeros((2, len(sizes)))
    rest[cylinder] = resting

    def jerks(**changes: Array) -> Array:
        openings = commanded(rig, now, motion, gain=50.0, rest_gain=50.0, dead_zone=zone, rest_push=push, **changes)
        assert np.abs(openings).max() < 1
        a, jerk = rigid_body.acceleration_and_jerk(openings, now, rig, nothing, nothing)
        assert np.abs(a).max() < 1e-9
        return np.asarray((jerk * along).sum(axis=0))

    stiffness = 50.0**3 + 2 * 50.0
    np.testing.assert_allclose(jerks(), -stiffness * zone * sizes, rtol=0, atol=1e-4 * stiffness * zone)
    weight = 1 + (push - 1) * resting
    expected = -weight * stiffness * zone * np.maximum(sizes - resting, 0)
    np.testing.assert_allclose(jerks(rest=rest), expected, rtol=0, atol=1e-4 * stiffness * zone)
    other = jerks(rest=rest[::-1].copy())
    np.testing.assert_allclose(other, -stiffness * zone * sizes, rtol=0, atol=1e-4 * stiffness * zone)


def test_the_gain_of_rest_takes_over_once_the_reference_has_stopped() -> None:
    """From c to the rest's c with a time constant of a tenth of a second; at once back to c when it moves.

    Linear valves: with the gain two flows fall through zero, where others stay within their overlap for a while.
    """
    rig, lanes, error = RIG.replace(LINEAR.changes()), 1, 5e-5
    now = rigid_body.near_balance(rig, lanes, seed=4, speed=0.0, push=0.0)
    nothing = np.zeros((2, lanes))
    motion, _ = near(now, rig, nothing, seed=1, fraction=0.0)
    motion[0] -= error
    memory, stiffnesses = remembered(lanes), []
    for tick in range(400):
        moving = float(tick in (0, 399))
        openings = commanded(rig, now, motion, moving=moving, memory=memory, rest_gain=30.0)
        stiffnesses.append(-rigid_body.acceleration_and_jerk(openings, now, rig, nothing, nothing)[1][0, 0] / error)
    decay = np.exp(-PERIOD * np.arange(399) / 0.1)
    c = 30.0 + 30.0 * decay
    np.testing.assert_allclose(stiffnesses[:399], c**3 + 2 * c, rtol=1e-4)
    assert stiffnesses[399] == pytest.approx(60.0**3 + 120.0, rel=1e-4)


@pytest.mark.parametrize(("mass", "rest_gain"), [(1.0, 36.0), (5.0, 36.0), (7.2, 30.0), (9.8, 36.0 / 1.4)])
def test_a_heavy_head_rests_with_a_gain_that_is_less_by_the_root_of_its_mass(mass: float, rest_gain: float) -> None:
    rig, error = RIG.replace({**LINEAR.changes(), "mechanics.mass": mass}), 5e-5
    now = rigid_body.near_balance(rig, 1, seed=4, speed=0.0, push=0.0)
    nothing = np.zeros((2, 1))
    motion, _ = near(now, rig, nothing, seed=1, fraction=0.0)
    motion[0] -= error
    openings = commanded(rig, now, motion, moving=0.0, rest_gain=36.0, heavy=5.0)
    jerk = rigid_body.acceleration_and_jerk(openings, now, rig, nothing, nothing)[1][0, 0]
    assert -jerk / error == pytest.approx(rest_gain**3 + 2 * rest_gain, rel=1e-4)


@pytest.mark.parametrize("lead_time", [0.0015, 0.01])
def test_the_law_leads_every_spool_from_where_it_is(lead_time: float) -> None:
    """After one period the plant's spools have gone the fraction 1 - exp(-T/lead) of their ways to what the law wants."""
    rig, lanes = TILTED, 40
    now = rigid_body.near_balance(rig, lanes, seed=4, speed=0.05, push=3.0)
    nothing = np.zeros((2, lanes))
    motion, _ = near(now, rig, nothing, seed=1)
    wanted = commanded(rig, now, motion)
    spools = wanted + np.random.default_rng(3).uniform(-0.1, 0.1, wanted.shape)
    openings = commanded(rig, now, motion, spools=spools, lead_time=lead_time)
    free = np.abs(openings) < 1
    assert free.mean() > 0.7
    plant = Plant(rig, lanes)
    plant.state[list(SPOOLS)] = spools
    plant.advance(openings, nothing, PERIOD)
    expected = wanted + np.exp(-PERIOD / lead_time) * (spools - wanted)
    np.testing.assert_allclose(plant.state[list(SPOOLS)][free], expected[free], rtol=0, atol=1e-5)


def test_the_lead_opens_a_valve_no_further_than_fully() -> None:
    for sign in (1.0, -1.0):
        assert admittance_law.lead(sign, -sign, np.exp(-PERIOD / 0.004), 0.5) == sign


def watched(errors: Array, fall: float = 0.9, most: float = 1.0) -> Array:
    """The gain fraction after each of the speed errors (T,), one per period."""
    gains = Gains(Gains.lane(oscillation=0.06, swing=0.0, yielding=fall, least_fraction=0.35, most_falls=most))
    one = remembered(1).follower.along
    return np.array([admittance_law.gain_fraction(one, 0, float(error), PERIOD, gains) for error in errors])


TIMES = PERIOD * np.arange(2000)


@pytest.mark.parametrize("frequency", [4.0, 12.0, 40.0])
def test_sustained_oscillation_lowers_the_gain_down_to_the_least(frequency: float) -> None:
    """By 0.9 at each half wave after the second one, never below 0.35."""
    fraction = watched(0.1 * np.sin(2 * np.pi * frequency * TIMES))
    half_waves = np.floor(2 * frequency * TIMES - 1e-9)
    expected = np.maximum(0.9 ** np.maximum(half_waves - 1, 0), 0.35)
    assert np.mean(np.abs(fraction - expected) < 1e-12) > 0.97, "but for the instants of the sign's change"
    assert fraction.min() == pytest.approx(max(0.35, 0.9 ** np.floor(2 * frequency * 2 - 2)), rel=0.11)


@pytest.mark.parametrize(("most", "falls"), [(1.0, 1), (2.0, 2), (3.0, 3), (9.0, 3)])
def test_a_half_wave_of_several_levels_lowers_the_gain_as_many_times_up_to_the_most(most: float, falls: int) -> None:
    """An amplitude of 3.5 levels: at each half wave after the second one three falls, or ``most``."""
    fraction = watched(3.5 * 0.06 * np.sin(2 * np.pi * 10.0 * TIMES), most=most)
    steps = np.unique(fraction)[::-1]
    expected = np.maximum(0.9 ** (falls * np.arange(len(steps))), 0.35)
    np.testing.assert_allclose(steps, expected, rtol=1e-12)


def test_one_way_errors_cost_no_gain_and_growing_ones_do_beyond_the_level() -> None:
    assert watched(0.3 + 0.2 * np.sin(2 * np.pi * 10 * TIMES)).min() == 1.0, "no change of sign"
    assert watched(0.2 * np.sin(2 * np.pi * 10 * TIMES), fall=1.0).min() == 1.0, "fixed gains"
    growing = watched(0.02 * np.exp(3 * TIMES) * np.sin(2 * np.pi * 10 * TIMES))
    first = TIMES[np.argmax(growing < 1)]
    assert 0.02 * np.exp(3 * first) == pytest.approx(0.06, rel=0.25), "a growing one, as soon as it is beyond the level"


def answer(rig: Parameters, now: rigid_body.Instant, way: Array, memory: Memory, gain: float, **gains: float) -> float:
    """Jerk per position error along ``way``, 1/s3, of a lane at rest: c^3 + 2 c with what is left of the gain."""
    error, nothing = 5e-5, np.zeros((2, 1))
    motion, _ = near(now, rig, nothing, seed=1, fraction=0.0)
    motion[:2] -= error * way
    openings = commanded(rig, now, motion, memory=Memory(memory.rows.copy()), gain=gain, rest_gain=gain, **gains)
    return -float((rigid_body.acceleration_and_jerk(openings, now, rig, nothing, nothing)[1] * way).sum()) / error


@pytest.mark.parametrize("direction", ["across", "along"])
def test_a_direction_that_oscillates_is_held_more_softly_and_the_other_is_not(direction: str) -> None:
    """After five half waves of the speed error in one direction: c 0.9^3 there, jerk by jerk, and c in the other one."""
    rig, c, memory = RIG, 50.0, remembered(1)
    now = rigid_body.near_balance(rig, 1, seed=4, speed=0.0, push=0.0)
    pose, (resting, _) = rigid_body.pose_of(now.piston, rig), near(now, rig, np.zeros((2, 1)), seed=1, fraction=0.0)
    shaken = {"across": pose.across, "along": pose.beam}[direction]
    for time in TIMES[:245]:
        motion = resting.copy()
        motion[2:4] += 0.1 * np.sin(2 * np.pi * 10.0 * time) * shaken
        commanded(rig, now, motion, memory=memory, gain=c, rest_gain=c)
    for way in (pose.across, pose.beam):
        left = 0.9**3 * c if way is shaken else c
        assert answer(rig, now, way, memory, c) == pytest.approx(left**3 + 2 * left, rel=1e-4)
