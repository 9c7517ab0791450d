"""Piston speed from position samples that are rare, noisy and late.

A Luenberger observer with a disturbance state runs at the control rate on the control model; pressures are measured at every
period:
    y' = v,  v' = f(y, v) + g F + d,  d' = 0
The disturbance d is an acceleration. It stands for what the observer is not told: Coulomb friction, the model's errors, and
the user's force where it is not measured.

When a position sample arrives, the observer is corrected by the difference to what it believed when that sample was taken.
The corrections of y, v and d are 1 - e^3, 3/2 (1 - e)^2 (1 + e)/Ts and (1 - e)^3/Ts^2 times this difference. They place a
triple pole at e = exp(-w Ts), whatever the time Ts between samples. They are carried on over the sample's age.

Friction holds a resting piston still. An observer that knows this averages the noise away. While a piston rests,
    v' = ... - 2 wr v,  d' = -wr^2 v    (the pseudo-measurement v = 0 with a double pole wr: d is what friction carries)
and position samples move y alone, by 1 - exp(-ws Ts). A piston counts as resting once it is slow. It no longer does when the
low-passed innovation is larger than noise explains, or when the user of the observer says that the reference moves.
"""

from __future__ import annotations

import numpy as np

from birthsim_env.loop.signals import Mask, Measurement
from birthsim_env.loop.stage import scratch
from birthsim_env.physics import geometry, mechanics
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.inverse_kinematics import piston_motion
from birthsim_env.physics.rig.parameters import Parameters

BANDWIDTH = 70.0
"""1/s; assumed: as fast as 0.1 mm of noise at 240 Hz allows the valves without chatter."""

REST_BANDWIDTH = 110.0
"""wr, 1/s: how fast friction takes up the load of a resting piston; found by trial like the next five."""

SLOW_BANDWIDTH = 10.0
"""ws, 1/s, of the position of a resting piston."""

REST_SPEED = 6e-3
"""m/s: a slower piston may come to rest."""

REST_TIME = 0.1
"""s: time constant with which a slow piston comes to count as resting."""

RELUCTANCE = 5.0
"""Relative growth of ``REST_TIME`` after a rest that ends without a command. A piston that starts to move without a command has
little friction, so the next rest is assumed later."""

TRUST_TIME = 20.0
"""s: time constant with which the growth of ``REST_TIME`` decays."""

INNOVATION_FRACTION = 0.3
"""Weight of a new innovation in the low-passed one."""

STIR = 1.9
"""Low-passed innovation that ends a rest, in standard deviations of the position noise: 4.5 of the low-passed noise."""


ESTIMATE, REST, INNOVATION, RELUCTANT, FRESH, LAST, SLOT, HISTORY = 0, 6, 8, 10, 12, 13, 14, 15
"""Rows at which parts of an observer's memory begin: y1, y2, v1, v2, d1, d2; how far each piston rests, 0 to 1; low-passed
innovations, m; factors of ``REST_TIME``; 1 at a new start; time of the newest sample, s; where in the history the present
stands; past y1, y2, a ring."""


