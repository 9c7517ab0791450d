"""What a controller with a force sensor knows: motion, disturbance, friction ahead, pressures and spools, lane by lane."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from baselines.admittance import estimator
from baselines.admittance.estimator import BELIEVED_LIMIT
from baselines.admittance.rows import Estimate, Memory
from baselines.estimation.admittance import MOVING_SPEED
from baselines.rivals.horizon import NODES, Horizon, HorizonInputs
from baselines.rivals.predictive import GENERATED as GENERATED
from baselines.rivals.predictive import Constants, predict_horizon
from baselines.staged import ControllerStage, StagedController
from birthsim_env.loop.rows import INTERMEDIATE, Seen
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.loop.stage import block
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import PRESSURES, Array, parameter_array
from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.physics.rig.parameters import Parameters
from tests.oracles import closed_loop, derived_law, rigid_body

PERIOD = 1e-3
GAINS = {"bandwidth": 60.0, "pressure_bandwidth": 150.0, "friction_fraction": 1.0}
RIG = Parameters().replace({"geometry.gamma3": 1.4, "valves.leakage_ratio": 0.0})
"""Its shut chambers hold their air."""

PISTON = np.array([[0.02, -0.04], [-0.05, 0.08]])
"""m: the pistons of two lanes."""

ONES = dict.fromkeys(("kept", "weight"), np.ones(NODES)) | dict.fromkeys(("position", "speed", "stiffness", "flow"), 1.0)
EVERY_PERIOD = Horizon(Horizon.numbers(tick=np.arange(1.0, NODES + 1), step=np.full(NODES, PERIOD), **ONES))

either = pytest.mark.parametrize("sampled", [False, True], ids=["ideal", "lab"])


@kernel
def inform(world: int, seen: Seen, memory: int, constants: Constants, tables: int, lane: int, n: int) -> int:
    """Hands on what is ``Estimate``."""
    own, bank = estimator.parts(block(memory, int(constants.rows_of_memory))[:, :n], constants)
    signals = Seen(seen.rows[:, :n])
    return estimator.estimate(signals, own, bank, Estimate(signals.intermediate[: Estimate.size]), constants)


class Aware(StagedController):
    """What a planner knows, by its names, which are good until the next ``now``; gains for ``ideal`` and ``lab`` sensors."""

    def __init__(self, rig: Parameters, gains: dict[str, dict[str, float]], horizon: Horizon = EVERY_PERIOD) -> None:
        super().__init__(rig)
        self._gains, self._horizon = gains, horizon

    def controller_stages(self, sampled: bool) -> list[ControllerStage]:
        estimate = estimator.estimator_parameters(self.parameters, sampled, sampled, self._gains["lab" if sampled else "ideal"])
        constants = Constants.numbers(**estimate, horizon=self._horizon.rows)
        self.about = Constants(constants)
        return [ControllerStage(inform, constants, estimator.fresh_memory(self.parameters, sampled))]

    def more_rows(self, lanes: int) -> list[tuple[Array, int]]:
        self.estimate = Estimate(np.zeros((Estimate.size, lanes)))
        return [(self.estimate.rows, INTERMEDIATE)]

    @property
    def memory(self) -> Memory:
        return Memory(self._memories[0])

    def predicted(self, reference: Reference) -> HorizonInputs:
        """What the planner begins with, but for the flows, and expects at the nodes of its horizon."""
        lanes = self.estimate.drag.shape[1]
        seen, inputs = Seen(np.zeros((Seen.size, lanes))), HorizonInputs(np.zeros((HorizonInputs.size, lanes)))
        seen.asked.rows[:] = reference.rows
        predict_horizon(seen, self.memory, self.estimate, self.about, inputs)
        return inputs

    def now(self, measurement: Measurement, reference: Reference) -> SimpleNamespace:
        assert not self.run_stages(measurement, reference)
        inputs, memory = self.estimate.inputs, self.memory
        return SimpleNamespace(
            motion=self.estimate.motion.rows,
            moving=inputs.moving,
            force=inputs.force,
            believed=inputs.believed,
            unseen=self.estimate.unseen,
            joints=memory.joints.rows,
            spools=memory.chambers.spool,
            pressures=memory.chambers.pressure,
            disturbance=memory.pistons.disturbance,
            rest=memory.pistons.rest,
        )

    def commanded(self, openings: Array) -> None:
        self.memory.chambers.opening[:] = openings


def aware(rig: Parameters = RIG, **gains: float) -> Aware:
    return Aware(rig, {sensors: {**GAINS, **gains} for sensors in ("ideal", "lab")})


def balanced(piston: Array, rig: Parameters = RIG) -> Array:
    """Pressures (4, N) that carry the weight."""
    return np.asarray(balanced_state(parameter_array(rig, piston.shape[1]), piston)[list(PRESSURES)])


def seen(tick: int, piston: Array, pressures: Array, user: Array, sampled: bool) -> Measurement:
    """Resting pistons without noise; a tracker's samples are new at every instant."""
    exact = rigid_body.seen(rigid_body.Instant(piston, np.zeros(piston.shape), pressures, piston), RIG, user)
    clock = np.full(piston.shape[1], tick * PERIOD)
    return dataclasses.replace(exact, time=clock, position_time=clock, sampled=sampled)


