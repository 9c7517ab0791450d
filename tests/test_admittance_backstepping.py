"""The law behind the admittance: the jerk that it gives, dead zone, gains at rest, valve lead, and gains that yield."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from baselines import admittance_law
from baselines.admittance_backstepping import LEAST_SHARE
from birthsim_env.lanes import SPOOLS, Array, parameter_column
from birthsim_env.parameters import Parameters
from birthsim_env.plant import Plant
from birthsim_env.signals import REFERENCES, Measurement
from tests import rigid_body

PERIOD = 1e-3
ANOTHER = Parameters().replace(
    {
        "geometry.gamma3": 1.4, "mechanics.mass": 4.2, "cylinder1.viscous_friction": 55.0, "cylinder2.viscous_friction": 12.0,
        "air.polytropic_index": 1.3, "valves.time_constant": 0.006,
    }
)  # fmt: skip


@dataclasses.dataclass
class Law:
    """The kernel with everything that is not under test at rest; ``command`` gives openings (4, N)."""

    rig: Parameters
    gain: float = 60.0
    rest_gain: float = 60.0
    dead_zone: float = 0.0

    def command(
        self, now: rigid_body.Instant, motion: Array, user: Array, believed: Array, disturbance: Array,
        rest: Array | None = None, moving: float = 1.0,
    ) -> Array:  # fmt: skip
        lanes, tau = motion.shape[1], self.rig.valves.time_constant
        target, memory, openings = np.zeros((REFERENCES, lanes)), np.zeros((admittance_law.MEMORY, lanes)), np.empty((4, lanes))
        target[10:12], memory[admittance_law.GAIN_SHARE] = now.stiffness, 1.0
        # With a spool that follows as fast as it does by itself the command is the opening that the law wants.
        quickness = 1 - np.exp(-PERIOD / tau)
        admittance_law.command(
            np.concatenate([now.piston, now.speed]), now.pressures, motion, target, user, believed, disturbance,
            np.zeros((2, lanes)) if rest is None else rest, np.full(lanes, moving), parameter_column(self.rig), PERIOD,
            self.gain, self.rest_gain, self.dead_zone, quickness, 0.06, 0.9, LEAST_SHARE, 30.0, memory, openings,
        )  # fmt: skip
        return openings


def near(now: rigid_body.Instant, rig: Parameters, user: Array, seed: int, share: float = 1.0) -> tuple[Array, Measurement]:
    """A motion (8, N) that the rig nearly has."""
    rng, measured = np.random.default_rng(seed), rigid_body.seen(now, rig, user)
    motion = share * np.repeat([1e-4, 2e-3, 0.3, 10.0], 2)[:, None] * rng.uniform(-1, 1, (8, user.shape[1]))
    motion[:2] += measured.position
    motion[2:4] += measured.velocity
    return motion, measured


@pytest.mark.parametrize("rig", [Parameters(), ANOTHER], ids=["default", "another rig"])
def test_the_end_effector_gets_the_jerk_that_the_law_states(rig: Parameters) -> None:
    """j = jr - 3 c (a - ar) - (3 c^2 + 2)(v - vr) - (c^3 + 2 c)(x - xr), a with all that is known."""
    lanes, c, rng = 60, 60.0, np.random.default_rng(2)
    now = rigid_body.near_balance(rig, lanes, seed=0, speed=0.05, push=4.0)
    user, believed, d = rng.uniform(-4, 4, (2, lanes)), rng.uniform(-3, 3, (2, lanes)), rng.uniform(-0.5, 0.5, (2, lanes))
    motion, measured = near(now, rig, user, seed=1)
    openings = Law(rig, c).command(now, motion, user, believed, d)
    free = np.abs(openings).max(axis=0) < 1
    assert free.sum() > 0.7 * lanes
    kappa = np.linalg.norm(rigid_body.jacobians(now.piston, rig)[:, :, 0], axis=1)
    known = believed + rig.mechanics.mass * np.stack([kappa**2, np.ones(lanes)]) * d
    a, jerk = rigid_body.acceleration_and_jerk(openings, now, rig, known, user)
    wanted = motion[6:8] - 3 * c * (a - motion[4:6]) - (3 * c**2 + 2) * (measured.velocity - motion[2:4])
    wanted -= (c**3 + 2 * c) * (measured.position - motion[:2])
    np.testing.assert_allclose(jerk[:, free], wanted[:, free], rtol=1e-6, atol=1e-5 * np.abs(wanted).max())


def test_unseen_forces_are_believed_up_to_a_limit() -> None:
    """A disturbance that no friction and no weight explains is cut: the law then answers like at the limit."""
    rig, lanes = Parameters(), 2
    now = rigid_body.near_balance(rig, 1, seed=0, speed=0.0, push=0.0)
    now = rigid_body.Instant(*(np.repeat(part, lanes, axis=1) for part in now))
    user, d = np.zeros((2, lanes)), np.zeros((2, lanes))
    motion, _ = near(now, rig, user, seed=1, share=0.0)
    d[1] = [admittance_law.BELIEVED_LIMIT / rig.mechanics.mass, 1000.0]
    openings = Law(rig, 20.0).command(now, motion, user, user, d)
    assert np.array_equal(openings[:, 0], openings[:, 1])


@pytest.mark.parametrize("cylinder", [0, 1])
def test_what_rests_is_left_alone_within_the_dead_zone(cylinder: int) -> None:
    """Errors along a resting piston within the zone change nothing; beyond it they count twice; moving, all count."""
    rig, zone = Parameters(), 1e-4
    now = rigid_body.near_balance(rig, 1, seed=4, speed=0.0, push=0.0)
    sizes = np.array([0.0, 0.5, 0.99, 1.5])
    now = rigid_body.Instant(*(np.repeat(part, len(sizes), axis=1) for part in now))
    nothing = np.zeros((2, len(sizes)))
    motion, _ = near(now, rig, nothing, seed=1, share=0.0)
    pose = rigid_body.pose_of(now.piston, rig)
    along = pose.beam if cylinder == 1 else pose.across
    motion[:2] -= zone * sizes * along
    rest = np.zeros((2, len(sizes)))
    rest[cylinder] = 1.0

    def jerks(**changes: Array) -> Array:
        openings = Law(rig, 50.0, 50.0, zone).command(now, motion, nothing, nothing, nothing, **changes)
        assert np.abs(openings).max() < 1
        a, jerk = rigid_body.acceleration_and_jerk(openings, now, rig, nothing, nothing)
        assert np.abs(a).max() < 1e-9
        return np.asarray((jerk * along).sum(axis=0))

    stiffness = 50.0**3 + 2 * 50.0
    np.testing.assert_allclose(jerks(), -stiffness * zone * sizes, rtol=0, atol=1e-4 * stiffness * zone)
    expected = -admittance_law.REST_PUSH * stiffness * zone * np.maximum(sizes - 1, 0)
    np.testing.assert_allclose(jerks(rest=rest), expected, rtol=0, atol=1e-4 * stiffness * zone)
    other = jerks(rest=rest[::-1].copy())
    np.testing.assert_allclose(other, -stiffness * zone * sizes, rtol=0, atol=1e-4 * stiffness * zone)


def test_the_gain_of_rest_takes_over_once_the_reference_has_stopped() -> None:
    """From c to the rest's c with the time constant MOTION_TIME; at once back to c when it moves."""
    rig, lanes, error = Parameters(), 1, 5e-5
    now = rigid_body.near_balance(rig, lanes, seed=4, speed=0.0, push=0.0)
    nothing = np.zeros((2, lanes))
    motion, _ = near(now, rig, nothing, seed=1, share=0.0)
    motion[0] -= error
    law, memory = Law(rig, 60.0, 30.0), np.zeros((admittance_law.MEMORY, lanes))
    memory[admittance_law.GAIN_SHARE], target, openings = 1.0, np.zeros((REFERENCES, lanes)), np.empty((4, lanes))
    target[10:12] = now.stiffness
    quickness, stiffnesses = 1 - np.exp(-PERIOD / rig.valves.time_constant), []
    for tick in range(400):
        memory[:4] = 0.0
        admittance_law.command(
            np.concatenate([now.piston, now.speed]), now.pressures, motion, target, nothing, nothing, nothing, nothing,
            np.full(lanes, float(tick in (0, 399))), parameter_column(rig), PERIOD, law.gain, law.rest_gain, 0.0, quickness,
            0.06, 0.9, LEAST_SHARE, 30.0, memory, openings,
        )  # fmt: skip
        stiffnesses.append(-rigid_body.acceleration_and_jerk(openings, now, rig, nothing, nothing)[1][0, 0] / error)
    decay = np.exp(-PERIOD * np.arange(399) / admittance_law.MOTION_TIME)
    c = 30.0 + 30.0 * decay
    np.testing.assert_allclose(stiffnesses[:399], c**3 + 2 * c, rtol=1e-4)
    assert stiffnesses[399] == pytest.approx(60.0**3 + 120.0, rel=1e-4)


