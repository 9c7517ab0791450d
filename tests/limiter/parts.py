"""The limiter's parts by themselves: kernels that call its helpers, over N lanes."""

import numpy as np

from baselines.limiter import air_spring
from baselines.limiter.past import recall, slots_of
from baselines.limiter.port_energy import Energy, Work, count_work
from birthsim_env.loop.rows import Signals, fill_measurement
from birthsim_env.loop.signals import InPlane, Joints
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array, Rig, parameter_column
from birthsim_env.physics.inverse_kinematics import pistons_at


@kernel
def _recall(kept: Array, newest: Array, slots: int, late: Array, signals: Array, told: Array) -> None:
    for i in range(late.shape[0]):
        recall(kept, newest, slots, late[i], signals, told, i)


@kernel
def _count(own: Energy, seen: Signals, force: Array, work: Work) -> None:
    for i in range(force.shape[1]):
        count_work(own, seen, force, work, i)


@kernel
def _passive(
    forces: Array, rate: float, hand: InPlane, here: Joints, there: Joints, seen: Signals, p: Rig, opening: Array
) -> None:  # fmt: skip
    for i in range(hand.x.shape[0]):
        air_spring.passive_openings(forces, rate, seen.pressure, hand, here, there, seen, p, opening, i)


def signals_of(measurement, reference):
    seen = Signals(np.zeros((Signals.size, measurement.position.shape[1])))
    fill_measurement(seen.rows, measurement)
    seen.reference.rows[:] = reference.rows
    return seen


class Past:
    """``rows`` signals of ``lanes``, once per period."""

    def __init__(self, period, rows, lanes):
        self.period, self.slots = period, slots_of(period)
        self.kept, self.newest = np.full((self.slots * rows, lanes), np.nan), np.zeros(lanes)

    def at(self, late, signals):
        told = np.empty_like(signals)
        _recall(self.kept, self.newest, self.slots, late / self.period, signals, told)
        return told


class PortEnergy:
    def __init__(self, lanes):
        self.own, self.work = Energy(np.zeros((Energy.size, lanes))), Work(np.zeros((Work.size, lanes)))
        self.own.stamp[:] = -np.inf

    def update(self, measurement, reference, force):
        _count(self.own, signals_of(measurement, reference), force, self.work)
        return self.work


class AirSpring:
    def __init__(self, rig, lanes, rate):
        self.p, self.forces, self.rate = parameter_column(rig), np.full((4, lanes), np.nan), rate

    def openings(self, measurement, reference):
        opening, joints = np.empty_like(self.forces), []
        for place in (measurement.position, reference.position):
            joints.append(Joints(np.empty((Joints.size, place.shape[1]))))
            pistons_at(np.concatenate([place, np.zeros_like(place)]), Rig(self.p), joints[-1].rows)
        seen = signals_of(measurement, reference)
        _passive(self.forces, self.rate, InPlane(seen.user_force.copy()), *joints, seen, Rig(self.p), opening)
        return opening
