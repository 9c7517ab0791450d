"""Own error: the end effector minus what the declared impedance would do under the same force."""

import numpy as np
from scipy.linalg import expm

from baselines.impedance import Impedance
from birthsim_env.loop.signals import Reference
from birthsim_env.physics.compiled.lanes import Array
from lab.studies.haptics.recording import Recording


def declared_offset(impedance: Impedance, force: Array, period: float) -> Array:
    """Offset from the target, m, (T, 2, N), of the impedance from rest under forces (T, 2, N), N, ``period`` s apart.

    Between its samples the force is a straight line, for which the solution is exact.
    """
    lanes = force.shape[2]
    step, now, change = np.empty((lanes, 4, 4)), np.empty((lanes, 4, 2)), np.empty((lanes, 4, 2))
    for lane in range(lanes):
        inverse = np.linalg.inv(impedance.mass[..., lane])
        system = np.zeros((8, 8))
        system[:2, 2:4] = system[4:6, 6:8] = np.eye(2)
        system[2:4, :2], system[2:4, 2:4] = -inverse @ impedance.stiffness[..., lane], -inverse @ impedance.damping[..., lane]
        system[2:4, 4:6] = inverse
        whole = expm(period * system)
        step[lane], now[lane], change[lane] = whole[:4, :4], whole[:4, 4:6], whole[:4, 6:8] / period
    pushes = np.ascontiguousarray(force.transpose(0, 2, 1))[..., None]
    driven = now @ pushes[:-1] + change @ (pushes[1:] - pushes[:-1])
    state, offset = np.zeros((lanes, 4, 1)), np.zeros(force.shape)
    for k in range(force.shape[0] - 1):
        state = step @ state + driven[k]
        offset[k + 1] = state[:, :2, 0].T
    return offset


def pure_spring_offset(reference: Reference, force: Array) -> Array:
    """Offset from the target, m, (T, 2, N), of the spring that is asked for, (19), under forces (T, 2, N), N."""
    return np.stack([reference.compliant_target(one) - reference.position for one in force])


def error_size(recording: Recording, reference: Reference, offset: Array, begin: float, end: float) -> Array:
    """Root mean square distance, m, (N,), of the end effector from target and ``offset`` between two times, s."""
    apart = Recording(
        recording.time, recording.position - reference.position - offset, recording.velocity, recording.force, recording.energy
    ).part(begin, end)
    return np.asarray(np.sqrt((apart.position**2).sum(axis=1).mean(axis=0)))