def end_effector(piston: Array) -> Array:
    return np.asarray(rigid_body.pose_of(piston, RIG).end_effector)


@either
def test_a_held_push_moves_the_target_as_the_spring_says(sampled: bool) -> None:
    """A coupled spring under 20 N: after a second the motion stands K^-1 F beside the target; it moved meanwhile."""
    wanted = closed_loop.holding(end_effector(PISTON), np.array([[1500.0, 3000.0], [2500.0, 1200.0]]))
    wanted.rows[14], push = [600.0, -400.0], np.array([[20.0, -12.0], [5.0, 16.0]])
    pressures, part, moved = balanced(PISTON), aware(), []
    for tick in range(1000):
        now = part.now(seen(tick, PISTON, pressures, push, sampled), wanted)
        moved.append(now.moving.copy())
    springs = [[[1500.0, 600.0], [600.0, 2500.0]], [[3000.0, -400.0], [-400.0, 1200.0]]]
    way = np.stack([np.linalg.solve(spring, force) for spring, force in zip(springs, push.T, strict=True)], axis=1)
    np.testing.assert_allclose(now.motion[:2], wanted.position + way, rtol=0, atol=1e-8)
    assert np.array_equal(now.force, push)
    assert np.all(now.rest > 0.1) if sampled else not now.rest.any()
    assert np.all(np.array(moved)[5:50] == 1)
    assert not now.moving.any()


@either
def test_the_disturbance_is_what_holds_the_pistons_unseen(sampled: bool) -> None:
    """Chambers push by 25 and -12 N beyond the weight, a user too, and nothing moves: friction is believed, d the rest."""
    extra, areas = np.array([[25.0], [-12.0]]), np.array([[RIG.cylinder1.area_p], [RIG.cylinder2.area_p]])
    user = np.array([[8.0, 0.0], [-6.0, 0.0]])
    pressures = balanced(PISTON)
    pressures[[0, 2]] += extra / areas
    wanted, part = closed_loop.holding(end_effector(PISTON), 2000.0), aware()
    for tick in range(1500):
        now = part.now(seen(tick, PISTON, pressures, user, sampled), wanted)
    assert np.array_equal(now.believed.any(axis=0), [True, False])
    jacobians = rigid_body.jacobians(PISTON, RIG)
    mass = RIG.mechanics.mass * np.stack([(jacobians[:, :, 0] ** 2).sum(axis=1), np.ones(2)])
    held = extra + np.einsum("nci,cn->in", jacobians, user)
    np.testing.assert_allclose(now.believed + now.disturbance * mass, -held, rtol=0, atol=0.01)  # N
    np.testing.assert_allclose(now.joints, np.concatenate([PISTON, np.zeros((2, 2))]), rtol=0, atol=1e-4)


