"""What the rivals share: signals in, the motion to follow, the memory of the lanes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from baselines.controller import check_gains, lanes_of
from baselines.estimation.admittance import DAMPING_RATIO, Admittance
from baselines.estimation.observers import PistonObserver
from baselines.estimation.state_estimator import is_moving
from baselines.impedance import Impedance, mass_spring_damper
from baselines.rivals.feedforward import NEEDED, prepare
from birthsim_env.loop.signals import Mask, Measurement, Reference, one_lane
from birthsim_env.physics.compiled.compilation import helper
from birthsim_env.physics.compiled.lanes import Array, parameter_column
from birthsim_env.physics.rig.parameters import Parameters, load_parameters

LEAST_LENGTH = 0.002
"""m. Near an end stop a sensor may place the piston outside its stroke, where (9) has no meaning."""


@helper
def beyond(error: float, zone: float) -> float:
    """What of ``error`` exceeds +-``zone``: the dead zone that keeps integral action from hunting against stiction."""
    return error - max(-zone, min(zone, error))


@helper
def carried_on(integral: float, rate: float, period: float, opening_p: float, opening_n: float) -> float:
    """The integral after one period; held while a valve of the cylinder saturates (conditional integration)."""
    return integral if max(abs(opening_p), abs(opening_n)) >= 1.0 else integral + period * rate


class TrackingController(ABC):
    """A loop round each piston that follows the compliant motion of ``Admittance`` and knows the forces that it needs.

    Arguments:
        parameters: what the controller believes of the rig: a ``Parameters``, a TOML file's path, or None for the defaults.
        gains: those of ``TUNABLE``, SI units; what is not given is the value tuned for the sensors that the controller meets.

    ``TUNABLE`` is what ``birthsim-tune`` reads: gain -> (lowest, highest) to try; ``TUNED`` holds what it found, for exact and
    for sampled positions. All have ``friction_fraction``, how much believed Coulomb friction is fed forward with the sign
    of the reference speed, and ``dead_zone``, the error at the end effector, m, up to which nothing is integrated. The
    integrals start from the forces that the chambers hold (bumpless start). From sampled positions an observer estimates
    the speeds.
    ``KERNEL`` is the law: (joints (4, N), wanted (8, N), needed (NEEDED, N) as in ``prepare``, pressures (4, N), reference rows
    (15, N), parameters (PARAMETERS,), period, the arguments of ``_design``, integrals (2, N), fresh (N,), openings (4, N)). It
    writes the openings and carries the integrals on, which it starts where fresh is 1.
    Raises ``ValueError`` for unknown gains and for gains that are not positive (zero where the lowest to try is zero).
    """

    KERNEL: ClassVar[Callable[..., None]]
    TUNABLE: ClassVar[dict[str, tuple[float, float]]]
    TUNED: ClassVar[dict[str, dict[str, float]]]

    def __init__(self, parameters: Parameters | str | Path | None = None, **gains: float) -> None:
        check_gains(self, gains)
        self.parameters = load_parameters(parameters)
        self._p = parameter_column(self.parameters)
        self._period = self.parameters.electronics.control_period
        chosen = {kind: {name: float({**tuned, **gains}[name]) for name in self.TUNABLE} for kind, tuned in self.TUNED.items()}
        self._fractions = {kind: values["friction_fraction"] for kind, values in chosen.items()}
        self._designs = {kind: self._design(values) for kind, values in chosen.items()}
        self._admittance = Admittance(self.parameters)
        self._observer = PistonObserver(self.parameters, self._p)
        self._integral: Array = np.empty((2, 0))

    def declared_impedance(self, reference: Reference) -> Impedance:
        """The mass, damper and spring of the admittance, over N lanes."""
        return mass_spring_damper(reference, self.parameters.mechanics.mass, DAMPING_RATIO)

    @abstractmethod
    def _design(self, gains: dict[str, float]) -> tuple[Any, ...]:
        """The arguments of ``KERNEL`` that come from the gains, all those of ``TUNABLE``."""

    def reset(self, lanes: Mask | None = None) -> None:
        """Forget the past of all lanes, or of those where ``lanes`` (N,) is True."""
        self._admittance.reset(lanes)
        self._observer.reset(lanes)
        if lanes is None:
            self._integral = np.empty((2, 0))
        elif self._integral.shape[1]:
            self._fresh[lanes] = 1.0

    def command(self, measurement: Measurement, reference: Reference, damping_factor: Array | None = None) -> Array:
        """Spool openings in [-1, 1] of the valves of chambers P1, N1, P2, N2: (4, N), or (4,) for one rig without lanes.

        Called once per control period. ``damping_factor`` (N,) multiplies the damping that the hand feels; below 1 it is 1.
        Raises ``ValueError`` for signals over different numbers of lanes.
        """
        if measurement.position.ndim == 1:
            factor = None if damping_factor is None else np.asarray(damping_factor, dtype=np.float64)[..., None]
            return self.command(*one_lane(measurement, reference), factor)[:, 0]
        lanes = lanes_of(measurement, reference)
        if self._integral.shape[1] != lanes:
            self._integral, self._fresh = np.zeros((2, lanes)), np.ones(lanes)
        force = np.ascontiguousarray(measurement.user_force)
        motion = self._admittance.update(measurement, reference, damping_factor)
        if measurement.sampled:
            seen = np.ascontiguousarray(self._observer.update(measurement, force, moving=is_moving(motion)))
        else:
            seen = np.concatenate([measurement.position, measurement.velocity])
        joints, wanted, needed = np.empty((4, lanes)), np.empty((8, lanes)), np.empty((NEEDED, lanes))
        kind = "lab" if measurement.sampled else "ideal"
        prepare(seen, measurement.sampled, motion, force, self._p, self._fractions[kind], joints, wanted, needed)
        openings = np.empty((4, lanes))
        law = (*self._designs[kind], self._integral, self._fresh, openings)
        self.KERNEL(joints, wanted, needed, measurement.pressures, reference.rows, self._p, self._period, *law)
        self._fresh[:] = 0.0
        return openings
