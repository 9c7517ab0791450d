"""What a policy may say of stiffness and damping: zero says nothing, a measured hand still feels K, an unknown push K'."""

import dataclasses
from collections.abc import Callable

import gymnasium
import numpy as np
import pytest

from agents.residual.corrected import MOST_DAMPING, SOFTEST, STIFFENING, STIFFEST, CorrectedController, stiffen
from agents.residual.settings import ResidualSettings
from baselines.named import make_controller
from birthsim_env import Parameters
from birthsim_env.loop.signals import REFERENCES, Measurement, Reference
from birthsim_env.parts.scenarios import environment_id
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.plant import Plant
from birthsim_env.registry import names
from tests.oracles import closed_loop

PROBE, CIRCLE = "BirthSIM/ProbeResidual-v3", "BirthSIM/CircleResidual-v2"


def test_the_target_moves_so_that_a_hand_at_rest_feels_what_was_asked_for() -> None:
    """The springs K about t and K' about t' have the same force where the hand is in balance with K; nothing else changes."""
    lanes, rng = 500, np.random.default_rng(0)
    reference = Reference(rng.normal(size=(REFERENCES, lanes)))
    reference.rows[8:10] = rng.uniform(500, 8000, (2, lanes))
    powers, force = rng.uniform(-1, 1, (2, lanes)), rng.uniform(-200, 200, (2, lanes))
    powers[:, :50] = 0.0
    powers[0, 50:100] = 0.0
    before = reference.rows.copy()
    changed = Reference(before.copy())
    stiffen(force, powers, changed, powers.shape[1])
    np.testing.assert_array_equal(changed.rows[:, :50], before[:, :50])
    np.testing.assert_array_equal(changed.rows[[0, 8], 50:100], before[[0, 8], 50:100])
    np.testing.assert_array_equal(np.delete(changed.rows, [0, 1, 8, 9], axis=0), np.delete(before, [0, 1, 8, 9], axis=0))
    np.testing.assert_allclose(changed.compliant_target(force)[:, 500:], reference.compliant_target(force)[:, 500:])
    place = reference.position + force / reference.stiffness
    np.testing.assert_allclose(changed.stiffness * (place - changed.position), force, rtol=1e-9, atol=1e-9)
    ratio = changed.stiffness / reference.stiffness
    most = np.maximum(STIFFEST, reference.stiffness) / reference.stiffness
    least = np.minimum(SOFTEST, reference.stiffness) / reference.stiffness
    np.testing.assert_allclose(ratio, np.where(powers == 0, 1, np.clip(4.0**powers, least, most)), rtol=1e-12)
    assert (STIFFENING, STIFFEST, SOFTEST) == (4.0, 4000.0, 500.0)


def shocked(command: Callable[[Measurement, Reference], Array], push: float) -> Array:
    """Largest speed of piston 1, m/s, in each half second after a push of 0.1 s, on a stiff light rig with slow valves."""
    rig = Parameters().replace({"mechanics.mass": 2.0, "valves.time_constant": 0.007})
    wanted, speeds = closed_loop.holding(np.array([[0.5], [0.0]]), 4700.0), []
    plant = closed_loop.resting_at(wanted, rig)
    for _ in closed_loop.run(plant, command, lambda t: wanted, lambda t: np.array([[0.0], [push * (t < 0.1)]]), 2.0):
        speeds.append(abs(float(plant.piston_speed[0, 0])))
    return np.max(np.reshape(speeds, (4, 500)), axis=1)