def gliding(tick: int, speed: Array) -> Reference:
    """A target that passes the end effector's place after 0.5 s, at a ``speed`` (2, N), m/s."""
    wanted = closed_loop.holding(end_effector(PISTON) + (tick - 500) * PERIOD * speed, 2000.0)
    wanted.rows[2:4] = speed
    return wanted


@either
@pytest.mark.parametrize("fraction", [0.0, 0.4, 1.0])
def test_a_fraction_of_the_friction_is_believed_against_the_motion(sampled: bool, fraction: float) -> None:
    """Of a steady glide: Fc + (Fs - Fc)/(1 + (v/vs)^2) of each piston, against its speed, whatever the rig itself does."""
    speed = np.array([[0.1, -0.006], [0.05, 0.01]])
    pressures, nothing, part = balanced(PISTON), np.zeros((2, 2)), aware(friction_fraction=fraction)
    for tick in range(501):
        now = part.now(seen(tick, PISTON, pressures, nothing, sampled), gliding(tick, speed))
    v = np.linalg.solve(rigid_body.jacobians(PISTON, RIG), speed.T[..., None])[..., 0].T
    assert np.abs(v).max() > 3 * RIG.friction.stribeck_speed
    assert np.abs(v).min() < RIG.friction.stribeck_speed
    coulomb = np.array(derived_law.coulomb_levels(pressures, v, RIG))
    level = coulomb * (1 + (RIG.friction.static_ratio - 1) / (1 + (v / RIG.friction.stribeck_speed) ** 2))
    np.testing.assert_allclose(now.believed, -fraction * np.sign(v) * level, rtol=0.01, atol=1e-12)


@either
def test_what_is_slower_than_the_moving_speed_may_rest(sampled: bool) -> None:
    """The speed counts, not its components; nor what the rig does."""
    speed = MOVING_SPEED * np.array([[0.99, 1.01, 0.8, 0.8, 0.0], [0.0, 0.0, 0.5, 0.7, -1.2]])
    piston, nothing = np.repeat(PISTON[:, :1], 5, axis=1), np.zeros((2, 5))
    wanted = closed_loop.holding(end_effector(piston), 2000.0)
    wanted.rows[2:4] = speed
    now = aware().now(seen(0, piston, balanced(piston), nothing, sampled), wanted)
    assert now.moving.tolist() == [0, 1, 0, 1, 1]


def test_the_observer_of_disturbances_takes_the_pressures_that_are_believed() -> None:
    """Cells that are not believed once they have been read, for want of bandwidth, change nothing; otherwise they do."""
    rng, nothing = np.random.default_rng(2), np.zeros((2, 2))
    pressures, wanted, found = balanced(PISTON), closed_loop.holding(end_effector(PISTON), 2000.0), {}
    noise = 500.0 * rng.normal(size=(100, *pressures.shape))
    for bandwidth in (1e-9, 150.0):
        for scale in (0.0, 1.0):
            part = aware(pressure_bandwidth=bandwidth)
            for tick, own in enumerate(noise):
                cells = pressures + scale * min(tick, 1) * own
                now = part.now(seen(tick, PISTON, cells, nothing, True), wanted)
            found[bandwidth, scale] = now.disturbance.copy()
    np.testing.assert_allclose(found[1e-9, 1.0], found[1e-9, 0.0], rtol=0, atol=1e-6)
    assert np.abs(found[150.0, 1.0] - found[150.0, 0.0]).min() > 1e-4


