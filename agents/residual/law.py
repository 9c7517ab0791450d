"""The law with a residual: a policy tells it about forces on the pistons that it does not know of, and how stiff to work.

An action in [-1, 1] passes a first-order low-pass at the control rate, z' = (a - z)/T. Its first two entries, times the
authority in N, are added to what the law believes acts on the pistons; the law knows their rate too. Where the impedance is
variable, the next two raise the stiffness to K' = K 4^z that the law works with, about a target moved so that a hand at rest
still feels K; the last raises the damping. Negative stiffness actions are ignored, because policies that
softened an axis never recovered. Forces and stiffness yield where pistons oscillate. Zero actions are exactly the law. Without
a law the actions are the openings.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from agents.residual import authority, unexplained
from agents.residual.settings import IMPEDANCES, NO_LAW, VALVES, ResidualSettings
from baselines.estimation import disturbance_observer, observers
from baselines.estimation.rows import Belief, Given, Joints, Pistons, Point
from baselines.impedance import Impedance, declared_by
from baselines.registry import make_controller
from baselines.staged import CompiledDriving, LawStage, StagedController
from birthsim_env.loop.rows import (
    ACTION,
    ASKED,
    FEEDFORWARD,
    OPENING,
    POSITION,
    POSITION_TIME,
    REFERENCE,
    SEEN,
    SHOWN,
    Seen,
)
from birthsim_env.loop.signals import REFERENCES, Mask, Measurement, Reference
from birthsim_env.loop.stage import block, numbers, scratch
from birthsim_env.observation import ENTRIES, LIMIT
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.parameters import Parameters

STIFFEST = 4000.0
"""N/m: the law is made no stiffer than that, unless more is asked for. With 6000 rigs of 2.4 kg and less with valves of 7 ms
and more oscillated (4 of 245 circles had errors of 5 to 16 mm); with 4000 the same four stayed below 1 mm."""

STIFFENING = 4.0
"""Most that the stiffness is multiplied by."""

_STIFFENING_DOUBLINGS = exact.number("log2", STIFFENING)

SOFTEST = 500.0
"""N/m: swings make the law no softer than that, unless less is asked for; the default rig has gains from 110 on."""

MOST_DAMPING = 2.0
"""Most that the damping is multiplied by."""

_DAMPING_DOUBLINGS = exact.number("log2", MOST_DAMPING)

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
    return (*smooth, *(f"fraction of the authority on cylinder {i}, 1" for i in (1, 2)), *MET)


def observation_names(settings: ResidualSettings) -> tuple[str, ...]:
    """What each entry of an observation says, as in the environments' ``observation_names``."""
    last = (f"last action: {name}" for name in action_names(settings))
    return (*map(str, ENTRIES), *last, *memory_names(settings))


@helper
def stiffen(force: Array, powers: Array, rows: Array) -> None:
    """Changes a reference ``rows`` (15, N) to stiffness K' = K STIFFENING^``powers`` (2, N), its target moved by F/K - F/K'.

    K' exceeds ``STIFFEST`` only where K does, and falls below ``SOFTEST`` only where K does. ``force`` (2, N), N, is the
    hand's. The coupling Kclxy stays and moves nothing: the paper's law knows none.
    """
    for i in range(rows.shape[1]):
        for axis in range(2):
            if powers[axis, i] != 0.0:
                asked = rows[8 + axis, i]
                wanted = asked * exact.exp2(_STIFFENING_DOUBLINGS * powers[axis, i])
                rows[8 + axis, i] = max(min(wanted, max(asked, STIFFEST)), min(asked, SOFTEST))
                rows[axis, i] += force[axis, i] / asked - force[axis, i] / rows[8 + axis, i]


@helper
def _tell(action: Array, left: Array, most: float, time_constant: float, quickness: float, smooth: Array, told: Array) -> None:
    """Writes forces, N, their rates, N/s, and, of actions that have them, powers of stiffness and the damping factor (7, N);
    ``smooth`` (size, N) goes on by one period towards ``action``."""
    size = action.shape[0]
    for i in range(action.shape[1]):
        for k in range(2):
            strength = most * left[k, i]
            told[k, i] = strength * smooth[k, i]
            told[2 + k, i] = strength / time_constant * (action[k, i] - smooth[k, i])
            told[4 + k, i] = max(smooth[2 + k, i], 0.0) * min(left[0, i], left[1, i]) if size > 2 else 0.0
        told[6, i] = exact.exp2(_DAMPING_DOUBLINGS * max(smooth[4, i], 0.0)) if size > 4 else 0.0
        for k in range(size):
            smooth[k, i] += quickness * (action[k, i] - smooth[k, i])


