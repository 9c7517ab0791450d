"""The law with a residual: a policy corrects the forces on the pistons that it believes in, and how stiff to work.

An action in [-1, 1] passes a first-order low-pass at the control rate, z' = (a - z)/T. Its first two entries, times the
authority in N, are added to what the law believes acts on the pistons; the law knows their rate too. Where the impedance is
variable, the next two raise the stiffness to K' = K 4^z that the law works with, about a target moved so that a hand at rest
still feels K; the last raises the damping. Negative stiffness actions are ignored, because policies that
softened an axis never recovered. Forces and stiffness yield where pistons oscillate. Zero actions are exactly the law. Without
a law the actions are the openings.
"""

from typing import Any

import numpy as np

from agents.residual import authority, features, unexplained
from agents.residual.pistons import ObservedPistons, observed
from agents.residual.settings import NO_LAW, ResidualSettings
from baselines.controller import require_stiffness
from baselines.driving import CompiledDriving
from baselines.impedance import Impedance, declared_by
from baselines.named import make_controller
from baselines.staged import ControllerStage, StagedController
from birthsim_env.loop.rows import ACTION, SHOWN, Seen
from birthsim_env.loop.signals import REFERENCES, Mask, Measurement, Reference
from birthsim_env.loop.stage import scratch
from birthsim_env.observation import LIMIT, entries_of
from birthsim_env.physics.compiled import exact
from birthsim_env.physics.compiled.compilation import helper, kernel
from birthsim_env.physics.compiled.lanes import Array, Rig
from birthsim_env.physics.compiled.records import Numbers, Rows, number, part, row, rows
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

ON_RAIL = (NAMES[1], NAMES[2].replace("Kclx", "Kcl"), NAMES[4])
"""What they say on a rail: the stiffness is that along it, of x and of y alike."""

VALVE_NAMES = tuple(f"opening of the valve of chamber {chamber}, 1" for chamber in ("P1", "N1", "P2", "N2"))
"""What they say without a law."""

UNEXPLAINED = tuple(
    f"unexplained force on piston {i}, {when}, {FORCE_UNIT:g} N" for i, _, when, _ in unexplained.Forces.entries()
)
"""What is said of ``unexplained.Forces``."""


