"""Signals that are not finite: one sample is replaced, an outage ends the control, setpoints are refused."""

import copy
import math

import gymnasium
import numpy as np
import pytest

from agents.policy.controller import ResidualController
from baselines.limiter.controller import PortLimiter
from baselines.named import compiled_names, make_controller
from baselines.staged import StagedController
from birthsim_env import Parameters, Reference
from birthsim_env.loop import guard
from birthsim_env.loop.rows import Signals
from tests.oracles import closed_loop

RIG = Parameters()
FELT = RIG.replace({"electronics.acceleration_bandwidth": 300.0})
INTEGRAL = "backstepping-integral"
"""It declares no impedance, whatever is asked for."""

COMPILED = compiled_names(listed=True)
POLICIES = ["residual:circle", "residual:circle_lab_apg", "residual:circle_honest_student"]
"""On a law, on the valves, and one that remembers."""
CONTROLLERS = [*COMPILED, "limited:pid", "limited:admittance-adaptive", *POLICIES]
SIGNALS = ("time", "position", "position_time", "velocity", "acceleration", "pressures", "user_force")
VALUES = (math.nan, math.inf, -math.inf, 1e300)
NO_PLACE = [("position", (0, 1), 0.0), ("position", (0, 1), 1e-4), ("position_time", 0, 1e9), ("position_time", 0, 5.0)]
"""Finite, but no sample: the pivot, which a tracker without its sensor says, and times of the future."""
CASES = [(signal, row, value) for signal in SIGNALS for row in (0, 1) for value in VALUES if row == 0 or "time" not in signal]
CASES += NO_PLACE


def world(sensors="ideal", lanes=1, rig=RIG, seed=5):
    """Lanes of one world."""
    env = gymnasium.make_vec("BirthSIM/Circle-v2", num_envs=lanes, sensors=sensors, policy_period=0.001, parameters=rig)
    env.reset(seed=[seed] * lanes)
    return env


def spoil(measured, lane, signal, row, value):
    array = getattr(measured, signal)
    if array is not None:
        array[(lane,) if array.ndim == 1 else (row, lane)] = value


def finite_memories(law):
    """Where what a controller remembers is finite, by lane; some of it is infinite or NaN until it is first used."""
    laws = [law, law.law] if isinstance(law, PortLimiter) else [law]
    stages = [one.memory for part in laws for one in part.policy_stages() if getattr(one, "memory", None) is not None]
    rows = [array for part in laws if isinstance(part, StagedController) for array in part._memories]
    return np.isfinite(np.concatenate([*rows, *stages]))


@pytest.mark.parametrize("name", CONTROLLERS)
@pytest.mark.parametrize("sensors", ["ideal", "honest"])
def test_one_bad_sample_moves_the_head_no_further_than_a_late_one(name, sensors):
    """A lane for each signal and value; the last lane has good samples alone. The bound is how far a head goes in 10 ms at the
    0.2 m/s that these laws reach: a slammed valve throws it ten times as far in the 0.12 s that follow."""
    rig = FELT if sensors == "honest" else RIG
    env, law = world(sensors, len(CASES) + 1, rig), make_controller(name, rig)
    for tick in range(160):
        measured = env.measurement
        if tick == 40:
            for lane, case in enumerate(CASES):
                spoil(measured, lane, *case)
        openings = law.command(measured, env.reference)
        assert np.isfinite(openings).all()
        *_, lost, _, _ = env.step(openings.T)
        assert not lost.any(), CASES[int(np.argmax(lost))]
    x = env.simulation.motion[:2]
    far = np.linalg.norm(x - x[:, -1:], axis=0)
    assert far.max() < 2e-3, (CASES[int(far.argmax())], far.max())
    good = finite_memories(law)
    assert (good == good[:, -1:]).all()
    needed = {"position", "position_time", "velocity", "pressures", "time"}
    needed |= {"user_force"} if law.reads_force else set()
    felt = law._reads_acceleration()
    expected = [signal in needed or (signal == "acceleration" and felt) for signal, *_ in CASES]
    np.testing.assert_array_equal(law.missed, [*expected, 0])
    assert not law.ended.any()
    env.close()


