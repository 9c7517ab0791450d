"""The law with a residual: a policy tells it about forces on the pistons that it does not know of, and how stiff to work.

An action in [-1, 1] passes a first-order low-pass at the control rate, z' = (a - z)/T. Its first two entries, times the
authority in N, are added to what the law believes acts on the pistons; the law knows their rate too. Where the impedance is
variable, the next two raise the stiffness to K' = K 4^z that the law works with, about a target moved so that a hand at rest
still feels K; the last raises the damping. Less than zero says nothing: a policy that had learned to soften an axis kept to
it, though its errors were larger. Forces and stiffness yield where pistons oscillate. Zero actions are exactly the law. Without
a law the actions are the openings.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from agents.residual.experience import Experience
from agents.residual.guard import Guard
from agents.residual.settings import NO_LAW, ResidualSettings
from baselines.registry import make_controller
from birthsim_env.observation import ENTRIES, LIMIT
from birthsim_env.parts.signals import Mask, Measurement, Reference
from birthsim_env.physics import exact
from birthsim_env.physics.compilation import kernel
from birthsim_env.physics.lanes import Array, parameter_column
from birthsim_env.physics.parameters import Parameters
from birthsim_env.physics.plant import Plant

STIFFEST = 4000.0
"""N/m: the law is made no stiffer than that, unless more is asked for. With 6000 rigs of 2.4 kg and less with valves of 7 ms
and more oscillated (4 of 245 circles had errors of 5 to 16 mm); with 4000 the same four stayed below 1 mm."""

STIFFENING = 4.0
"""Most that the stiffness is multiplied by."""

_STIFFENING_DOUBLINGS = exact.log2(STIFFENING)

SOFTEST = 500.0
"""N/m: swings make the law no softer than that, unless less is asked for; the default rig has gains from 110 on."""

MOST_DAMPING = 2.0
"""Most that the damping is multiplied by."""

_DAMPING_DOUBLINGS = exact.log2(MOST_DAMPING)

FORCE_UNIT = 100.0
"""N that map to 1 in an observation."""

NAMES = (
    *(f"believed force on cylinder {i}, unit of the authority" for i in (1, 2)),
    *(f"stiffness Kcl{axis}, power of {STIFFENING:g}" for axis in "xy"),
    f"damping, power of {MOST_DAMPING:g}",
)
"""What the entries of an action say."""

VALVE_NAMES = tuple(f"opening of the valve of chamber {chamber}, 1" for chamber in ("P1", "N1", "P2", "N2"))
"""What they say without a law."""

MET = tuple(
    f"unexplained force on piston {i}, {when}, {FORCE_UNIT:g} N"
    for when in ("now", "when last moving out", "when last moving in")
    for i in (1, 2)
)


def action_names(settings: ResidualSettings) -> tuple[str, ...]:
    """What each entry of an action says."""
    return VALVE_NAMES if settings.law == NO_LAW else NAMES[: settings.size]


def memory_names(settings: ResidualSettings) -> tuple[str, ...]:
    """What each row of ``ResidualLaw.memory`` says."""
    smooth = (f"smoothed action: {name}" for name in action_names(settings))
    return (*smooth, *(f"share of the authority on cylinder {i}, 1" for i in (1, 2)), *MET)


def observation_names(settings: ResidualSettings) -> tuple[str, ...]:
    """What each entry of an observation says, as in the environments' ``observation_names``."""
    last = (f"last action: {name}" for name in action_names(settings))
    return (*map(str, ENTRIES), *last, *memory_names(settings))


@kernel
def _stiffen(force: Array, powers: Array, rows: Array) -> None:
    for i in range(rows.shape[1]):
        for axis in range(2):
            if powers[axis, i] != 0.0:
                asked = rows[8 + axis, i]
                wanted = asked * exact.exp2(_STIFFENING_DOUBLINGS * powers[axis, i])
                rows[8 + axis, i] = max(min(wanted, max(asked, STIFFEST)), min(asked, SOFTEST))
                rows[axis, i] += force[axis, i] / asked - force[axis, i] / rows[8 + axis, i]


def stiffened(reference: Reference, force: Array, powers: Array) -> Reference:
    """``reference`` (rows over N lanes) with stiffness K' = K STIFFENING^``powers`` (2, N), its target moved by F/K - F/K'.

    K' exceeds ``STIFFEST`` only where K does, and falls below ``SOFTEST`` only where K does.

    ``force`` (2, N), N, is the hand's. The coupling Kclxy stays and moves nothing: the paper's law knows none.
    """
    rows = reference.rows.copy()
    _stiffen(force, powers, rows)
    return Reference(rows)


