"""The limiter's parts by themselves, over N lanes."""

import numpy as np

from baselines.limiter import air_spring
from baselines.limiter.past import recall, slots_of
from baselines.limiter.port_energy import Energy, Work, count_work
from birthsim_env.loop.rows import Signals, fill_measurement
from birthsim_env.loop.signals import InPlane, Joints
from birthsim_env.physics.compiled.lanes import Rig, parameter_column
from birthsim_env.physics.inverse_kinematics import pistons_at


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
        for lane, periods in enumerate(late / self.period):
            recall(self.kept, self.newest, self.slots, periods, signals, told, lane)
        return told


class PortEnergy:
    def __init__(self, lanes):
        self.own, self.work = Energy(np.zeros((Energy.size, lanes))), Work(np.zeros((Work.size, lanes)))
        self.own.stamp[:] = -np.inf

    def update(self, measurement, reference, force):
        for lane in range(force.shape[1]):
            count_work(self.own, signals_of(measurement, reference), force, self.work, lane)
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
        for lane in range(opening.shape[1]):
            hand = InPlane(seen.user_force.copy())
            air_spring.passive_openings(self.forces, self.rate, seen.pressure, hand, *joints, seen, Rig(self.p), opening, lane)
        return opening