@helper
def observe(
    memory: Array, time: Array, position: Array, position_time: Array, velocity: Array, pressures: Array, p: Array,
    period: float, bandwidth: float, noise: float, force: Array, believed: Array, moving: Array,
) -> None:  # fmt: skip
    """One control period; carries ``memory`` (M, N) on.

    ``force`` (2, N) the user's, N, and ``believed`` (2, N), N along the pistons, as known; ``moving`` (N,) 1 where no piston
    may rest.
    """
    estimate, rest, innovations = memory[ESTIMATE:REST], memory[REST:INNOVATION], memory[INNOVATION:RELUCTANT]
    reluctance, history = memory[RELUCTANT:FRESH], memory[HISTORY:]
    depth, held = history.shape[0] // 2, exact.exp(-REST_BANDWIDTH * period)
    motion, joints = scratch(4), scratch(4)
    motion[2, 0], motion[3, 0] = 0.0, 0.0
    for i in range(estimate.shape[1]):
        slot = (int(memory[SLOT, i]) + 1) % depth
        sampled = position_time[i] - memory[LAST, i]
        # The memory goes no further back than the rig's own description of its tracker.
        age = min(time[i] - position_time[i], (depth - 1) * period)
        memory[SLOT, i], memory[LAST, i] = slot, position_time[i]
        motion[0, 0], motion[1, 0] = position[0, i], position[1, i]
        if memory[FRESH, i] > 0.0:
            memory[FRESH, i] = 0.0
            motion[2, 0], motion[3, 0] = velocity[0, i], velocity[1, i]
            piston_motion(motion, p, joints, 1)
            for cylinder in range(2):
                estimate[cylinder, i] = joints[cylinder, 0]
                estimate[2 + cylinder, i] = joints[2 + cylinder, 0]
                estimate[4 + cylinder, i], rest[cylinder, i], innovations[cylinder, i] = 0.0, 0.0, 0.0
                reluctance[cylinder, i] = 1.0
                for k in range(depth):
                    history[2 * k + cylinder, i] = joints[cylinder, 0]
            continue
        y1, y2, v1, v2 = estimate[0, i], estimate[1, i], estimate[2, i], estimate[3, i]
        r4, r2, w, s2, _, kappa, sine, cosine = geometry.pose(
            y1, y2, p[at.K1], p[at.K2], p[at.D_SQUARES], p[at.D_PRODUCT], p[at.SIN_GAMMA3], p[at.COS_GAMMA3]
        )
        load1 = (
            mechanics.piston_force(pressures[0, i], pressures[1, i], p[at.AREA_P1], p[at.AREA_N1], p[at.ATMOSPHERE])
            - p[at.FV1] * v1
            + mechanics.user_force1(force[0, i], force[1, i], kappa, sine, cosine)
            + believed[0, i]
        )
        load2 = (
            mechanics.piston_force(pressures[2, i], pressures[3, i], p[at.AREA_P2], p[at.AREA_N2], p[at.ATMOSPHERE])
            - p[at.FV2] * v2
            + mechanics.user_force2(force[0, i], force[1, i], sine, cosine)
            + believed[1, i]
        )
        a1 = (
            mechanics.acceleration1(load1, v1, v2, r2, r4, w, s2, kappa, sine, p[at.INVERSE_MASS], p[at.GRAVITY])
            + estimate[4, i]
        )
        a2 = mechanics.acceleration2(load2, v1, r2, r4, s2, cosine, p[at.INVERSE_MASS], p[at.GRAVITY]) + estimate[5, i]
        estimate[0, i] = min(max(y1 + period * (v1 + 0.5 * period * a1), -p[at.HALF_L1]), p[at.HALF_L1])
        estimate[1, i] = min(max(y2 + period * (v2 + 0.5 * period * a2), -p[at.HALF_L2]), p[at.HALF_L2])
        estimate[2, i] = v1 + period * a1
        estimate[3, i] = v2 + period * a2
        for cylinder in range(2):
            speed, resting = estimate[2 + cylinder, i], rest[cylinder, i]
            estimate[2 + cylinder, i] -= resting * (1.0 - held * held) * speed
            estimate[4 + cylinder, i] -= resting * (1.0 - held) ** 2 / period * speed
            slow = abs(estimate[2 + cylinder, i]) < REST_SPEED
            reluctance[cylinder, i] += (1.0 - reluctance[cylinder, i]) * min(period / TRUST_TIME, 1.0)
            settling = min(period / (REST_TIME * reluctance[cylinder, i]), 1.0)
            rest[cylinder, i] = (1.0 - moving[i]) * (resting + (1.0 - resting) * settling if slow else resting)
        history[2 * slot, i] = estimate[0, i]
        history[2 * slot + 1, i] = estimate[1, i]
        if sampled > 0.0:
            piston_motion(motion, p, joints, 1)
            periods = age / period
            back = min(int(periods), depth - 2)
            part = min(periods - back, 1.0)
            for cylinder in range(2):
                newer = history[2 * ((slot - back) % depth) + cylinder, i]
                older = history[2 * ((slot - back - 1) % depth) + cylinder, i]
                innovation = joints[cylinder, 0] - (newer + part * (older - newer))
                innovations[cylinder, i] += INNOVATION_FRACTION * (innovation - innovations[cylinder, i])
                explained = STIR * noise / (kappa if cylinder == 0 else 1.0)
                resting = rest[cylinder, i]
                if abs(innovations[cylinder, i]) > explained:
                    reluctance[cylinder, i] *= 1.0 + RELUCTANCE * resting
                    rest[cylinder, i], resting = 0.0, 0.0
                kept = exact.exp(-bandwidth * sampled)
                to_position = (1.0 - resting) * (1.0 - kept**3) + resting * (1.0 - exact.exp(-SLOW_BANDWIDTH * sampled))
                to_speed = (1.0 - resting) * 1.5 * (1.0 - kept) ** 2 * (1.0 + kept) / sampled
                to_disturbance = (1.0 - resting) * (1.0 - kept) ** 3 / sampled**2
                # What the sample says of its own instant is carried on to the present: late samples do not destabilise.
                for k in range(depth):
                    since = age - k * period
                    change = to_position + since * (to_speed + 0.5 * since * to_disturbance)
                    history[2 * ((slot - k) % depth) + cylinder, i] += change * innovation
                estimate[cylinder, i] = history[2 * slot + cylinder, i]
                estimate[2 + cylinder, i] += (to_speed + to_disturbance * age) * innovation
                estimate[4 + cylinder, i] += to_disturbance * innovation


