"""``PortLimiter``: any law, with an energy tank that bounds what it may give to the hand, and with a limit of its speed.

*Energy.* The tank holds what the hand has given and has not been given back, at most ``MARGIN`` times the energy e'Ke/2 of the
spring that is asked for and ``capacity`` besides. Its level over ``capacity``, at most 1, bounds the law's authority: the
openings are that fraction of the law's, and for the rest those of a passive air spring about the target (``AirSpring``). The
work is counted with late positions and with late forces (``PortEnergy``), and the emptier tank holds: so an oscillation that
goes on empties one of them. Authority comes back within ``BACK``. Where it has been low for longer than ``LASTING`` it stays
lower, for ``RECOVERY``: a law that is too stiff for a hand settles at an authority with which it gives nothing.

A target that moves does work on the hand that nobody should bound. So the work is that about the moving target; and a rig that
only stays behind its target gives nothing. A tracker's field is distorted along the way: of the hand's force times the target's
path ``ALLOWANCE`` is forgiven.

*Speed.* Beyond ``speed``, relative to the target, the valves brake: each piston's chambers are driven against its motion, fully
from ``FULL`` times that speed on. A rig whose force was balanced by a hand that lets go is faster all the same: what its
chambers hold accelerates it until the valves have let it out, with any law. What the brake shortens is how far it flies.

The tank needs a force sensor. Energy tanks: Ferraguti, Secchi and Fantuzzi, ICRA 2013; the observer: Hannaford and Ryu,
IEEE Transactions on Robotics and Automation 18(1), 2002. Figures without a source are assumed.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from baselines.controller import Controller, checked_command, lanes_of
from baselines.impedance import Impedance, declared_by
from baselines.limiter.air_spring import AirSpring
from baselines.limiter.past import Past
from baselines.limiter.port_energy import PortEnergy
from birthsim_env.loop.signals import Mask, Measurement, Reference, one_lane
from birthsim_env.physics.compiled.lanes import Array, Rig, parameter_column
from birthsim_env.physics.inverse_kinematics import pistons_at
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import checked_number

MARGIN = 1.5
"""A law that renders half as much again as was asked for is not to be taken for one that makes energy."""

ALLOWANCE = 0.1
"""m of error that a tracker may gather per m of the target's path."""

BACK, LASTING, RECOVERY = 0.05, 0.2, 2.0
"""s, time constants: authority comes back; a low authority lowers what it comes back to; that comes back."""

FULL = 2.0
"""The brake is on in full at so many times the speed limit."""


