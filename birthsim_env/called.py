"""Steps of a control period that call what a user has written in Python, in place of a stage."""

from typing import ClassVar

import numpy as np

from birthsim_env.loop import rows as at
from birthsim_env.loop.instant import Instant
from birthsim_env.loop.rows import fill_measurement
from birthsim_env.parts.actuation import Actuation
from birthsim_env.parts.hands.user_forces import UserForce, forces_of
from birthsim_env.parts.references import Trajectory
from birthsim_env.parts.sensors.model import SensorModel
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.physics.compiled.lanes import CELL_AT_VALVE, V1, V2, Y1, Y2, Array
from birthsim_env.physics.plant import checked
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.restored import Declared, Kept


class Parts(Instant):
    """The parts of ``num_envs`` lanes, and how each is asked in Python.

    ``periods`` control periods of ``period`` s make a policy step.
    """

    in_state: ClassVar[Declared] = {"_sample": Kept(0, 2**62, whole=True), "_samples": Kept(grows=True)}

    def __init__(
        self,
        parameters: Parameters,
        num_envs: int,
        trajectory: Trajectory,
        user_force: UserForce,
        stiffness: StiffnessSchedule,
        sensors: SensorModel,
        actuation: Actuation,
        periods: int,
    ) -> None:
        super().__init__(parameters, num_envs)
        self.trajectory, self.user_force, self.stiffness = trajectory, user_force, stiffness
        self.sensors, self.actuation = sensors, actuation
        self.period, self.periods = parameters.electronics.control_period, periods
        self._wanted: Array = np.zeros((4, num_envs))
        self._shown: Array = np.zeros((0, num_envs))
        self._samples: Array = np.zeros((0, 2, num_envs))
        self._sample = 0

    def _ask(self, period: int) -> None:
        if period == 0 or self.actuation.every_period:
            openings = self.actuation.openings(self.plant, self.measurement, self.reference)
            self._wanted[:] = checked("actuation.openings(...)", openings, (4, self.plant.num_envs), "1")
            if self.actuation.memory_names:
                self._shown[:] = self.actuation.memory()
        # Anew in every period: the board of the sensors may have put out something else.
        self._openings[:] = self._wanted

    def _put_out(self, _: int) -> None:
        self._openings[:] = self.sensors.put_out(self.ticks, self._openings)

    def _follow(self, _: int) -> None:
        rows = self.trajectory.sample(self.time)
        self._seen[at.REFERENCE : at.REFERENCE + 8] = checked("reference.sample(time)", rows, (8, self.plant.num_envs), "SI")

    def _set(self, _: int) -> None:
        rows = self.stiffness.sample(self.time)
        self._seen[at.REFERENCE + 8 : at.ASKED] = checked("stiffness.sample(time)", rows, (7, self.plant.num_envs), "N/m")

    def _push(self, _: int) -> None:
        self._sample += 1
        if self._sample >= len(self._samples):
            # A hand that does not feel the rig is asked for a policy step at once.
            count = 1 if self.user_force.closed_loop else self.periods
            times = (self._tick + np.arange(count)[:, None]) * self.period
            self._samples = forces_of(self.user_force, times, self._motion[:2].copy(), self._motion[2:].copy()).copy()
            self._sample = 0
        self._force[:] = self._samples[self._sample]

    def _measure(self, _: int) -> None:
        plant = self.plant
        at_cylinders = plant.state[[Y1, V1, Y2, V2]], plant.lane_parameters
        cells = np.where(plant.lane_parameters[CELL_AT_VALVE] > 0.5, self._at_valves, plant.pressures)
        now = self.sensors.measure(self.ticks, self.time, self.motion, cells, self.force, *at_cylinders)
        fill_measurement(self._seen, now)
        self._sampled = now.sampled