@pytest.mark.parametrize(("tau", "lead_time"), [(0.004, 0.0015), (0.008, 0.001), (0.002, 0.004)])
def test_the_spool_follows_with_the_lead_time(tau: float, lead_time: float) -> None:
    """The plant's own spool comes nearer to what is wanted by exp(-T/lead) per period while no command is full."""
    rig = Parameters().replace({"valves.time_constant": tau})
    plant, kept, quickness = Plant(rig), np.exp(-PERIOD / tau), 1 - np.exp(-PERIOD / lead_time)
    spool, path = np.zeros(4), []
    wanted = np.array([0.1, -0.12, 0.05, 0.08])
    for _ in range(12):
        command = np.array([admittance_law.lead(w, s, kept, quickness) for w, s in zip(wanted, spool, strict=True)])
        assert np.abs(command).max() < 1
        spool = kept * spool + (1 - kept) * command
        plant.advance(command[:, None], np.zeros((2, 1)), PERIOD)
        path.append(plant.state[list(SPOOLS), 0])
    np.testing.assert_allclose(path[-1], spool, rtol=0, atol=1e-6, err_msg="what it believes of the spool")
    left = np.exp(-PERIOD / lead_time * np.arange(1, 13))[:, None]
    np.testing.assert_allclose(1 - np.array(path) / wanted, np.repeat(left, 4, axis=1), rtol=0, atol=1e-4)