def test_a_swing_that_the_law_keeps_up_dies_sooner_with_less_stiffness_but_for_fixed_impedance() -> None:
    name = "backstepping-force-first"

    def answers(push: float) -> list[Array]:
        """Of the law alone, and with a residual that says nothing, of fixed and of variable impedance."""
        residuals = [
            CorrectedController(Parameters(), ResidualSettings(name, impedance)) for impedance in ("fixed", "variable_kp")
        ]
        for residual in residuals:
            residual.reset(np.ones(1, dtype=np.bool_))
        return [shocked(law.command, push) for law in (make_controller(name, Parameters()), *residuals)]

    law, fixed, guarded = answers(80.0)
    np.testing.assert_array_equal(fixed, law)
    assert law[0] == guarded[0] > 0.6, "the first half wave costs nothing yet"
    assert guarded[1] < 0.2 < 0.3 < law[1]
    assert guarded[2] < 0.03
    law, _, guarded = answers(20.0)
    np.testing.assert_array_equal(guarded, law, "without a swing nothing is taken")


POWERS = np.array([[0.5, -0.5, 0.5, 0.0, 0.4], [0.5, -0.5, -0.3, 0.0, 0.0]])


def pushed(damping: float, sensed: bool, push: float, seconds: float = 2.5) -> Array:
    """Displacement (axis, N), m, from a target at rest at 2000 N/m that a hand pushes with ``push`` N on one axis, on the rig
    with linear valves, without dry friction and with ``POWERS``; the force sensor works only where ``sensed``."""
    rig, lanes = closed_loop.IDEAL, 2 * POWERS.shape[1]
    wanted = closed_loop.holding(np.repeat([[0.5], [0.0]], lanes, axis=1), 2000.0)
    plant = closed_loop.resting_at(wanted, rig)
    law = CorrectedController(rig, ResidualSettings("backstepping-weight", "variable"))
    law.reset(np.ones(lanes, dtype=np.bool_))
    law.accept(np.concatenate([np.zeros((2, lanes)), np.tile(POWERS, 2), np.full((1, lanes), damping)]))
    force = push * np.repeat(np.eye(2), POWERS.shape[1], axis=1)

    def sense(plant: Plant, time: float, force: Array) -> Measurement:
        return closed_loop.ideal(plant, time, force if sensed else np.zeros_like(force))

    for _ in closed_loop.run(plant, law.command, lambda t: wanted, lambda t: force * min(t / 0.5, 1.0), seconds, sense):
        pass
    moved = plant.end_effector()[:2] - wanted.position
    return np.stack(np.hsplit(moved, 2))[[0, 1], [0, 1]]


@pytest.mark.parametrize("damping", [0.0, 1.0])
def test_a_measured_hand_at_rest_feels_the_stiffness_asked_for(damping: float) -> None:
    """20 N at 2000 N/m: 10 mm, whatever the power. Joints bend the spring of a target that lies 20 mm away a little more."""
    moved = pushed(damping, sensed=True, push=20.0)
    np.testing.assert_allclose(moved[:, 0], 0.01, rtol=0.003)
    np.testing.assert_allclose(moved, 0.01, rtol=0.03)
    np.testing.assert_allclose(pushed(damping, sensed=True, push=4.0), 0.002, rtol=0.007)


def test_a_force_that_no_sensor_tells_of_meets_the_stiffness_that_the_policy_chose() -> None:
    """That is what the stiffness is for: friction, unknown weight and what else pushes unseen."""
    np.testing.assert_allclose(pushed(0.0, sensed=False, push=4.0), 0.002 / 4.0 ** np.maximum(POWERS, 0.0), rtol=0.01)


def test_the_stiffness_yields_with_the_authority() -> None:
    """Where one cylinder oscillates, on both axes: each axis moves both cylinders."""
    fractions = np.array([[1.0, 0.5, 1.0], [1.0, 1.0, 0.2]])
    law = CorrectedController(closed_loop.FRICTIONLESS, ResidualSettings("backstepping", "variable_kp", time_constant=1e-4))
    wanted = closed_loop.holding(np.repeat([[0.5], [0.0]], 3, axis=1), 1000.0)
    plant = closed_loop.resting_at(wanted, closed_loop.FRICTIONLESS)
    law.reset(np.ones(3, dtype=np.bool_))
    law.accept(np.repeat([[0.0], [0.0], [0.8], [0.4]], 3, axis=1))
    for _ in range(3):
        law.command(closed_loop.ideal(plant, 0.0, np.zeros((2, 3))), wanted)
        law.limiter.left[:] = fractions
    least = [1.0, 0.5, 0.2]
    np.testing.assert_allclose(law.asked.stiffness, 1000 * 4.0 ** (np.outer([0.8, 0.4], least)), rtol=1e-3)