def test_unseen_forces_are_friction_and_what_was_observed_up_to_a_limit() -> None:
    """m kappa^2 d along cylinder 1 and m d along cylinder 2, by the Jacobian of the rig of points; 5000 N are not believed."""
    wanted, part, user = closed_loop.holding(end_effector(PISTON), 2000.0), aware(), np.zeros((2, 2))
    pressures, force = balanced(PISTON), np.array([[2.0, 5000.0], [-3.0, -5000.0]])
    kappa = np.linalg.norm(rigid_body.jacobians(PISTON, RIG)[:, :, 0], axis=1)
    mass = RIG.mechanics.mass * np.stack([kappa**2, np.ones(2)])
    part.now(seen(0, PISTON, pressures, user, False), wanted)
    part.memory.pistons.disturbance[:] = force / mass
    now = part.now(seen(1, PISTON, pressures, user, False), wanted)
    np.testing.assert_allclose(now.unseen[:, 0], (now.believed + mass * now.disturbance)[:, 0], rtol=1e-9)
    np.testing.assert_allclose(now.unseen[:, 0], force[:, 0], rtol=0.05)
    np.testing.assert_array_equal(now.unseen[:, 1] - now.believed[:, 1], [BELIEVED_LIMIT, -BELIEVED_LIMIT])


def turning(tick: int, push: Array) -> tuple[Measurement, Reference]:
    """Two lanes, the rigs held, unseen, where they are, under a push. The targets' speeds turn round soon after tick 400."""
    time, jerk = max(tick - 400, 0) * PERIOD, np.array([[30.0, -20.0], [-25.0, 15.0]])
    speed, bend = np.array([[0.05, 0.08], [-0.04, 0.06]]), np.array([[-9.0, -14.0], [8.0, -10.0]])
    wanted = closed_loop.holding(np.zeros((2, 2)), np.array([[1500.0, 3000.0], [2500.0, 1200.0]]))
    rows = (
        speed * time + bend * time**2 / 2 + jerk * time**3 / 6,
        speed + bend * time + jerk * time**2 / 2,
        bend + jerk * time,
    )
    wanted.rows[:8] = np.concatenate([*rows, jerk])
    wanted.rows[:2] += end_effector(PISTON)
    wanted.rows[14] = [600.0, -400.0]
    pressures = balanced(PISTON)
    pressures[[0, 3]] += [[3e4], [-2e4]]
    return seen(tick, PISTON, pressures, push, False), wanted


@either
@pytest.mark.parametrize("fraction", [0.0, 0.4, 1.0])
def test_a_forecast_has_the_friction_of_the_motion_to_come_and_the_disturbance_of_now(sampled: bool, fraction: float) -> None:
    """Both come true where the push stays and the target goes on with its jerk and turns round. Asking changes nothing."""
    part, kept = aware(friction_fraction=fraction), aware(friction_fraction=fraction)
    push = np.array([[9.0, -4.0], [-6.0, 7.0]])

    def both(tick: int) -> tuple[SimpleNamespace, SimpleNamespace]:
        measured, wanted = turning(tick, push)
        measured = dataclasses.replace(measured, sampled=sampled)
        return part.now(measured, wanted), kept.now(measured, wanted)

    for tick in range(401):
        now, _ = both(tick)
    believed, later = now.believed.copy(), []
    growth = np.array([[RIG.cylinder1.pressure_friction], [RIG.cylinder2.pressure_friction]])
    assert np.abs(now.unseen - now.believed).min() > 1
    for begun in range(400, 428, NODES):
        observed = now.unseen - now.believed
        inputs, held = part.predicted(turning(begun, push)[1]), now.pressures.copy()
        for k in range(NODES):
            now, other = both(begun + 1 + k)
            np.testing.assert_allclose(inputs.motion[4 * k : 4 * k + 4], now.motion[:4], rtol=1e-10, atol=1e-12)
            # Pressures are taken to stay; as a tracker's rig is estimated they change by up to 0.6 kPa, and friction with them.
            changed = np.abs(now.pressures - held).reshape(2, 2, -1).sum(axis=1)
            off = np.abs(inputs.unseen[2 * k : 2 * k + 2] - observed - now.believed)
            assert np.all(off <= 1e-9 * (1 + np.abs(now.believed)) + RIG.friction.static_ratio * growth * changed)
            assert sampled or not changed.any()
            assert all(np.array_equal(value, getattr(other, name)) for name, value in vars(now).items())
            later.append(now.believed - believed)
    assert np.all(np.abs(later).max(axis=0) >= 10 * fraction)