def action_names(settings: ResidualSettings, rig: Parameters = Parameters()) -> tuple[str, ...]:  # noqa: B008  frozen
    """What each entry of an action says, on a ``rig``: a rail has one for each pair."""
    if settings.law == NO_LAW:
        return tuple(VALVE_NAMES[k] for k in rig.linkage.topology.chambers)
    return NAMES[: settings.size] if not rig.linkage.is_rail else ON_RAIL[: (settings.size + 1) // 2]


def memory_names(settings: ResidualSettings, rig: Parameters = Parameters()) -> tuple[str, ...]:  # noqa: B008  frozen
    """What each row of ``CorrectedController.memory`` says."""
    cylinders = rig.linkage.topology.cylinders
    smooth = (f"smoothed action: {name}" for name in action_names(settings, rig))
    left = (f"fraction of the authority on cylinder {i + 1}, 1" for i in cylinders)
    told = features.entries_of(rig) if settings.informed else ()
    return (*smooth, *left, *UNEXPLAINED[cylinders[0] :: 3 - len(cylinders)], *told)


def observation_names(settings: ResidualSettings, rig: Parameters = Parameters()) -> tuple[str, ...]:  # noqa: B008  frozen
    """What each entry of an observation says, as in the environments' ``observation_names``."""
    last = (f"last action: {name}" for name in action_names(settings, rig))
    return (*map(str, entries_of(rig)), *last, *memory_names(settings, rig))


class Correction(Rows):
    """What the policy says at one instant."""

    force = rows("1 2", "N", "force along a cylinder")
    rate = rows("1 2", "N/s", "rate of that force")
    powers = rows("x y", "1", "power of ``STIFFENING`` of the stiffness")
    damping_factor = row("1", "factor of the damping; 0: the law's own")


class Action(Rows):
    """What the entries of an action say to a law; shorter ones lack the last."""

    force = rows("1 2", "1", "force along a cylinder, in units of the authority")
    powers = rows("x y", "1", "power of ``STIFFENING`` of the stiffness")
    damping = row("1", "power of ``MOST_DAMPING`` of the damping")


class Constants(Numbers):
    """Of the stage."""

    actions = number("1", "length of an action")
    authority = number("N", "force of an action of 1")
    time_constant = number("s", "of the low-pass that an action passes")
    quickness = number("1", "fraction of a change that passes it in a period")
    level = number("m/s", "speed error below which nothing is an oscillation")
    unit = number("N", "``FORCE_UNIT``")
    has_law = number("1", "1 with a law")
    stiffens = number("1", "1 where the impedance has a stiffness")
    damps = number("1", "1 where it has a damping")
    first = number("1", "the first cylinder that is corrected; 1 on a rail, which has one")
    told = number("1", "how many entries of ``features.entries_of`` are shown")
    period = number("s", "control period")
    rig = part(Rig, "the rig as described")


class Memory(Rows):
    """What the stage remembers."""

    smooth = part(Action, "smoothed action; without a law the openings of its first four rows")
    limiter = part(authority.Limiter, "authority")
    moved = part(unexplained.Moved, "which ways pistons have moved")
    unexplained = part(unexplained.Forces, "unexplained forces")


@helper
def stiffen(force: Array, powers: Array, asked: Reference, n: int) -> None:
    """Changes what is ``asked`` of n lanes to K' = K STIFFENING^``powers`` (2, N), the target moved by F/K - F/K'.

    K' exceeds ``STIFFEST`` only where K does, and falls below ``SOFTEST`` only where K does. ``force`` (2, n), N, is the
    hand's. The coupling Kclxy stays and moves nothing: the paper's law knows none.
    """
    stiffness, position = asked.stiffness, asked.position
    for i in range(n):
        for axis in range(2):
            if powers[axis, i] != 0.0:
                before = stiffness[axis, i]
                wanted = before * exact.exp2(_STIFFENING_DOUBLINGS * powers[axis, i])
                stiffness[axis, i] = max(min(wanted, max(before, STIFFEST)), min(before, SOFTEST))
                position[axis, i] += force[axis, i] / before - force[axis, i] / stiffness[axis, i]


@helper
def _correct(action: Array, limiter: authority.Limiter, constants: Constants, smooth: Action, said: Correction, n: int) -> None:
    """Writes what actions (size, n) say; ``smooth`` goes on by one period towards them.

    On a rail one entry stands for each pair of an ``Action``: its power is that of the stiffness along x and along y.
    """
    size, most, left, first = action.shape[0], constants.authority, limiter.left, int(constants.first)
    each = 2 - first
    for i in range(n):
        said.force[0, i], said.rate[0, i], said.powers[0, i], said.powers[1, i] = 0.0, 0.0, 0.0, 0.0
        for k in range(first, 2):
            strength, smoothed = most * left[k, i], smooth.rows[k - first, i]
            said.force[k, i] = strength * smoothed
            said.rate[k, i] = strength / constants.time_constant * (action[k - first, i] - smoothed)
        for k in range(2 if size > each else 0):
            said.powers[k, i] = max(smooth.rows[each + k * (1 - first), i], 0.0) * min(left[0, i], left[1, i])
        said.damping_factor[i] = exact.exp2(_DAMPING_DOUBLINGS * max(smooth.rows[2 * each, i], 0.0)) if size > 2 * each else 0.0
        for k in range(size):
            smooth.rows[k, i] += constants.quickness * (action[k, i] - smooth.rows[k, i])


@kernel
def _stage(world: int, seen: Seen, memory: Memory, constants: Constants, tables: int, lane: int, n: int) -> int:
    first = int(constants.first)
    size, found, said = (
        int(constants.actions),
        ObservedPistons(seen.intermediate[: ObservedPistons.size]),
        Correction(scratch(Correction.size)),
    )
    unexplained.remember(found.joints, found.disturbance, constants.rig, constants.period, memory.moved, memory.unexplained, n)
    limiter, action, shown = memory.limiter, seen.action[:size], seen.shown
    asked, target = seen.asked, seen.reference
    authority.limit_authority(found.joints, target, constants.rig, constants.period, constants.level, limiter, n)
    _correct(action, limiter, constants, memory.smooth, said, n)
    for i in range(n):
        for k in range(Reference.size):
            asked.rows[k, i] = target.rows[k, i]
        for k in range(size):
            shown[k, i] = memory.smooth.rows[k, i]
        for k in range(2):
            seen.feedforward.force[k, i], seen.feedforward.rate[k, i] = said.force[k, i], said.rate[k, i]
            said.powers[k, i] = said.powers[k, i] - limiter.softness[i]
        for k in range(first, 2):
            shown[size + k - first, i] = limiter.left[k, i]
        seen.damping_factor[i] = said.damping_factor[i] if constants.damps > 0.0 else 0.0
        for k in range(unexplained.Forces.size // (1 + first)):
            force = memory.unexplained.rows[(1 + first) * k + first, i]
            shown[size + 2 - first + k, i] = max(-LIMIT, min(LIMIT, force / constants.unit))
        after = size + (2 + unexplained.Forces.size) // (1 + first)
        for k in range(int(constants.told)):
            value = features.told_of(seen, k, first, constants.rig, i)
            shown[after + k, i] = max(-LIMIT, min(LIMIT, value))
        for valve in range(2 * first, 4 if constants.has_law == 0.0 else 0):
            seen.opening[valve, i] = action[valve - 2 * first, i]
    if constants.stiffens > 0.0:
        stiffen(seen.user_force, said.powers, asked, n)
    return 0


class CorrectedController(StagedController):
    """A law with a residual over N lanes: ``accept`` takes the actions (size, N) of a policy step."""

    asks = True

    def __init__(self, parameters: Parameters, settings: ResidualSettings) -> None:
        super().__init__(parameters)
        self.settings, self.reads_force = settings, settings.force_sensor
        # Every law takes forces to believe in; those that have an impedance also a damping factor.
        self._law: Any = None if settings.law == NO_LAW else make_controller(settings.law, self.parameters)
        self.size = len(action_names(settings, self.parameters))
        self.action: Array = np.zeros((self.size, 0))
        self.shown: Array = np.zeros((len(memory_names(settings, self.parameters)), 0))

    def controller_stages(self, sampled: bool) -> list[ControllerStage]:
        settings, board = self.settings, self.parameters.electronics
        constants = Constants.numbers(
            actions=self.size,
            first=self.parameters.linkage.topology.cylinders[0],
            authority=settings.authority,
            time_constant=settings.time_constant,
            level=authority.LEVEL,
            unit=FORCE_UNIT,
            has_law=self._law is not None,
            period=board.control_period,
            rig=self._p,
            quickness=1.0 - exact.number("exp", -board.control_period / settings.time_constant),
            stiffens=settings.impedance != "fixed",
            damps=settings.impedance == "variable",
            told=len(features.entries_of(self.parameters)) if settings.informed else 0,
        )
        own = ControllerStage(_stage, constants, Memory.lane(limiter=authority.Limiter.lane(left=1.0)))
        known = [observed(self.parameters, sampled)]
        if settings.informed:
            known = features.informed(self.parameters, sampled, settings.force_sensor)
        self._place = len(known)
        return [*known, own, *(self._law.controller_stages(sampled) if self._law is not None else ())]

    def declared_impedance(self, reference: Reference) -> Impedance | None:
        """What the law underneath means to render, over N lanes; None without a law."""
        return declared_by(self._law, reference)

    def explain(self, measurement: Measurement, reference: Reference) -> None:
        if self._law is None:
            require_stiffness(reference, 0.0)
        else:
            self._law.explain(measurement, reference)

    def reset(self, lanes: Mask | None = None) -> None:
        super().reset(lanes)
        self._begin(np.zeros(0, dtype=np.bool_) if lanes is None else lanes)

    def _begin(self, lanes: Mask) -> None:
        if self.action.shape[1] != len(lanes):
            self.action, self.shown = (np.zeros((len(rows), len(lanes))) for rows in (self.action, self.shown))
        self.action[:, lanes], self.shown[:, lanes] = 0.0, 0.0
        self.shown[self.size : self.size + len(self.parameters.linkage.topology.cylinders), lanes] = 1.0

    def prepare(self, lanes: int, sampled: bool) -> None:
        if self.action.shape[1] != lanes:
            self._begin(np.ones(lanes, dtype=np.bool_))
        super().prepare(lanes, sampled)

    def accept(self, actions: Array) -> None:
        """Take the actions (size, N) of a policy step."""
        self.action[:] = actions

    @property
    def limiter(self) -> authority.Limiter:
        """What limits the authority."""
        return Memory(self._memories[self._place]).limiter

    @property
    def asked(self) -> Reference:
        """What the law inside was asked for in the last ``command``."""
        return Reference(self._asked[:REFERENCES].copy())

    @property
    def feedforward(self) -> Array:
        """What it was to believe besides: forces along the cylinders, N, their rates, N/s, and a damping factor; (5, N)."""
        return self._asked[REFERENCES:].copy()

    def more_rows(self, lanes: int) -> list[tuple[Array, int]]:
        return [(self.action, ACTION), (self.shown, SHOWN)]

    def memory(self) -> Array:
        """What a policy sees of it, (size + 8, N): smoothed action, authority left, unexplained forces in ``FORCE_UNIT``."""
        return self.shown.copy()


class ResidualActuation(CompiledDriving):
    """``CorrectedController`` as an actuation of the environments: the law runs inside, at the control rate."""

    controller: CorrectedController

    def __init__(self, parameters: Parameters, settings: ResidualSettings) -> None:
        super().__init__(CorrectedController(parameters, settings), None, {})
        self.names, self.memory_names = action_names(settings, parameters), memory_names(settings, parameters)
        self.size = len(self.names)

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