@kernel
def _measured_joints(position: Array, velocity: Array, p: Array, joints: Array) -> None:
    motion, one = np.empty((4, 1)), np.empty((4, 1))
    for i in range(position.shape[1]):
        motion[0, 0], motion[1, 0] = position[0, i], position[1, i]
        motion[2, 0], motion[3, 0] = velocity[0, i], velocity[1, i]
        piston_motion(motion, p, one, 1)
        for row in range(4):
            joints[row, i] = one[row, 0]


def measured_joints(measurement: Measurement, lane_parameters: Array) -> Array:
    """y1, y2 (m), v1, v2 (m/s), (4, N), where position and velocity are measured at every control period."""
    joints = np.empty((4, measurement.position.shape[1]))
    _measured_joints(measurement.position, measurement.velocity, lane_parameters, joints)
    return joints


def memory_rows(parameters: Parameters) -> int:
    """Rows of the memory that a rig's tracker asks for."""
    board = parameters.electronics
    return HISTORY + 2 * (int((board.position_latency + 1 / board.position_rate) / board.control_period) + 4)


class PistonObserver:
    """Positions and speeds of both pistons, (4, N): y1, y2 (m), v1, v2 (m/s), from sampled positions.

    After ``update``, ``disturbance`` (2, N), m/s2, is what accelerates the pistons without being known, and ``rest`` (2, N) how
    far each of them is taken to rest, 0 to 1.
    """

    def __init__(self, parameters: Parameters, lane_parameters: Array, bandwidth: float = BANDWIDTH) -> None:
        board = parameters.electronics
        self._period = board.control_period
        self._bandwidth, self._noise = bandwidth, board.position_noise
        self._p = lane_parameters
        self._rows = memory_rows(parameters)
        self._memory: Array = np.empty((self._rows, 0))

    @property
    def disturbance(self) -> Array:
        """d of both pistons, m/s2, (2, N)."""
        return self._memory[ESTIMATE + 4 : REST]

    @property
    def rest(self) -> Array:
        """How far each piston is taken to rest, 0 to 1, (2, N)."""
        return self._memory[REST:INNOVATION]

    def reset(self, lanes: Mask | None = None) -> None:
        """Forget the past of all lanes, or of those where ``lanes`` (N,) is True."""
        if lanes is None:
            self._memory = np.empty((self._rows, 0))
        elif self._memory.shape[1]:
            self._memory[FRESH, lanes] = 1.0

    def update(
        self,
        measurement: Measurement,
        force: Array | None = None,
        believed: Array | None = None,
        moving: Array | None = None,
    ) -> Array:
        """Take one control period's measurement (over N lanes) and return the estimate (4, N).

        ``force`` (2, N), N, is the user's where it is measured; ``believed`` (2, N), N, acts along the pistons besides.
        ``moving`` (N,) is 1 where the end effector is to move, else 0; without it no piston is taken to rest.
        """
        lanes = measurement.position.shape[1]
        if self._memory.shape[1] != lanes:
            self._memory = np.zeros((self._rows, lanes))
            self._memory[FRESH] = 1.0
        observe(
            self._memory, measurement.time, measurement.position, measurement.position_time, measurement.velocity,
            measurement.pressures, self._p, self._period, self._bandwidth, self._noise,
            np.zeros((2, lanes)) if force is None else force, np.zeros((2, lanes)) if believed is None else believed,
            np.ones(lanes) if moving is None else moving,
        )  # fmt: skip
        return self._memory[:4]
