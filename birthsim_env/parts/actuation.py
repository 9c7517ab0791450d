"""From a policy's action to spool openings: directly, or as mass flows through the inverse valve characteristic.

An actuation is asked once per policy step where ``every_period`` is False, else at every control period. Layout
``two_valves`` has one valve per chamber, ``one_valve`` one 5/3 valve per cylinder (its chambers get opposite openings).
"""

import math
from collections.abc import Callable, Sequence
from typing import ClassVar

import numpy as np

from birthsim_env.loop.loop import Loop, Place
from birthsim_env.loop.rows import ACTION, OPENING, STATE, Seen, World
from birthsim_env.loop.signals import Mask, Measurement, Reference
from birthsim_env.loop.stage import Part, Stage
from birthsim_env.physics.compiled import lanes as at
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Numbers, number
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.pneumatics import tubes, valves
from birthsim_env.physics.pneumatics.air import driving_flows, valve_of
from birthsim_env.physics.rig.topology import TOPOLOGIES, TWO_CYLINDERS, Topology

VALVE_LAYOUTS = ("two_valves", "one_valve")
CHAMBERS = ("P1", "N1", "P2", "N2")


class Actuation:
    """What stands between a policy and the valves. One of a user's own derives from it, and has ``openings`` at least.

    The loop stops for ``openings``, once a policy step or once a control period, unless ``stages`` say it compiled.

    Attributes
    ----------
    size : int
        Length of an action; 0 where nothing is asked of a policy.
    names : tuple of str
        What the entries of an action are, with their units.
    memory_names : tuple of str
        The same of the rows of ``memory()``.
    every_period : bool
        Whether ``openings`` is asked in every control period, or once a policy step.
    shown : array (M, N) or None
        Where ``stages`` write what a policy should see of them; None where ``memory()`` is asked.
    """

    size: int = 0
    names: tuple[str, ...] = ()
    memory_names: tuple[str, ...] = ()
    every_period: bool = True

    @property
    def shown(self) -> Array | None:
        """Where ``stages`` write what a policy should see of them, (M, N)."""
        return None

    def begin(self, lanes: Mask) -> None:
        """Start new episodes in the lanes of a mask (N,)."""

    def accept(self, actions: Array) -> None:
        """Take the actions (size, N), in [-1, 1], of a policy step."""

    def openings(self, plant: Plant, measurement: Measurement, reference: Reference) -> Array:
        """Spool openings of the valves of chambers P1, N1, P2, N2 from this instant on, -1 to 1, (4, N)."""
        raise NotImplementedError(f"{type(self).__name__}.openings(...) is missing; it returns openings (4, N)")

    def memory(self) -> Array:
        """What a policy should see of the actuation's state, roughly in [-1, 1], (M, N)."""
        return np.empty((0, 0))

    def stages(self, lanes: int, sampled: bool, foreign: bool) -> Sequence[Part] | None:
        """``openings``, compiled into the loop of ``lanes`` lanes; None where it is Python.

        ``sampled`` says whether positions are samples, as in ``Measurement``. ``foreign`` is True where signals come from a
        user's own Python, and may be anything.
        """
        return None

    def more_rows(self, lanes: int) -> list[Place]:
        """Arrays that ``stages`` read or write besides, with the rows of ``Seen`` at which they stand."""
        return []

    def check(self, measurement: Measurement) -> None:
        """Raise ``ValueError`` where episodes begin with less than it has to measure."""

    def explain(self, measurement: Measurement, reference: Reference) -> None:
        """Raise the ``ValueError`` for signals, over N lanes, that a stage could not serve."""
        raise ValueError(f"{type(self).__name__} could not serve one of the lanes")


class Layout(Numbers):
    """Constants of a stage."""

    one_valve = number("1", "1 with one valve per cylinder")
    first = number("1", "the first chamber whose valve is driven")