CONSTANTS = (
    *("sampled", "rows", "size", "authority", "time_constant", "quickness", "level", "unit"),
    *("has_law", "stiffens", "damps"),
)
"""Constants of the stage: 1 with sampled positions; rows of the observer; length of an action; authority, N; time constant, s,
and quickness of the low-pass; speed error, m/s, below which nothing is an oscillation; ``FORCE_UNIT``; 1 with a law, 1 where
the impedance has a stiffness and 1 where it has a damping. The observer's ``Belief`` follows."""
SAMPLED, OBSERVER, SIZE, AUTHORITY, CONSTANT, QUICKNESS, LEVEL_ROW, UNIT, HAS_LAW, STIFFENS, DAMPS = range(11)
SMOOTH, LIMITER = 0, max(VALVES, *IMPEDANCES.values())
MET_ROWS = LIMITER + authority.ROWS
WAYS = MET_ROWS + unexplained.ROWS
PISTONS = WAYS + 4
"""Rows of memory at which its parts begin: smoothed action; authority; forces met; which ways pistons have moved; observer."""


@kernel
def _stage(world: int, seen: int, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    s, about = block(seen, SEEN), numbers(constants, len(CONSTANTS) + Belief.size)
    belief, size, sampled = Belief(about[len(CONSTANTS) :]), int(about[SIZE]), about[SAMPLED] > 0.0
    p, period = belief.rig, belief.period
    m = block(memory, PISTONS + int(about[OBSERVER]))[:, :n]
    own = scratch(17)[:, :n]
    joints, told, given, pistons, signals = own[:4], own[4:11], Given(own[11:17]), Pistons(m[PISTONS:]), Seen(s[:, :n])
    for i in range(n):
        for k in range(2):
            given.force[k, i], given.believed[k, i] = signals.user_force[k, i], 0.0
        given.moving[i], given.noise[i] = 1.0, belief.noise
    if sampled:
        observers.observe(pistons, signals, signals.pressure, given, belief)
        for i in range(n):
            for k in range(2):
                joints[k, i], joints[2 + k, i] = pistons.position[k, i], pistons.speed[k, i]
    else:
        point = Point(s[POSITION:POSITION_TIME, :n])
        disturbance_observer.observe(pistons, point, signals.pressure, given, belief, Joints(joints))
    disturbance, force = pistons.disturbance, signals.user_force
    met, limiter, target = m[MET_ROWS:WAYS], m[LIMITER:MET_ROWS], s[REFERENCE:ASKED, :n]
    unexplained.remember(joints, disturbance, p, period, m[WAYS:PISTONS], met)
    authority.limit_authority(joints, target, p, period, about[LEVEL_ROW], limiter)
    action, smooth = s[ACTION : ACTION + size, :n], m[SMOOTH : SMOOTH + size]
    left = limiter[: authority.SOFTNESS : authority.CYLINDER]
    _tell(action, left, about[AUTHORITY], about[CONSTANT], about[QUICKNESS], smooth, told)
    asked = s[ASKED:FEEDFORWARD, :n]
    for i in range(n):
        for row in range(REFERENCES):
            asked[row, i] = target[row, i]
        for row in range(4):
            s[FEEDFORWARD + row, i] = told[row, i]
        s[FEEDFORWARD + 4, i] = told[6, i] if about[DAMPS] > 0.0 else 0.0
        told[4, i], told[5, i] = told[4, i] - limiter[authority.SOFTNESS, i], told[5, i] - limiter[authority.SOFTNESS, i]
        for k in range(size):
            s[SHOWN + k, i] = smooth[k, i]
        s[SHOWN + size, i], s[SHOWN + size + 1, i] = left[0, i], left[1, i]
        for k in range(unexplained.ROWS):
            s[SHOWN + size + 2 + k, i] = max(-LIMIT, min(LIMIT, met[k, i] / about[UNIT]))
        for valve in range(4 if about[HAS_LAW] == 0.0 else 0):
            s[OPENING + valve, i] = action[valve, i]
    if about[STIFFENS] > 0.0:
        stiffen(force, told[4:6], asked)
    return 0


class ResidualLaw(StagedController):
    """A law with a residual over N lanes: ``accept`` takes the actions (size, N) of a policy step."""

    asks = True

    def __init__(self, parameters: Parameters, settings: ResidualSettings) -> None:
        super().__init__(parameters)
        self.settings = settings
        # Whichever law it is can be told of forces; those that have an impedance also of a damping factor.
        self._law: Any = None if settings.law == NO_LAW else make_controller(settings.law, self.parameters)
        self.action: Array = np.zeros((settings.size, 0))
        self.shown: Array = np.zeros((settings.size + len(MET) + 2, 0))

    def law_stages(self, sampled: bool) -> list[LawStage]:
        settings, board = self.settings, self.parameters.electronics
        pistons = observers.fresh_memory(self.parameters, sampled)
        belief = observers.belief(self.parameters, observers.BANDWIDTH if sampled else unexplained.BANDWIDTH)
        constants = {
            **{"sampled": sampled, "rows": len(pistons), "size": settings.size},
            **{"authority": settings.authority, "time_constant": settings.time_constant},
            **{"quickness": 1.0 - exact.number("exp", -board.control_period / settings.time_constant)},
            **{"level": authority.LEVEL, "unit": FORCE_UNIT, "has_law": self._law is not None},
            **{"stiffens": settings.impedance != "fixed", "damps": settings.impedance == "variable"},
        }
        fresh = np.concatenate([np.zeros(PISTONS), pistons])
        fresh[LIMITER:MET_ROWS] = authority.FRESH
        own = LawStage(_stage, np.array([*(constants[name] for name in CONSTANTS), *belief]), fresh)
        return [own, *(self._law.law_stages(sampled) if self._law is not None else ())]

    def declared_impedance(self, reference: Reference) -> Impedance | None:
        """What the law underneath means to render, over N lanes; None without a law."""
        return declared_by(self._law, reference)

    def explain(self, measurement: Measurement, reference: Reference) -> None:
        self._law.explain(measurement, reference)

    def reset(self, lanes: Mask | None = None) -> None:
        """Forget the past of all lanes, or of those where ``lanes`` (N,) is True."""
        super().reset(lanes)
        self._begin(np.zeros(0, dtype=np.bool_) if lanes is None else lanes)

    def _begin(self, lanes: Mask) -> None:
        if self.action.shape[1] != len(lanes):
            self.action, self.shown = (np.zeros((len(rows), len(lanes))) for rows in (self.action, self.shown))
        self.action[:, lanes], self.shown[:, lanes] = 0.0, 0.0
        self.shown[self.settings.size : self.settings.size + 2, lanes] = 1.0

    def prepare(self, lanes: int, sampled: bool) -> None:
        """Make room for ``lanes`` lanes and one kind of sensors, where that is new."""
        if self.action.shape[1] != lanes:
            self._begin(np.ones(lanes, dtype=np.bool_))
        super().prepare(lanes, sampled)

    def accept(self, actions: Array) -> None:
        """Take the actions (size, N) of a policy step."""
        self.action[:] = actions

    @property
    def limiter(self) -> Array:
        """Memory of what limits the authority, (``authority.ROWS``, N)."""
        return self._memories[0][LIMITER:MET_ROWS]

    @property
    def asked(self) -> Reference:
        """What the law inside was asked for in the last ``command``."""
        return Reference(self._asked[:REFERENCES].copy())

    @property
    def told(self) -> Array:
        """What it was told besides: forces along the cylinders, N, their rates, N/s, and a damping factor; (5, N)."""
        return self._asked[REFERENCES:].copy()

    def more_rows(self, lanes: int) -> list[tuple[Array, int]]:
        return [(self.action, ACTION), (self.shown, SHOWN)]

    def memory(self) -> Array:
        """What a policy sees of it, (size + 8, N): smoothed action, authority that is left, forces met in ``FORCE_UNIT``."""
        return self.shown.copy()


class ResidualActuation(CompiledDriving):
    """``ResidualLaw`` as an actuation of the environments: the law runs inside, at the control rate."""

    controller: ResidualLaw

    def __init__(self, parameters: Parameters, settings: ResidualSettings) -> None:
        super().__init__(ResidualLaw(parameters, settings), None, {})
        self.size, self.names, self.memory_names = settings.size, action_names(settings), memory_names(settings)

    @property
    def shown(self) -> Array:
        """What a policy sees of the law's memory, (size + 8, N)."""
        return self.controller.shown

    def begin(self, lanes: Mask) -> None:
        self.controller.reset(lanes)

    def accept(self, actions: Array) -> None:
        self.controller.accept(actions)

    def more_rows(self, lanes: int) -> list[tuple[Array, int]]:
        return []

    def memory(self) -> Array:
        return self.controller.memory()