@kernel
def _tell(
    action: Array, share: Array, authority: float, time_constant: float, quickness: float, smooth: Array, told: Array
) -> None:
    """Writes forces, N, their rates, N/s, and, of actions that have them, powers of stiffness and the damping factor (7, N);
    ``smooth`` (size, N) goes on by one period towards ``action``."""
    size = action.shape[0]
    for i in range(action.shape[1]):
        for k in range(2):
            strength = authority * share[k, i]
            told[k, i] = strength * smooth[k, i]
            told[2 + k, i] = strength / time_constant * (action[k, i] - smooth[k, i])
            told[4 + k, i] = max(smooth[2 + k, i], 0.0) * min(share[0, i], share[1, i]) if size > 2 else 0.0
        told[6, i] = exact.exp2(_DAMPING_DOUBLINGS * max(smooth[4, i], 0.0)) if size > 4 else 0.0
        for k in range(size):
            smooth[k, i] += quickness * (action[k, i] - smooth[k, i])


class ResidualLaw:
    """A law with a residual over N lanes; room for them is made by the first ``reset``."""

    def __init__(self, parameters: Parameters, settings: ResidualSettings) -> None:
        self.settings = settings
        # Whichever law it is can be told of forces; those that have an impedance also of a damping factor.
        self._law: Any = None if settings.law == NO_LAW else make_controller(settings.law, parameters)
        self._experience = Experience(parameters)
        period = parameters.electronics.control_period
        self._guard = Guard(period, parameter_column(parameters))
        self._quickness = 1.0 - exact.exp(-period / settings.time_constant)
        self._action: Array = np.zeros((settings.size, 0))
        self._smooth: Array = np.zeros((settings.size, 0))

    def reset(self, lanes: Mask) -> None:
        """Forget the past of the lanes where ``lanes`` (N,) is True."""
        if self._smooth.shape[1] != len(lanes):
            self._action, self._smooth = np.zeros((2, self.settings.size, len(lanes)))
            if self._law is not None:
                self._law.reset()
        if self._law is not None:
            self._law.reset(lanes)
        self._experience.reset(lanes)
        self._guard.reset(lanes)
        self._action[:, lanes], self._smooth[:, lanes] = 0.0, 0.0

    def accept(self, actions: Array) -> None:
        """Take the actions (size, N) of a policy step."""
        self._action = np.array(actions)

    def command(self, measurement: Measurement, reference: Reference) -> Array:
        """Spool openings (4, N) of one control period."""
        self._experience.update(measurement)
        self._guard.update(self._experience.joints, reference)
        settings, told = self.settings, np.empty((7, self._smooth.shape[1]))
        _tell(self._action, self._guard.share, settings.authority, settings.time_constant, self._quickness, self._smooth, told)
        if self._law is None:
            return self._action
        if settings.impedance != "fixed":
            told[4:6] -= self._guard.softness
            reference = stiffened(reference, np.ascontiguousarray(measurement.user_force), told[4:6])
        damping = (told[6],) if settings.impedance == "variable" else ()
        return np.asarray(self._law.command(measurement, reference, told[:2], told[2:4], *damping))

    def memory(self) -> Array:
        """What a policy sees of it, (size + 8, N): smoothed action, shares of the authority, forces met in ``FORCE_UNIT``."""
        met = np.clip(self._experience.met / FORCE_UNIT, -LIMIT, LIMIT)
        return np.concatenate([self._smooth, self._guard.share, met])


class ResidualActuation:
    """``ResidualLaw`` as an actuation of the environments: the law runs inside, at the control rate."""

    every_period = True

    def __init__(self, parameters: Parameters, settings: ResidualSettings) -> None:
        self._law = ResidualLaw(parameters, settings)
        self.size = settings.size
        self.names = action_names(settings)
        self.memory_names = memory_names(settings)

    def begin(self, lanes: Mask) -> None:
        self._law.reset(lanes)

    def accept(self, actions: Array) -> None:
        self._law.accept(actions)

    def openings(self, plant: Plant, measurement: Measurement, reference: Reference) -> Array:
        return self._law.command(measurement, reference)

    def memory(self) -> Array:
        return self._law.memory()