@pytest.mark.parametrize("signal", ["position", "pressures", "user_force", "time", "velocity"])
@pytest.mark.parametrize(("on_fault", "opening"), guard.ON_FAULT.items())
def test_an_outage_ends_the_control_until_it_is_reset(signal, on_fault, opening):
    env, fault_time = world(lanes=2), 0.02
    law = make_controller("admittance-adaptive", RIG, on_fault=on_fault, fault_time=fault_time)
    for tick in range(100):
        measured = env.measurement
        if 30 <= tick < 70:
            spoil(measured, 0, signal, 0, math.nan)
        openings = law.command(measured, env.reference)
        late = tick - 29 > round(fault_time / 0.001)
        assert law.ended.tolist() == [late, False]
        assert (openings[:, 0] == opening).all() == late
        env.step(openings.T)
    assert law.missed.tolist() == [40, 0]
    law.reset(np.array([True, False]))
    assert (law.command(env.measurement, env.reference)[:, 0] != opening).any()
    assert not law.ended.any()
    env.close()


def test_a_signal_that_the_controller_does_not_read_may_be_missing_for_ever():
    env, law = world(), make_controller("backstepping", RIG)
    same = make_controller("backstepping", RIG)
    for _ in range(60):
        measured = env.measurement
        expected = same.command(measured, env.reference)
        measured.user_force[:] = math.nan
        np.testing.assert_array_equal(law.command(measured, env.reference), expected)
        env.step(expected.T)
    assert (law.missed[0], law.ended[0]) == (0, False)
    env.close()


@pytest.mark.parametrize("name", COMPILED)
def test_valves_stay_closed_until_every_signal_was_good_once(name):
    env, law = world(lanes=2), make_controller(name, RIG)
    for tick in range(300):
        measured = env.measurement
        for signal, until in (("pressures", 20), ("position", 40)):
            if tick < until:
                spoil(measured, 0, signal, 0, math.nan)
        openings = law.command(measured, env.reference)
        assert (openings[:, 0] == 0.0).all() == (tick < 40)
        *_, lost, _, _ = env.step(openings.T)
        assert not lost.any()
    env.close()


ROWS = [(k, name) for k, (name, *_) in enumerate(Reference.entries())]


@pytest.mark.parametrize("name", [*COMPILED, "residual:circle_lab_apg"])
def test_setpoints_that_are_not_finite_are_refused_by_name_and_leave_no_trace(name):
    env, law, same = world(lanes=2), make_controller(name, RIG), make_controller(name, RIG)
    for tick in range(40):
        wanted = env.reference
        expected = same.command(env.measurement, wanted)
        if tick == 20:
            for (row, entry), value in zip(ROWS, VALUES * 4, strict=False):
                wrong, spare = Reference(wanted.rows.copy()), copy.deepcopy(law)
                wrong.rows[row, 1] = value
                with pytest.raises(ValueError, match=rf"reference: {entry} = .*lane 1; allowed: finite"):
                    spare.command(env.measurement, wrong)
                assert np.isfinite(spare.command(env.measurement, wanted)).all()
                good, before = finite_memories(spare), finite_memories(same)
                assert (good == before).all()
        np.testing.assert_array_equal(law.command(env.measurement, wanted), expected)
        env.step(expected.T)
    env.close()


@pytest.mark.parametrize("name", [name for name in COMPILED if name != INTEGRAL])
@pytest.mark.parametrize("row", [0, 8, 9, 14])
def test_no_impedance_is_declared_for_setpoints_that_are_not_finite(name, row):
    wanted = closed_loop.holding(np.array([[0.5], [0.0]]), 2000.0)
    wanted.rows[row] = math.nan
    with pytest.raises(ValueError, match=rf"reference: {ROWS[row][1]} = nan .*; allowed: finite"):
        make_controller(name, RIG).declared_impedance(wanted)


