"""Friction of a piston along a given motion and pressures, as on a test bench: the plant's laws without its mechanics."""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from birthsim_env.physics import dynamics
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array, parameter_array
from birthsim_env.physics.plant import checked
from birthsim_env.physics.rig.arrays import shape_of
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.physics.rig.values import shown
from birthsim_env.physics.runge_kutta import STAGES, ahead_of, weight_of
from birthsim_env.physics.seals import maxwell_slip

ROWS = at.STATES + maxwell_slip.ROWS
"""Of a state with the elements of ``maxwell_slip``."""


@helper
def _friction(x: Array, p: Array, dx: Array, cylinder: int) -> float:
    """Friction, N, with the rates of the bristles in ``dx`` (ROWS, 1)."""
    if p[at.GMS, 0] > 0.5:
        force, rate = maxwell_slip.piston_friction(x, p, dx, 0, cylinder, at.STATES)
    else:
        force, rate = dynamics.piston_friction(x, p, 0, cylinder)
    dx[at.Z1 + cylinder, 0] = rate
    return force


@kernel
def _rub(times: Array, speed: Array, pressures: Array, p: Array, cylinder: int, longest: float, forces: Array) -> None:
    """Writes friction (T,); speed and pressures are straight lines between samples, and constant within a step."""
    x, dx, total = np.zeros((ROWS, 1)), np.zeros((ROWS, 1)), np.zeros((ROWS, 1))
    trial, v, pp = np.zeros((ROWS, 1)), at.V1 + 2 * cylinder, at.PP1 + 4 * cylinder
    for t in range(len(times)):
        if t > 0:
            steps = int((times[t] - times[t - 1]) / longest) + 1
            step = (times[t] - times[t - 1]) / steps
            for k in range(steps):
                share = (k + 0.5) / steps
                x[v, 0] = speed[t - 1] + share * (speed[t] - speed[t - 1])
                for side in range(2):
                    early, late = pressures[side, t - 1], pressures[side, t]
                    x[pp + 2 * side, 0] = early + share * (late - early)
                total[:], trial[:] = x, x
                for stage in range(STAGES):
                    _friction(trial, p, dx, cylinder)
                    total += weight_of(stage, step) * dx
                    trial[:] = x + ahead_of(stage, step) * dx
                maxwell_slip.switch_elements(x, total, p, at.STATES, step, 1)
                x[:] = total
        x[v, 0], x[pp, 0], x[pp + 2, 0] = speed[t], pressures[0, t], pressures[1, t]
        forces[t] = _friction(x, p, dx, cylinder)


def friction_along(
    parameters: Parameters | str | Path | None, cylinder: int, times: ArrayLike, speed: ArrayLike, pressures: ArrayLike
) -> Array:
    """Friction of a cylinder along a motion that is given, from bristles at rest.

    Parameters
    ----------
    parameters : Parameters, path or None
        The rig; None stands for the default one.
    cylinder : int
        1 or 2.
    times : array-like, (T,)
        Increasing, s.
    speed : array-like, (T,)
        Of the piston, m/s, positive outwards.
    pressures : array-like, (2, T)
        Of chambers P and N, Pa absolute.

    Returns
    -------
    ndarray, (T,)
        N, positive where it holds back a motion outwards.

    Raises
    ------
    ValueError
        Names the argument, its value and what is allowed.

    Examples
    --------
    A seal that pressure presses on, at 10 mm/s with 1 bar and with 7 bar in one chamber:

    >>> import numpy as np
    >>> from birthsim_env.physics.seals.driven_friction import friction_along
    >>> rig = Parameters().replace({"cylinder2.coulomb_friction": 3.0, "cylinder2.pressure_friction": 5e-6})
    >>> times, air = np.linspace(0, 1, 101), rig.air.atmospheric_pressure
    >>> pressures = np.stack([np.where(times < 0.5, 1e5, 7e5), np.zeros(101)]) + air
    >>> friction_along(rig, 2, times, np.full(101, 0.01), pressures)[[49, 100]].round(1)
    array([4.6, 8.3])
    """
    rig = load_parameters(parameters)
    if cylinder not in (1, 2):
        raise ValueError(f"cylinder = {shown(cylinder)}; allowed: 1 or 2")
    count = shape_of(times)[:1] or (0,)
    instants = checked("times", times, (*count,), "s")
    if not len(instants) or np.any(np.diff(instants) <= 0):
        raise ValueError(f"times = {shown(instants.tolist())}; allowed: at least one, each later than the one before (s)")
    motion, air = checked("speed", speed, instants.shape, "m/s"), checked("pressures", pressures, (2, *count), "Pa")
    forces = np.empty(len(instants))
    p = parameter_array(rig, 1)
    _rub(instants, motion, air, p, int(cylinder) - 1, dynamics.INTEGRATION_STEP, forces)
    return forces