@kernel
def _valve_stage(world: int, seen: Seen, memory: int, layout: Layout, tables: int, lane: int, n: int) -> int:
    one_valve, first = layout.one_valve > 0.0, int(layout.first)
    for i in range(n):
        for valve in range(first, 4):
            own = valve - first
            opened = seen.action[own, i] if not one_valve else (1 - 2 * (own % 2)) * seen.action[own // 2, i]
            seen.opening[valve, i] = opened
    return 0


@kernel
def _flow_stage(world: World, seen: Seen, memory: int, layout: Layout, tables: int, lane: int, n: int) -> int:
    first = int(layout.first)
    wanted, one_valve, state, p, openings = seen.action, layout.one_valve > 0.0, world.state, world.rig, seen.opening
    for i in range(n):
        full = p[at.CONDUCTANCE, i] * p[at.SUPPLY, i] * p[at.RHO0, i] * math.sqrt(p[at.COLDNESS, i])
        for cylinder in range(first // 2, 2):
            pp, tp, pn, tn = (at.PP1, at.TP1, at.PN1, at.TN1) if cylinder == 0 else (at.PP2, at.TP2, at.PN2, at.TN2)
            chamber_p, chamber_n = (0, 1) if cylinder == 0 else (2, 3)
            end_p, coldness_p = tubes.at_valve(p, i, world.at_valve[chamber_p, i], state[pp, i], state[tp, i])
            end_n, coldness_n = tubes.at_valve(p, i, world.at_valve[chamber_n, i], state[pn, i], state[tn, i])
            fill_p, drain_p = driving_flows(p, i, end_p, 1.0 / end_p, coldness_p)
            fill_n, drain_n = driving_flows(p, i, end_n, 1.0 / end_n, coldness_n)
            if one_valve:
                half = p[at.HALF_L1, i] if cylinder == 0 else p[at.HALF_L2, i]
                y = max(-0.95 * half, min(0.95 * half, state[at.Y1, i] if cylinder == 0 else state[at.Y2, i]))
                opened = valves.opening_for_active_flow(
                    full * wanted[cylinder - first // 2, i],
                    fill_p,
                    drain_p,
                    fill_n,
                    drain_n,
                    half / (half + y),
                    half / (half - y),
                    valve_of(p, i, chamber_p),
                    valve_of(p, i, chamber_n),
                )
                openings[chamber_p, i], openings[chamber_n, i] = opened, -opened
            else:
                flow_p, flow_n = full * wanted[chamber_p - first, i], full * wanted[chamber_n - first, i]
                openings[chamber_p, i] = valves.opening_for_flow(flow_p, fill_p, drain_p, valve_of(p, i, chamber_p))
                openings[chamber_n, i] = valves.opening_for_flow(flow_n, fill_n, drain_n, valve_of(p, i, chamber_n))
    return 0


class _ByLayout(Actuation):
    """An actuation whose openings a ``kernel`` computes, here and in the closed loop; ``entries`` with a valve per chamber, or
    per cylinder."""

    kernel: ClassVar[tuple[Callable[..., int], bool]]
    """And whether it has to see the world."""
    entries: ClassVar[tuple[tuple[str, ...], tuple[str, ...]]]

    def __init__(self, layout: str, topology: Topology = TOPOLOGIES[TWO_CYLINDERS]) -> None:
        self._one_valve, self._first = layout == "one_valve", topology.chambers[0]
        self.names = self.entries[self._one_valve][topology.cylinders[0] if self._one_valve else self._first :]
        self.size = len(self.names)
        self._action: Array = np.zeros((self.size, 0))

    def begin(self, lanes: Mask) -> None:
        if self._action.shape[1] != len(lanes):
            self._action = np.zeros((self.size, len(lanes)))

    def accept(self, actions: Array) -> None:
        self._action = np.array(actions, dtype=np.float64, order="C")

    def openings(self, plant: Plant, measurement: Measurement, reference: Reference) -> Array:
        openings, world = np.zeros((4, plant.num_envs)), [(plant.lane_parameters, 0), (plant.state, STATE)]
        Loop(plant.num_envs, world, [(self._action, ACTION), (openings, OPENING)], [self._stage()]).run()
        return openings

    def _stage(self) -> Stage:
        function, sees_world = self.kernel
        return Stage(function, Layout.numbers(one_valve=self._one_valve, first=self._first), sees_world=sees_world)

    def stages(self, lanes: int, sampled: bool, foreign: bool) -> list[Stage]:
        """``openings``, compiled into the closed loop."""
        return [self._stage()]


class ValveActuation(_ByLayout):
    """The action is the spool opening: voltage = 5 V + 5 V x action. One entry per valve."""

    kernel, every_period = (_valve_stage, False), False
    entries = (
        tuple(f"opening of the valve of {chamber}, 1" for chamber in CHAMBERS),
        ("opening of the valve of cylinder 1, 1", "opening of the valve of cylinder 2, 1"),
    )


class FlowActuation(_ByLayout):
    """The action is a net mass flow in units of the choked flow C rho0 Ps sqrt(T0/T) (3.2 g/s by default).

    The inverse of the valve characteristic, at the true pressures and with the rig that was drawn, turns it into openings at
    every control period. With
    ``two_valves`` there is a flow per chamber (into it is positive), with ``one_valve`` the active flow qA (8) per cylinder.
    """

    kernel, every_period = (_flow_stage, True), True
    entries = (
        tuple(f"flow into chamber {chamber}, unit of the choked flow" for chamber in CHAMBERS),
        ("active flow qA of cylinder 1, unit of the choked flow", "active flow qA of cylinder 2, unit of the choked flow"),
    )


ACTUATIONS: dict[str, Callable[[str, Topology], Actuation]] = {"valve": ValveActuation, "flow": FlowActuation}