def test_the_last_entry_raises_the_damping_up_to_twice_and_lowers_it_never() -> None:
    actions, factors = np.zeros((5, 3)), []
    actions[4] = [1.0, -1.0, 0.25]
    laws = [
        CorrectedController(closed_loop.FRICTIONLESS, ResidualSettings("backstepping", impedance, time_constant=0.05))
        for impedance in ("variable", "fixed")
    ]
    wanted = closed_loop.holding(np.repeat([[0.5], [0.0]], 3, axis=1), 1000.0)
    seen = closed_loop.ideal(closed_loop.resting_at(wanted, closed_loop.FRICTIONLESS), 0.0, np.zeros((2, 3)))
    for law in laws:
        law.reset(np.ones(3, dtype=np.bool_))
        law.accept(actions[: law.settings.size])
    for _ in range(200):
        for law in laws:
            law.command(seen, wanted)
        factors.append(laws[0].feedforward[4])
        assert not laws[1].feedforward[4].any(), "a fixed impedance tells of no factor"
    fraction = 1 - np.exp(-np.arange(200) / 50)[:, None]
    np.testing.assert_allclose(factors, 2.0 ** np.maximum(fraction * actions[4], 0), rtol=1e-6)
    assert MOST_DAMPING == 2.0


@pytest.mark.parametrize("sensors", ["ideal", "lab"])
def test_without_a_law_the_actions_are_the_openings(sensors: str) -> None:
    arguments = {"num_envs": 3, "sensors": sensors, "randomize": True}
    inside = gymnasium.make_vec(PROBE, law="none", **arguments)
    outside = gymnasium.make_vec("BirthSIM/Probe-v3", **arguments)
    inside.reset(seed=6), outside.reset(seed=6)
    for action in np.random.default_rng(0).uniform(-0.1, 0.1, (60, 3, 4)).astype(np.float32):
        for one, other in zip(inside.step(action)[1:4], outside.step(action)[1:4], strict=True):
            np.testing.assert_array_equal(one, other)
        np.testing.assert_array_equal(inside.simulation.plant.state, outside.simulation.plant.state)
        np.testing.assert_array_equal(inside.simulation.openings.T, action)


@pytest.mark.parametrize("scenario", names("scenario"))
def test_whatever_a_policy_says_there_are_gains(scenario: str) -> None:
    """All entries at their limits, in all combinations: a law without gains would refuse by an exception."""
    name = environment_id(scenario, "Residual")
    (size,) = gymnasium.make(name, impedance="variable").action_space.shape or ()
    corners = np.array(np.meshgrid(*[[-1.0, 1.0]] * size)).reshape(size, -1).T.astype(np.float32)
    env = gymnasium.make_vec(name, num_envs=len(corners), impedance="variable", randomize=True)
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    for _ in range(12):
        order = rng.permutation(len(corners))
        for _ in range(5):
            observation, _, _, _, _ = env.step(corners[order])
            assert np.isfinite(observation).all()


def test_a_measurement_is_left_as_it_was() -> None:
    """The law inside moves the target that it works with, not the one that the reward knows."""
    env = gymnasium.make_vec(CIRCLE, num_envs=2, impedance="variable", policy_period=1e-3)
    env.reset(seed=0)
    for _ in range(5):
        seen, reference = env.measurement, env.reference
        kept = [getattr(seen, field.name) for field in dataclasses.fields(seen)] + [reference.rows]
        copies = [np.array(value) for value in kept]
        env.step(np.ones((2, 5)))
        for value, copy in zip(kept, copies, strict=True):
            np.testing.assert_array_equal(value, copy)
