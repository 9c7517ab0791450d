"""A controller as the actuation of an environment: called back once per control period, or compiled into the loop."""

import time
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from baselines.controller import Controller, Deciding, checked_command
from baselines.inputs import COMMAND_OPTIONS, feedforward_rows
from baselines.staged import StagedController
from birthsim_env.loop.rows import ACTION, FEEDFORWARD
from birthsim_env.loop.signals import Mask, Measurement, Reference
from birthsim_env.loop.stage import Part
from birthsim_env.parts.actuation import CHAMBERS, Actuation, ValveActuation
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.values import problem
from birthsim_env.restored import Declared

NO_ACTION = np.zeros(0, dtype=np.float32)
"""What a single environment's ``step`` takes where a controller drives it."""


class Driving(Actuation):
    """A controller as an actuation, called back once per control period. A policy step has no action.

    With a ``name`` it raises ``ValueError`` where the controller returns anything but openings. ``options`` are those of
    ``command``. ``spent`` has the time of each call, us per lane.
    """

    size, every_period = 0, True
    names: tuple[str, ...] = ()
    in_state: ClassVar[Declared] = {"spent": None}

    def __init__(self, controller: Controller, name: str | None, options: dict[str, Array]) -> None:
        self.controller, self._name, self._options, self.spent = controller, name, options, list[float]()

    @property
    def held_periods(self) -> int:
        """Control periods between two calls of ``ask``; 0 where it has nothing to ask."""
        return 0

    def ask(self, measurement: Measurement, reference: Reference) -> None:
        """Ask a controller that decides seldom, before the first of ``held_periods``."""

    def begin(self, lanes: Mask) -> None:
        self.controller.reset(None if lanes.all() else lanes)

    def accept(self, actions: Array) -> None:
        pass

    def openings(self, plant: Plant, measurement: Measurement, reference: Reference) -> Array:
        started = time.perf_counter()
        try:
            command = self.controller.command(measurement, reference, **self._options)
        except (ValueError, MemoryError):
            raise
        except Exception as error:
            if self._name is None:
                raise
            raise ValueError(
                f"controller {self._name!r}: command() fails ({problem(error)}); allowed: openings (4, lanes)"
            ) from error
        self.spent.append((time.perf_counter() - started) * 1e6 / plant.num_envs)
        return command if self._name is None else checked_command(self._name, command, plant.num_envs)


class HeldDriving(Driving):
    """A controller that decides once in a while: its openings stand in the loop, which does not stop for it in between."""

    controller: Any

    def __init__(self, controller: Any, name: str | None, options: dict[str, Array]) -> None:
        super().__init__(controller, name, options)
        self._held: Array = np.zeros((len(CHAMBERS), 0))

    @property
    def held_periods(self) -> int:
        return int(self.controller.held_periods)

    def ask(self, measurement: Measurement, reference: Reference) -> None:
        started = time.perf_counter()
        self._held[:] = self.controller.decide(measurement, reference)
        self.spent.append((time.perf_counter() - started) * 1e6 / self._held.shape[1])

    def stages(self, lanes: int, sampled: bool, foreign: bool) -> Sequence[Part]:
        """What opens the valves as they are held."""
        return ValveActuation("two_valves").stages(lanes, sampled, foreign)

    def more_rows(self, lanes: int) -> list[tuple[Array, int]]:
        if self._held.shape[1] != lanes:
            self._held = np.zeros((len(CHAMBERS), lanes))
        return [(self._held, ACTION)]


class CompiledDriving(Driving):
    """A ``StagedController`` as an actuation: its stages are part of the loop."""

    controller: StagedController

    def stages(self, lanes: int, sampled: bool, foreign: bool) -> list[Part]:
        """The law, compiled into the closed loop; what sensors of the package measure needs no guard."""
        self.controller.prepare(lanes, sampled)
        return self.controller.stages() if foreign else self.controller.inner_stages()

    def more_rows(self, lanes: int) -> list[tuple[Array, int]]:
        """Arrays that the loop places in rows of ``Seen``."""
        own = self.controller.more_rows(lanes)
        if self.controller.asks:
            return own
        force, rate, factor = map(self._options.get, COMMAND_OPTIONS)
        return [(feedforward_rows(lanes, force, rate, factor, taken=self.controller.COMMAND_OPTIONS), FEEDFORWARD), *own]

    def explain(self, measurement: Measurement, reference: Reference) -> None:
        self.controller.refuse(measurement, reference)

    def check(self, measurement: Measurement) -> None:
        """Raise ``ValueError`` where episodes begin with less than the law has to measure."""
        self.controller.require_acceleration(measurement)


def driving(controller: Controller, name: str | None, options: dict[str, Array] | None = None, asks: bool = False) -> Driving:
    """What lets a controller drive a ``Simulation``: compiled where it can be, unless a class of a user's own commands.

    Whoever ``asks`` calls ``ask`` every ``held_periods``, so that the loop need not stop for a controller that decides seldom.
    """
    if asks and isinstance(controller, Deciding):
        return HeldDriving(controller, name, options or {})
    compiled = isinstance(controller, StagedController) and controller.is_compiled()
    return (CompiledDriving if compiled else Driving)(controller, name, options or {})