@pytest.mark.parametrize("name", [*COMPILED, "residual:circle_lab_apg"])
def test_a_target_at_the_pivot_is_refused_and_leaves_no_trace(name):
    """No cylinder has a direction there, and memories would keep a NaN."""
    env, law, same = world(lanes=2), make_controller(name, RIG), make_controller(name, RIG)
    for _ in range(3):
        same.command(env.measurement, env.reference)
    law.command(env.measurement, env.reference)
    wrong = Reference(env.reference.rows.copy())
    wrong.position[:, 1] = 0.0
    with pytest.raises(ValueError, match=r"reference: position is the pivot .* in lane 1; allowed: a position at least"):
        law.command(env.measurement, wrong)
    law.command(env.measurement, env.reference)
    assert (finite_memories(law) == finite_memories(same)).all()
    env.close()


def test_forces_to_believe_in_are_finite():
    law, wanted = make_controller("backstepping", RIG), closed_loop.holding(np.array([[0.5], [0.0]]), 2000.0)
    measured = closed_loop.ideal(closed_loop.resting_at(wanted, RIG), 0.0, np.zeros((2, 1)))
    for option, shape in (("feedforward_force", (2, 1)), ("feedforward_rate", (2, 1)), ("damping_factor", (1,))):
        with pytest.raises(ValueError, match=rf"{option} has nan; allowed: finite"):
            law.command(measured, wanted, **{option: np.full(shape, math.nan)})
        for huge in (1e13, 1e300, -1e300):
            with pytest.raises(ValueError, match=rf"{option} has .*; allowed: finite numbers, at most 1e\+12"):
                law.command(measured, wanted, **{option: np.full(shape, huge)})


def test_a_policy_that_is_a_function_sees_the_last_good_sample():
    seen = []

    def policy(observations):
        seen.append(observations.copy())
        return np.zeros((len(observations), 2))

    env, law = world(), ResidualController(RIG, policy)
    for tick in range(30):
        measured = env.measurement
        if tick == 20:
            measured.user_force[:], measured.position[:] = math.nan, math.inf
        env.step(law.command(measured, env.reference).T)
    assert np.isfinite(seen).all()
    # In units of the observation: a force of infinity would stand at its limit.
    assert np.abs(seen[2] - seen[1]).max() < 0.5
    assert law.missed[0] == 1
    broken = ResidualController(RIG, lambda observations: np.full((len(observations), 2), math.nan))
    with pytest.raises(ValueError, match="action nan; allowed: finite"):
        broken.command(env.measurement, env.reference)
    env.close()


def test_a_limited_controller_of_ones_own_is_handed_good_samples():
    handed = []

    class Own:
        def command(self, measurement, reference):
            handed.append(measurement)
            return np.zeros((4, measurement.position.shape[1]))

        def reset(self, lanes=None):
            pass

    env, law = world(), PortLimiter(Own(), RIG)
    for tick in range(3):
        measured = env.measurement
        if tick == 1:
            measured.pressures[2] = math.nan
        law.command(measured, env.reference)
    assert all(np.isfinite(one.pressures).all() for one in handed)
    np.testing.assert_array_equal(handed[1].pressures, handed[0].pressures)
    env.close()


def test_the_rule_covers_every_row_that_is_measured_or_asked_for():
    limits = guard.Limits(guard.limits(RIG, guard.SIGNALS, "hold", 0.03))
    assert limits.most.shape == (Signals.size,)
    assert (limits.most > 0).all()
    assert np.isfinite(limits.most).all()
    assert np.abs(guard.LastGood(guard.fresh(RIG)).good / limits.most).max() <= 1
