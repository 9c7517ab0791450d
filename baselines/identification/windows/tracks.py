"""What windows of a log would have shown: kernels that move lanes of the plant, with options and without, through its rows."""

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.world import Clock
from birthsim_env.physics import options
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.blocks import BLOCK
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.dynamics import integrate, load, settle, store
from birthsim_env.physics.linkage.geometry import end_effector_motion
from birthsim_env.physics.pneumatics.spools import admit


@kernel
def admit_rows(openings: Array, parameters: Array, admitted: Array) -> None:
    """Writes what the openings of a log (4, T) become behind play and limit of the valves of a rig (PARAMETERS, 1)."""
    last = np.zeros((4, 1))
    for k in range(openings.shape[1]):
        admit(openings[:, k : k + 1], parameters, last, admitted[:, k : k + 1], 1)


@kernel
def track(
    state: Array, openings: Array, forces: Array, rows: NDArray[np.int64], parameters: Array, clock: Clock, tracks: Array
) -> None:
    """Moves ``state`` (18, N) by K periods of a ``clock``, under openings (4, T) and forces (2, T) from
    ``rows`` (N,) on; writes pressures and position of the end effector at every period, ``tracks`` (K + 1, 6, N)."""
    x, u, f = np.empty((at.STATES, BLOCK)), np.empty((4, BLOCK)), np.empty((2, BLOCK))
    p, hit, motion = np.empty((at.PARAMETERS, BLOCK)), np.zeros((2, BLOCK)), np.empty((4, BLOCK))
    periods, steps = tracks.shape[0] - 1, int(clock.steps)
    for first in range(0, state.shape[1], BLOCK):
        n = min(BLOCK, state.shape[1] - first)
        load(state, first, n, x)
        load(parameters, first, n, p)
        for k in range(periods + 1):
            end_effector_motion(x[:, :n], p[:, :n], motion[:, :n])
            for i in range(n):
                for chamber in range(4):
                    tracks[k, chamber, first + i] = x[at.PRESSURES[chamber], i]
                for axis in range(2):
                    tracks[k, 4 + axis, first + i] = motion[axis, i]
            if k < periods:
                for i in range(n):
                    row = rows[first + i] + k
                    for valve in range(4):
                        u[valve, i] = openings[valve, row]
                    for axis in range(2):
                        f[axis, i] = forces[axis, row]
                integrate(x, u, f, p, steps, clock.period / steps, hit, n)
                settle(x, n)
        store(x, first, n, state)


@kernel
def begin_options(state: Array, parameters: Array, known: Array, further: Array) -> None:
    """Writes the ``further`` rows (FURTHER, N) with which states (18, N) begin: pressures of the supply and at the
    tubes' ends are ``known`` (5, N), flows are those through the valves there, and the rest is as ``options.rest`` has it."""
    flows = np.empty((8, state.shape[1]))
    options.rest(state, parameters, further)
    for i in range(state.shape[1]):
        if parameters[at.LINE, i] > 0.0:
            further[options.RESERVOIR, i] = known[0, i]
            parameters[at.SUPPLY, i], parameters[at.INVERSE_SUPPLY, i] = known[0, i], 1.0 / known[0, i]
        for k in range(4):
            further[options.TUBES + k, i] = known[1 + k, i]
    options.mass_flows(state, further, parameters, flows)
    for i in range(state.shape[1]):
        for k in range(4):
            further[options.FLOWS + k, i] = flows[k, i] - flows[4 + k, i] if parameters[at.TUBE_LENGTH, i] > 0.0 else 0.0


@kernel
def track_options(
    state: Array,
    further: Array,
    openings: Array,
    forces: Array,
    rows: NDArray[np.int64],
    parameters: Array,
    clock: Clock,
    tracks: Array,
) -> None:
    """``track`` of rigs with options, whose ``further`` rows (FURTHER, N) move along."""
    scratch, u, f = np.empty((options.SCRATCH, BLOCK)), np.empty((4, BLOCK)), np.empty((2, BLOCK))
    hit, motion = np.zeros((2, BLOCK)), np.empty((4, BLOCK))
    x, more, p = np.empty((at.STATES, BLOCK)), np.empty((options.FURTHER, BLOCK)), np.empty((at.PARAMETERS, BLOCK))
    periods, steps = tracks.shape[0] - 1, int(clock.steps)
    for first in range(0, state.shape[1], BLOCK):
        n = min(BLOCK, state.shape[1] - first)
        load(state, first, n, x)
        load(further, first, n, more)
        load(parameters, first, n, p)
        for k in range(periods + 1):
            options.port_motion(x[:, :n], more[:, :n], p[:, :n], motion[:, :n])
            for i in range(n):
                for chamber in range(4):
                    at_valve = p[at.CELL_AT_VALVE, i] > 0.5
                    end, own = more[options.TUBES + chamber, i], x[at.PRESSURES[chamber], i]
                    tracks[k, chamber, first + i] = end if at_valve else own
                for axis in range(2):
                    tracks[k, 4 + axis, first + i] = motion[axis, i]
            if k < periods:
                for i in range(n):
                    row = rows[first + i] + k
                    for valve in range(4):
                        u[valve, i] = openings[valve, row]
                    for axis in range(2):
                        f[axis, i] = forces[axis, row]
                options.integrate(
                    x[:, :n], more[:, :n], u[:, :n], f[:, :n], p[:, :n], steps, clock.period / steps, hit[:, :n], scratch, n
                )
        store(x, first, n, state)
        store(more, first, n, further)