def test_the_law_knows_where_the_spools_are() -> None:
    """Its memory of them is the plant's own spools, full openings included, while errors and commands change."""
    rig, lanes, rng = Parameters(), 3, np.random.default_rng(0)
    now = rigid_body.near_balance(rig, lanes, seed=4, speed=0.0, push=30.0)
    nothing, memory, openings = np.zeros((2, lanes)), np.zeros((admittance_law.MEMORY, lanes)), np.empty((4, lanes))
    memory[admittance_law.GAIN_SHARE], target = 1.0, np.zeros((REFERENCES, lanes))
    target[10:12] = now.stiffness
    plant, full = Plant(rig, lanes), False
    for _ in range(30):
        motion, _ = near(now, rig, nothing, seed=int(rng.integers(100)), share=3.0)
        admittance_law.command(
            np.concatenate([now.piston, now.speed]), now.pressures, motion, target, nothing, nothing, nothing, nothing,
            np.ones(lanes), parameter_column(rig), PERIOD, 60.0, 60.0, 0.0, 0.5, 0.06, 0.9, LEAST_SHARE, 30.0, memory, openings,
        )  # fmt: skip
        plant.advance(openings, np.zeros((2, lanes)), PERIOD)
        full |= bool((np.abs(openings) == 1).any())
        np.testing.assert_allclose(memory[:4], plant.state[list(SPOOLS)], rtol=0, atol=2e-6)
    assert full
    assert np.ptp(memory[:4]) > 0.1


def test_the_lead_opens_a_valve_no_further_than_fully() -> None:
    for sign in (1.0, -1.0):
        assert admittance_law.lead(sign, -sign, np.exp(-PERIOD / 0.004), 0.5) == sign


def watched(errors: Array, fall: float = 0.9, level: float = 0.06, least: float = 0.35) -> Array:
    """The gain share after each of the speed errors (T,), one per period."""
    memory, share = np.zeros((admittance_law.MEMORY, 1)), []
    memory[admittance_law.GAIN_SHARE] = 1.0
    for error in errors:
        admittance_law.watch(memory, admittance_law.WATCH_T, 0, float(error), PERIOD, level, fall, least)
        share.append(memory[admittance_law.GAIN_SHARE, 0])
    return np.array(share)


TIMES = PERIOD * np.arange(2000)


@pytest.mark.parametrize("frequency", [4.0, 12.0, 40.0])
def test_sustained_oscillation_lowers_the_gain_down_to_the_least(frequency: float) -> None:
    """By ``fall`` at each half wave after the second one, never below ``least``."""
    share = watched(0.1 * np.sin(2 * np.pi * frequency * TIMES))
    falls = np.round(np.log(share) / np.log(0.9), 9)
    half_waves = np.floor(2 * frequency * TIMES - 1e-9)
    expected = np.maximum(0.9 ** np.maximum(half_waves - 1, 0), 0.35)
    assert np.mean(np.abs(share - expected) < 1e-12) > 0.97, "but for the instants of the sign's change"
    assert share.min() == pytest.approx(max(0.35, 0.9 ** np.floor(2 * frequency * 2 - 2)), rel=0.11)
    assert falls.min() == 0


@pytest.mark.parametrize("kept", [0.3, 0.6, 0.74])
def test_a_decaying_transient_costs_no_gain(kept: float) -> None:
    """Each half wave smaller than SUSTAINED times the one before, whatever its size."""
    decay = np.log(kept) * 2 * 10.0
    share = watched(2.0 * np.exp(decay * TIMES) * np.sin(2 * np.pi * 10.0 * TIMES))
    assert share.min() == 1.0


def test_small_or_slow_oscillations_and_one_way_errors_cost_no_gain() -> None:
    assert watched(0.055 * np.sin(2 * np.pi * 10 * TIMES)).min() == 1.0, "below the level"
    assert watched(0.5 * np.sin(2 * np.pi * 2.4 * TIMES)).min() == 1.0, "half waves beyond 0.2 s"
    assert watched(0.3 + 0.2 * np.sin(2 * np.pi * 10 * TIMES)).min() == 1.0, "no change of sign"
    assert watched(0.2 * np.sin(2 * np.pi * 10 * TIMES), fall=1.0).min() == 1.0, "fixed gains"
    growing = watched(0.02 * np.exp(3 * TIMES) * np.sin(2 * np.pi * 10 * TIMES))
    first = TIMES[np.argmax(growing < 1)]
    assert 0.02 * np.exp(3 * first) == pytest.approx(0.06, rel=0.25), "a growing one, as soon as it is beyond the level"
