"""N lanes of a scenario: plant, sensors, reference, hand and stiffness setpoints on one clock.

The environments are thin faces of this class. Time counts in control periods; the state is integrated between control
instants, and at each of them reference, user force and measurement belong to the same instant.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from birthsim_env.parts.actuation import Actuation
from birthsim_env.parts.courses import checked_start
from birthsim_env.parts.randomization import Ranges, draw_columns
from birthsim_env.parts.references import Trajectory
from birthsim_env.parts.sensors import SENSORS
from birthsim_env.parts.signals import REFERENCES, Mask, Measurement, Reference
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.parts.user_forces import UserForce, forces_of
from birthsim_env.parts.worlds import begin, worlds
from birthsim_env.physics.compilation import kernel
from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.physics.geometry import end_effector_motion, inverse_geometry
from birthsim_env.physics.inverse_kinematics import pistons_at
from birthsim_env.physics.lanes import Array, parameter_column
from birthsim_env.physics.parameters import Parameters
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.strength import require_carried


class Simulation:
    """``num_envs`` lanes under one actuation, ``periods`` control periods per policy step.

    After ``begin`` and after every ``step`` the attributes describe the present instant: ``time`` (N,) s since each lane's
    episode began; ``motion`` (4, N) true x, y, vx, vy of the end effector; ``reference`` and ``measurement``; ``since_jump``
    (N,) s since force or stiffness setpoint jumped; ``openings`` (4, N) as last commanded; ``impacts`` (2, N) m/s, the fastest
    collision of each piston with an end stop during the last step. ``period`` is that of control, s, and ``periods`` how many
    of them make a policy step.
    """

    def __init__(
        self,
        num_envs: int,
        parameters: Parameters,
        ranges: Ranges,
        trajectory: Trajectory,
        user_force: UserForce,
        stiffness: StiffnessSchedule,
        sensors: str,
        actuation: Actuation,
        periods: int,
    ) -> None:
        self.parameters = parameters
        self.plant = Plant(parameters, num_envs)
        self.nominal = parameter_column(parameters)
        self.trajectory, self.user_force, self.stiffness = trajectory, user_force, stiffness
        self.sensors = SENSORS[sensors](parameters.electronics, num_envs)
        self.actuation = actuation
        for part in (trajectory, user_force, stiffness):
            part.prepare(num_envs)
        self.period = parameters.electronics.control_period
        self.ticks: NDArray[np.int64] = np.zeros(num_envs, dtype=np.int64)
        self.time: Array = np.zeros(num_envs)
        self.motion: Array = np.zeros((4, num_envs))
        self.since_jump: Array = np.zeros(num_envs)
        self.impacts: Array = np.zeros((2, num_envs))
        self.openings: Array = np.zeros((4, num_envs))
        self.periods = periods
        self.reference = Reference(np.zeros((REFERENCES, num_envs)))
        self.measurement: Measurement
        stepwise = actuation.every_period or self.sensors.sampled or user_force.closed_loop
        self._stride, self._strides = (1, periods) if stepwise else (periods, 1)
        self._ranges, self._begun = ranges, False
        self._forces: Array = np.zeros((self._stride, 2, num_envs))

    @property
    def force(self) -> Array:
        """User force now, N, (2, N)."""
        return np.asarray(self._forces[0])

    def begin(
        self, lanes: Mask, seeds: list[int], episodes: NDArray[np.int64], duration: float, position: Array | None = None
    ) -> None:
        """Start new episodes in the lanes of a mask (N,): draw their world and put the pistons on the reference, in balance.

        ``position`` (2,), m, starts the end effector there, at rest, instead. Raises ``ValueError`` for a reference that
        leaves the workspace within ``duration`` s, a position outside it, and at first for a rig that cannot carry its weight.
        """
        chosen = np.flatnonzero(lanes)
        for block, streams in worlds(chosen, seeds, episodes):
            if self._ranges:
                columns = draw_columns(self.parameters, self._ranges, streams["parameters"], len(block))
                self.plant.lane_parameters[:, block] = columns
            begin(self.trajectory, block, streams["reference"])
            begin(self.user_force, block, streams["user_force"])
            begin(self.stiffness, block, streams["stiffness"])
            begin(self.sensors, block, streams["sensors"])
        self.actuation.begin(lanes)
        self.ticks[lanes] = 0
        self.since_jump[lanes] = 0.0
        self.impacts[:, lanes] = 0.0
        # Not in place: an actuation may keep the array that it returned.
        self.openings = np.where(lanes, 0.0, self.openings)
        rows = checked_start(
            self.trajectory, self.stiffness, chosen, len(lanes), duration, self.parameters, self.nominal
        )  # fmt: skip
        start, speed = rows[0:2], rows[2:4]
        if position is not None:
            start, speed = np.repeat(position[:, None], len(chosen), axis=1), np.zeros((2, len(chosen)))
        if not self._begun:
            # The rig as described: that one of those drawn cannot carry its mass is part of the experiment.
            require_carried(start, self.parameters)
            self._begun = True
        inverse_geometry(start, self.parameters)  # refuses what is out of reach
        joints = np.empty((4, len(chosen)))
        pistons_at(np.concatenate([start, speed]), self.nominal, joints)
        own = self.plant.lane_parameters.take(chosen, axis=1)
        self.plant.state[:, chosen] = balanced_state(own, joints[:2], joints[2:], rows[10:12])
        self._look()

    def step(self, actions: Array) -> None:
        """Integrate over one policy step with ``actions`` (size, N), contiguous float64 in [-1, 1]."""
        self.actuation.accept(actions)
        impacts = np.zeros_like(self.impacts)
        for _ in range(self._strides):
            self.openings = self.actuation.openings(self.plant, self.measurement, self.reference)
            self.plant.advance_unchecked(self.openings, self._forces, self._stride * self.period)
            np.maximum(impacts, self.plant.impacts, out=impacts)
            self.ticks += self._stride
            forces, setpoints = self._forces, self.reference.rows
            self._look()
            _track_jumps(
                forces, self._forces, setpoints, self.reference.rows, self.period, self.user_force.jump_rate, self.since_jump
            )
        self.impacts = impacts

    def _look(self) -> None:
        """Bring every attribute but ``since_jump`` and ``impacts`` to the present instant."""
        plant = self.plant
        self.time = self.ticks.astype(np.float64) * self.period
        motion = np.empty_like(self.motion)
        end_effector_motion(plant.state, plant.lane_parameters, motion)
        self.motion = motion
        times = self.time + self.period * np.arange(self._stride)[:, None]
        # A copy: the hand may fill one array anew each time, and jumps are told from the old samples and the new.
        self._forces = forces_of(self.user_force, times, motion[:2], motion[2:]).copy()
        self.reference = self.reference_at(self.time)
        self.measurement = self.sensors.measure(self.ticks, self.time, motion, plant.pressures, self._forces[0])

    def reference_at(self, time: Array) -> Reference:
        """What is asked for at ``time`` (N,) of the present episodes, s."""
        rows = np.empty((REFERENCES, time.shape[0]))
        rows[:8] = self.trajectory.sample(time)
        rows[8:] = self.stiffness.sample(time)
        return Reference(rows)


@kernel
def _track_jumps(
    forces: Array, later: Array, setpoints: Array, new: Array, period: float, jump_rate: float, since: Array
) -> None:
    """Adds the held time to ``since`` (N,), starting anew where the force changes faster than ``jump_rate``, N/s, or a
    closed-loop setpoint changes at all."""
    samples = forces.shape[0]
    for i in range(since.shape[0]):
        for k in range(samples):
            since[i] += period
            for axis in range(2):
                after = forces[k + 1, axis, i] if k + 1 < samples else later[0, axis, i]
                if abs(after - forces[k, axis, i]) > jump_rate * period:
                    since[i] = 0.0
        if setpoints[8, i] != new[8, i] or setpoints[9, i] != new[9, i] or setpoints[14, i] != new[14, i]:
            since[i] = 0.0
