"""What a policy is paid: every term is its documented formula, worked out from ``info``; what a jump asks for; what ends it."""

import gymnasium
import numpy as np
import pytest

from birthsim_env import Parameters, Reference, StiffnessSchedule, reward
from birthsim_env.loop.rows import World
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.compiled.lanes import PRESSURES, TEMPERATURES, Y1, Y2, parameter_column

CIRCLE, PROBE, FORCEPS, DESCENT = (environment_id(name) for name in ("circle", "probe", "forceps", "descent"))
TERMS = ("reward_survive", "reward_tracking", "reward_hunting", "reward_effort", "reward_action_change")
LARGEST = 8.75
COUPLED = StiffnessSchedule((0.0, 1.2), (2000.0, 3000.0), (4600.0, 4000.0), (2300.0, 2000.0), closed_loop_xy=(900.0, -1200.0))


def springs(env, time):
    """The stiffness matrix asked for in the only lane at ``time``, N/m."""
    setpoints = env.simulation.stiffness.sample(np.array([time]))[:, 0]
    return np.array([[setpoints[0], setpoints[6]], [setpoints[6], setpoints[1]]])


@pytest.mark.parametrize(
    ("name", "period", "arguments"),
    [
        (CIRCLE, 0.01, {}),
        (CIRCLE, 0.001, {}),
        (CIRCLE, 0.02, {"sensors": "lab", "randomize": True}),
        (FORCEPS, 0.01, {"randomize": True}),
        (DESCENT, 0.01, {}),
        (PROBE, 0.01, {"stiffness": COUPLED}),
    ],
)
def test_every_term_is_its_formula_of_info(name, period, arguments):
    env = gymnasium.make(name, policy_period=period, **arguments).unwrapped
    steps, fraction = min(round(2.5 / period), 1250), period / 0.01
    _, info = env.reset(seed=1)
    assert [info[term] for term in TERMS] == [0.0] * 5, "nothing has been earned yet"
    last, before, jumps = np.zeros(4), np.zeros(2), []
    given = np.linalg.inv(springs(env, 0.0)) @ info["user_force"]
    jumps.append((0.0, given))
    ramped = 0.0
    for action in np.random.default_rng(0).uniform(-0.2, 0.2, (steps, 4)).astype(np.float32):
        _, earned, _, _, info = env.step(action)
        action, time = action.astype(float), info["time"]
        last_given, given = given, np.linalg.inv(springs(env, time)) @ info["user_force"]
        jumped = info["since_jump"] < period - 1e-4
        if jumped:
            jumps.append((time - period, given - last_given))
        # What jumps have moved the compliant target by is asked for with 60 ms, all else at once.
        asked = given - sum(by * np.exp(-(time - since) / 0.06) for since, by in jumps)
        target = env.simulation.trajectory.sample(np.array([time]))[:, 0]
        error = info["position"] - target[:2] - asked
        relative = info["velocity"] - target[2:4] - (asked - before) / period
        expected = {
            "reward_survive": fraction,
            "reward_tracking": -fraction * np.log(1 + np.abs(error).sum() / 1e-3) / LARGEST,
            "reward_hunting": -fraction * 0.2 * np.log(1 + np.abs(relative).sum() / 0.01) / LARGEST,
            "reward_effort": -fraction * 0.04 * np.mean(action**2) / LARGEST,
            "reward_action_change": -fraction * 0.2 * np.abs(action - last).mean() / LARGEST,
        }
        for term, value in expected.items():
            assert info[term] == pytest.approx(value, rel=1e-7, abs=1e-9), term
        assert earned == pytest.approx(sum(expected.values()), rel=1e-7)
        last, before = action, asked
        ramped = max(ramped, 0.0 if jumped else np.abs(given - last_given).max() / period)
    # Ramps of pulls and contractions are no jumps: what they move the compliant target by is asked for at once.
    if name in (FORCEPS, DESCENT):
        assert ramped > 2e-3
    if name in (CIRCLE, PROBE):
        assert len(jumps) > 1


