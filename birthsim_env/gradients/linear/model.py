"""A linear model with names and units, as arrays and as python-control's ``StateSpace``."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from birthsim_env.extras import installation
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.plant import checked
from birthsim_env.physics.rig.arrays import shape_of


class Signal(NamedTuple):
    """A state, input or output."""

    name: str
    unit: str


@dataclass(frozen=True)
class OperatingPoint:
    """Where a ``LinearModel`` was taken.

    ``state`` (18,) with the rows of ``STATE_NAMES``, ``openings`` (4,), ``force`` (2,), N, ``outputs`` (12,) with the names of
    the model's outputs. ``rates`` (18,) is d(state)/dt there: zero at an equilibrium, else the drift that the linear model
    leaves out. ``friction`` is "stuck" or "sliding". SI units.
    """

    state: Array
    openings: Array
    force: Array
    outputs: Array
    rates: Array
    friction: str

    def __post_init__(self) -> None:
        for array in (self.state, self.openings, self.force, self.outputs, self.rates):
            array.setflags(write=False)


class Jacobians(NamedTuple):
    """dx/dt = ``rates`` + A dx + B du and y = ``outputs`` + C dx + D du near the states of N lanes, SI units.

    ``A`` (N, S, S), ``B`` (N, S, 6), ``C`` (N, 12, S), ``D`` (N, 12, 6), ``rates`` (S, N), ``outputs`` (12, N). The S states
    are those of ``Plant.state`` and, of rigs with options, the further ones; inputs and outputs are those of a ``LinearModel``.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    rates: Array
    outputs: Array


@dataclass(frozen=True)
class LinearModel:
    """dx/dt = A x + B u, y = C x + D u for deviations x, u, y from an operating point, SI units.

    Parameters
    ----------
    A, B, C, D : array
        (S, S), (S, 6), (12, S), (12, 6).
    states, inputs, outputs : tuple of Signal
        Name and unit of every row and column.
    at : OperatingPoint
        Where the model was taken.

    Examples
    --------
    How far a hand's slow push along x moves a rig whose valves stay shut, mm/N:

    >>> import birthsim
    >>> model = birthsim.linearize(None, (0.5, 0.0), friction="sliding")
    >>> [one.name for one in model.inputs], model.outputs[0]
    (['u1P', 'u1N', 'u2P', 'u2N', 'Fx', 'Fy'], Signal(name='x', unit='m'))
    >>> bool(0.1 < 1e3 * abs(model.frequency_response([0.5])[0, 0, 4]) < 1.0)
    True
    """

    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[Signal, ...]
    inputs: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    at: OperatingPoint

    def __post_init__(self) -> None:
        for array in (self.A, self.B, self.C, self.D):
            array.setflags(write=False)

    def frequency_response(self, frequency: ArrayLike) -> NDArray[np.complex128]:
        """C (jw - A)^-1 B + D at frequencies (F,), Hz above zero: complex, (F, outputs, inputs)."""
        given = checked("frequency", frequency, (*shape_of(frequency), 1)[:1], "Hz")
        if not np.all(given > 0):
            raise ValueError(f"frequency = {given[~(given > 0)][0]:g}; allowed: above 0 (Hz)")
        s = 2j * np.pi * given[:, None, None]
        return np.asarray(self.C @ np.linalg.solve(s * np.eye(len(self.A)) - self.A, self.B) + self.D)

    def to_control(self) -> Any:
        """As ``control.StateSpace`` with the names of the signals; needs the extra ``control`` (python-control)."""
        try:
            import control
        except ImportError as error:
            raise ImportError(f"to_control needs python-control: {installation('control')}") from error
        names = {kind: [signal.name for signal in getattr(self, kind)] for kind in ("states", "inputs", "outputs")}
        return control.ss(self.A, self.B, self.C, self.D, **names)