class PortLimiter:
    """A law of N lanes with an energy tank and a speed limit at the port.

    Arguments: the ``law``; the rig ``parameters`` as it believes them; ``capacity``, J, what it may give to a hand beyond what
    a spring would; ``speed``, m/s, of the end effector relative to its target. Infinity switches a limit off. Raises
    ``ValueError`` for numbers that are not positive. ``authority`` (N,) is the fraction of its openings that a law has now.
    """

    def __init__(self, law: Controller, parameters: Parameters, capacity: float = 0.015, speed: float = 0.5) -> None:
        for name, value, unit in (("capacity", capacity, "J"), ("speed", speed, "m/s")):
            if value != math.inf:
                checked_number(name, value, unit, above=0.0)
        self.law, self.parameters = law, parameters
        self._capacity, self._speed = capacity, speed
        self._p = parameter_column(parameters)
        self._period = parameters.electronics.control_period
        self._rates = tuple(-math.expm1(-self._period / lag) for lag in (LASTING, RECOVERY, BACK))
        self.authority: Array = np.ones(0)

    @property
    def COMMAND_OPTIONS(self) -> tuple[str, ...]:
        """What the law's ``command`` takes besides the signals, and this one hands on."""
        return getattr(self.law, "COMMAND_OPTIONS", ())

    def declared_impedance(self, reference: Reference) -> Impedance | None:
        """That of the law, which holds where neither limit acts."""
        return declared_by(self.law, reference)

    def reset(self, lanes: Mask | None = None) -> None:
        """Forget the past of all lanes, or of those where ``lanes`` (N,) is True."""
        self.law.reset(lanes)
        if lanes is None:
            self.authority = np.ones(0)
        elif self.authority.size:
            for part in (self._past, self._energy, self._air):
                part.reset(lanes)
            self.authority[lanes], self._ceiling[lanes], self._level[:, lanes] = 1.0, 1.0, self._capacity

    def command(self, measurement: Measurement, reference: Reference, **options: Any) -> Array:
        """Spool openings in [-1, 1] of the valves of chambers P1, N1, P2, N2: (4, N), or (4,) for one rig without lanes.

        ``options`` are those of the law, see ``COMMAND_OPTIONS``. Raises what the law raises; ``ValueError`` for openings
        that are none.
        """
        if measurement.position.ndim == 1:
            told: dict[str, Any] = {name: np.asarray(given)[..., None] for name, given in options.items()}
            return self.command(*one_lane(measurement, reference), **told)[:, 0]
        lanes = lanes_of(measurement, reference)
        if self.authority.size != lanes:
            self._past, self._energy, self._air = (
                Past(self._period, 6, lanes),
                PortEnergy(lanes),
                AirSpring(self.parameters, lanes),
            )
            self.authority, self._level, self._ceiling = np.ones(lanes), np.full((2, lanes), self._capacity), np.ones(lanes)
            self._stiffness = np.stack([*reference.stiffness, reference.stiffness_coupling])
        openings = checked_command(type(self.law).__name__, self.law.command(measurement, reference, **options), lanes)
        if not math.isinf(self._capacity):
            openings = self._bounded(openings, measurement, reference)
        return self._slowed(openings, measurement, reference)

    def _bounded(self, openings: Array, measurement: Measurement, reference: Reference) -> Array:
        late, signals = measurement.time - measurement.position_time, [measurement.pressures, measurement.user_force]
        pressures, force = np.split(self._past.at(late, np.concatenate(signals)), [4])
        self._count(measurement, reference, force)
        passive = self._air.openings(measurement.position, pressures, force, measurement, reference)
        return np.asarray(self.authority * openings + (1.0 - self.authority) * passive)

    def _count(self, measurement: Measurement, reference: Reference, force: Array) -> None:
        """Carries the tanks and the authority on by one period; ``force`` (2, N), N, is that when the position was taken."""
        work, asked, path, offset = self._energy.update(measurement, reference, force)
        # A rig that only stays behind its target gives nothing.
        work = np.maximum(work, np.minimum(work + asked, 0.0)) + ALLOWANCE * path
        stiffness = np.stack([*reference.stiffness, reference.stiffness_coupling])
        stored = _spring_energy(stiffness, offset)
        # Whoever asks for a stiffer spring while it is stretched pays for it.
        credit = np.maximum(stored - _spring_energy(self._stiffness, offset), 0.0)
        self._stiffness = stiffness
        self._level = np.minimum(self._level + work + credit, MARGIN * stored + self._capacity)
        least = np.clip(self._level.min(axis=0) / self._capacity, 0.0, 1.0)
        lasting, returning, back = self._rates
        self._ceiling += lasting * (self.authority - self._ceiling) + returning * (1.0 - self._ceiling)
        self.authority = np.minimum(least, self.authority + back * np.maximum(self._ceiling - self.authority, 0.0))
        self._level = np.maximum(self._level, 0.0)

    def _slowed(self, openings: Array, measurement: Measurement, reference: Reference) -> Array:
        relative = measurement.velocity - reference.velocity
        speed = np.sqrt((relative**2).sum(axis=0))
        brake = np.clip((speed / self._speed - 1.0) / (FULL - 1.0), 0.0, 1.0)
        if not brake.any():
            return openings
        joints = np.empty_like(openings)
        pistons_at(np.concatenate([measurement.position, relative]), Rig(self._p), joints)
        against = np.repeat(np.sign(joints[2:]), 2, axis=0) * np.array([-1.0, 1.0, -1.0, 1.0])[:, None]
        return np.asarray((1.0 - brake) * openings + brake * against)


def _spring_energy(stiffness: Array, offset: Array) -> Array:
    """J, (N,), of springs Kx, Ky, Kxy (3, N), N/m, at ``offset`` (2, N), m."""
    (kx, ky, kxy), (x, y) = stiffness, offset
    return np.asarray(0.5 * (kx * x * x + ky * y * y) + kxy * x * y)
