"""The plant alone: N rigs side by side, without Gymnasium."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from birthsim_env.physics import dynamics, options
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.lanes import PRESSURES, STATES, TEMPERATURES, V1, V2, Y1, Y2, Array, parameter_array
from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.physics.pneumatics import spools
from birthsim_env.physics.rig.arrays import floats_of, shape_of
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.physics.rig.values import checked_count, is_within, shown

if TYPE_CHECKING:
    from birthsim_env.gradients.plant import Derivatives

MOST_LANES = 2**20
"""Lanes side by side; a million take some gigabytes."""

LONGEST = 3600.0
"""s that ``Plant.advance`` integrates in one call."""


def checked(name: str, value: ArrayLike, shape: tuple[int, ...], unit: str) -> Array:
    """``value`` as a contiguous float64 array of ``shape``, or a ``ValueError`` that names what is wrong with it."""
    try:
        array = floats_of(value)
    except ValueError as error:
        raise ValueError(f"{name} = {shown(value)}: {error}; allowed: numbers of shape {shape} ({unit})") from error
    if array.shape != shape:
        raise ValueError(f"{name} has shape {array.shape}; allowed: {shape} ({unit})")
    if not np.isfinite(array).all():
        where = tuple(int(k) for k in np.argwhere(~np.isfinite(array))[0])
        raise ValueError(f"{name}{list(where)} = {array[where]}; allowed: finite numbers ({unit})")
    return np.ascontiguousarray(array)


class Plant:
    """The plant alone: N rigs side by side, without Gymnasium, sensors or a controller; one lane is one rig.

    Parameters
    ----------
    parameters : Parameters, path, None, or a sequence of them
        One rig for all lanes, or one per lane; None stands for the defaults.
    num_envs : int
        Number of lanes N.

    Raises
    ------
    ValueError
        Names the argument, its value and what is allowed.

    Notes
    -----
    ``state`` (18, N), with the rows of ``STATE_NAMES``, SI units, may be read and written. It starts at mid stroke, at rest,
    with pressures that balance the weight, and is integrated by Runge-Kutta steps of 1/3 ms. The equations are those of
    Herzig et al., IROS 2015, doi 10.1109/IROS.2015.7353583; each file of ``birthsim_env/physics`` names its further sources.

    Examples
    --------
    A hand pushes two rigs with 10 N along x for 50 ms, while the valves stay shut:

    >>> import numpy as np, birthsim
    >>> plant = birthsim.Plant(num_envs=2)
    >>> before = plant.end_effector()[0]
    >>> state = plant.advance(np.zeros((4, 2)), np.array([[10.0, 10.0], [0.0, 0.0]]), 0.05)
    >>> state.shape, bool((plant.end_effector()[0] > before).all())
    ((18, 2), True)
    """

    def __init__(self, parameters: Parameters | str | Path | Sequence[Parameters] | None = None, num_envs: int = 1) -> None:
        checked_count("num_envs", num_envs, 1, MOST_LANES)
        several = isinstance(parameters, Sequence) and not isinstance(parameters, str)
        rigs = parameters if several else load_parameters(parameters)  # type: ignore[arg-type]
        self.num_envs = int(num_envs)
        self.lane_parameters: Array = parameter_array(rigs, self.num_envs)  # type: ignore[arg-type]
        self._state = balanced_state(self.lane_parameters, np.zeros((2, self.num_envs)))
        self.impacts: Array = np.zeros((2, self.num_envs))
        """Largest speed at which each piston ran into an end stop during the last ``advance``, m/s, (2, num_envs)."""
        self.memory: Array = np.zeros((4 + options.FURTHER, self.num_envs))
        """Where the play of valves with hysteresis is, and the further states of ``physics.options``."""
        self.begin(np.arange(self.num_envs))

    def begin(self, lanes: NDArray[np.intp]) -> None:
        """Forget the past of ``lanes`` (L,): their valves have not moved, and their options begin at rest with the state."""
        self.memory[:, lanes] = 0.0
        if not options.are_off(self.lane_parameters):
            own = self.lane_parameters.take(lanes, axis=1)
            own[at.SUPPLY], own[at.INVERSE_SUPPLY] = own[at.SOURCE], 1.0 / own[at.SOURCE]
            self.lane_parameters[:, lanes] = own
            further = np.empty((options.FURTHER, len(lanes)))
            options.rest(self._state.take(lanes, axis=1), own, further)
            self.memory[4:, lanes] = further

    @property
    def state(self) -> Array:
        """The state, (18, num_envs), with the rows of ``STATE_NAMES``, SI units.

        Assigning to it checks, copies and forgets the past of valves, tubes, supply and handle."""
        return self._state

    @state.setter
    def state(self, state: ArrayLike) -> None:
        self._state[:] = checked("state", state, (STATES, self.num_envs), "SI")
        self.begin(np.arange(self.num_envs))

    def derivatives(self, state: ArrayLike, opening_command: ArrayLike, user_force: ArrayLike) -> Array:
        """d(state)/dt, (18, num_envs), for a state (18, num_envs), openings (4, num_envs) and forces (2, num_envs), N.

        The openings are those that spools go to: hysteresis and limit of the valves are ``advance``'s, and so are tubes
        and the handle (``physics.options``).
        """
        x, force = checked("state", state, self.state.shape, "SI"), checked("user_force", user_force, (2, self.num_envs), "N")
        rates = np.empty_like(x)
        dynamics.derivatives(x, self._openings(opening_command), force, self.lane_parameters, rates)
        return rates

    def advance(self, opening_command: ArrayLike, user_force: ArrayLike, duration: float) -> Array:
        """Integrate ``state`` over ``duration`` seconds and return it.

        ``opening_command`` (4, num_envs), in [-1, 1], for the valves of chambers P1, N1, P2, N2. ``user_force`` in N is
        (2, num_envs), constant, or (K, 2, num_envs), each of K samples held for an equal fraction of the duration.
        Raises ``ValueError`` for wrong shapes, values that are not finite or not allowed, and a duration that is not positive.
        """
        self.advance_unchecked(*self._inputs(opening_command, user_force, duration))
        return self.state

    def vjp(self, opening_command: ArrayLike, user_force: ArrayLike, duration: float) -> "Callable[..., Derivatives]":
        """``advance``, with its arguments and bits; returns its pullback, see ``gradients.plant.vjp``."""
        from birthsim_env.gradients.plant import vjp  # late: it generates code

        return vjp(self, *self._inputs(opening_command, user_force, duration))

    def advance_unchecked(self, command: Array, forces: Array, duration: float) -> None:
        """``advance`` for arrays known to be right: command (4, num_envs), forces (K, 2, num_envs), contiguous float64."""
        if not spools.are_perfect(self.lane_parameters):
            opening = np.empty_like(command)
            spools.admit_lanes(command, self.lane_parameters, self.memory[:4], opening)
            command = opening
        held = duration / forces.shape[0]
        steps = dynamics.steps_in(held)
        how = forces, self.lane_parameters, steps, held / steps, self.impacts
        if options.are_off(self.lane_parameters):
            dynamics.advance(self.state, command, *how)
        else:
            options.advance(self.state, self.memory[4:], command, *how)

    def mass_flows(self) -> Array:
        """Flows at the valves of chambers P1, N1, P2, N2 now, kg/s, (8, num_envs): rows 0-3 from the supply, 4-7 to the
        atmosphere."""
        flows = np.empty((8, self.num_envs))
        options.mass_flows(self.state, self.memory[4:], self.lane_parameters, flows)
        return flows

    @property
    def piston(self) -> Array:
        """Piston positions (y1, y2), m, (2, num_envs)."""
        return self.state[[Y1, Y2]]

    @property
    def piston_speed(self) -> Array:
        """Piston speeds (v1, v2), m/s, (2, num_envs)."""
        return self.state[[V1, V2]]

    @property
    def pressures(self) -> Array:
        """Pressures of chambers P1, N1, P2, N2, Pa absolute, (4, num_envs)."""
        return self._state.take(PRESSURES, axis=0)

    @property
    def temperatures(self) -> Array:
        """Temperatures of chambers P1, N1, P2, N2, K, (4, num_envs)."""
        return self._state.take(TEMPERATURES, axis=0)

    def end_effector(self) -> Array:
        """Position and velocity of the end effector, (4, num_envs): x, y (m), vx, vy (m/s).

        Where the structure bends it is that of the handle."""
        motion = np.empty((4, self.num_envs))
        options.port_motion(self.state, self.memory[4:], self.lane_parameters, motion)
        return motion

    def _inputs(self, opening_command: ArrayLike, user_force: ArrayLike, duration: float) -> tuple[Array, Array, float]:
        if not is_within(duration, above=0.0, most=LONGEST):
            raise ValueError(f"duration = {shown(duration)}; allowed: a positive number, at most {LONGEST:g} (s)")
        return self._openings(opening_command), self._force_samples(user_force), float(duration)

    def _openings(self, opening_command: ArrayLike) -> Array:
        command = checked("opening_command", opening_command, (4, self.num_envs), "parts of full opening")
        if np.abs(command).max() > 1:
            raise ValueError(f"opening_command reaches {np.abs(command).max():g}; allowed: -1 to 1")
        return command

    def _force_samples(self, user_force: ArrayLike) -> Array:
        """The user's force as (K, 2, num_envs), from that shape with K >= 1 or from (2, num_envs)."""
        samples = shape_of(user_force)[:-2]
        several = samples if len(samples) == 1 and samples[0] > 0 else ()
        return checked("user_force", user_force, (*several, 2, self.num_envs), "N").reshape(-1, 2, self.num_envs)