def assess(lanes=1, policy_period=0.01, rig=None, **changes):
    """Terms by name, (N,), and failures of healthy lanes at rest on their target, without a jump, apart from ``changes``."""
    world, reference = World(np.zeros((World.size, lanes))), Reference(np.zeros((Reference.size, lanes)))
    world.state[list(PRESSURES)], world.state[list(TEMPERATURES)] = 3e5, 293.0
    world.since_jump[:], world.rig[:] = policy_period, parameter_column(rig or Parameters())[:, None]
    reference.position[0], reference.stiffness[:], world.motion.position[0] = 0.5, 2000.0, 0.5
    given = {
        **{name: getattr(world, name) for name in ("state", "force", "since_jump", "impact")},
        "motion": world.motion.rows,
        "owed": np.zeros((4, lanes)),
        "action": np.zeros((2, lanes)),
        "last_action": np.zeros((2, lanes)),
    }
    for name, change in changes.items():
        given[name] = change(given[name]) if callable(change) else np.asarray(change, dtype=np.float64)
        if name in World.groups:
            world.rows[World.groups[name].place] = given[name]
    limits = reward.Limits(reward.Limits.numbers(period=policy_period, jumped_below=0.5 * policy_period, impact_speed=0.1))
    terms, terminated = reward.Terms(np.empty((reward.Terms.size, lanes))), np.empty(lanes)
    lag = reward.TargetLag(given["owed"])
    reward.assess(world, reference, lag, given["action"], given["last_action"], limits, terms, terminated, lanes)
    return dict(zip(reward.REWARD_TERMS, terms.rows, strict=False)), terminated


def test_the_terms_are_named_in_order():
    assert reward.REWARD_TERMS == TERMS
    terms, terminated = assess(lanes=3)
    np.testing.assert_array_equal(terms.pop("reward_survive"), 1.0)
    assert not any(term.any() for term in terms.values())
    assert not terminated.any()


@pytest.mark.parametrize("period", [0.001, 0.01, 0.05])
@pytest.mark.parametrize("size", [2, 4, 5])
def test_no_step_pays_less_than_nothing_nor_more_than_one_per_10_ms(period, size):
    worst = np.array([[np.nan], [np.inf], [-np.inf], [1e9]])
    terms, _ = assess(1, period, motion=worst, action=np.ones((size, 1)), last_action=-np.ones((size, 1)))
    assert 0.0 < sum(terms.values())[0] < 0.003 * period / 0.01
    rng = np.random.default_rng(0)
    changes = {"motion": rng.normal(0, 1, (4, 99)), "action": rng.uniform(-1, 1, (size, 99))}
    terms, _ = assess(99, period, **changes, last_action=rng.uniform(-1, 1, (size, 99)))
    reward = sum(terms.values())
    assert (reward > 0).all()
    assert (reward < period / 0.01).all()


@pytest.mark.parametrize("value", [2.0, np.inf, np.nan])
@pytest.mark.parametrize("row", range(4))
def test_no_cost_is_beyond_the_largest(row, value):
    motion = np.array([[0.5], [0.0], [0.0], [0.0]])
    motion[row] = 20 * value
    terms, _ = assess(motion=motion)
    name, cost = ("reward_tracking", np.log(1001)) if row < 2 else ("reward_hunting", 0.2 * np.log(1001))
    assert terms[name] == pytest.approx(-cost / LARGEST)


@pytest.mark.parametrize("degrees", [-40.0, 0.0, 90.0])
def test_a_rail_pays_for_what_is_along_it_alone(degrees):
    angle, along, across = np.radians(degrees), 3e-3, 5e-3
    rig = Parameters().replace({"linkage.kind": "rail", "linkage.inclination": angle})
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    off, fast = turn @ [along, across], turn @ [10 * along, across]
    terms, _ = assess(rig=rig, motion=np.array([0.5 + off[0], off[1], *fast])[:, None])
    assert terms["reward_tracking"] == pytest.approx(-np.log(1 + along / 1e-3) / LARGEST)
    assert terms["reward_hunting"] == pytest.approx(-0.2 * np.log(1 + 10 * along / 0.01) / LARGEST)


PRESSURE = ((0.19e5, True), (0.21e5, False), (19.9e5, False), (20.1e5, True), (np.nan, True))
TEMPERATURE = ((99.0, True), (101.0, False), (999.0, False), (1001.0, True), (np.nan, True))
PLACE = ((np.nan, True), (np.inf, True), (-np.inf, True))


@pytest.mark.parametrize(
    ("row", "value", "fails"),
    [
        (row, *case)
        for rows, cases in ((PRESSURES, PRESSURE), (TEMPERATURES, TEMPERATURE), ((Y1, Y2), PLACE))
        for row in rows
        for case in cases
    ],
)
def test_a_chamber_out_of_its_range_or_a_piston_that_is_nowhere_fails(row, value, fails):
    """In the middle one of three lanes."""

    def change(state):
        state[row, 1] = value
        return state

    np.testing.assert_array_equal(assess(3, state=change)[1], [False, fails, False])


def test_a_fast_collision_of_either_piston_fails():
    impacts = np.array([[0.0, 0.101, 0.0, 0.1], [0.0, 0.0, 0.2, 0.1]])
    np.testing.assert_array_equal(assess(4, impact=impacts)[1], [False, True, True, False])
