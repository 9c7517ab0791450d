"""What every compiled law shares: lanes, their memory, one rig without lanes, and the stages of a closed loop.

``driving`` puts any controller, compiled or not, into a loop.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from baselines.controller import Controller, checked_command
from birthsim_env.loop.loop import Loop
from birthsim_env.loop.rows import ACTION, ASKED, FEEDFORWARD, OPENING, REFERENCE, Seen, fill_measurement
from birthsim_env.loop.signals import REFERENCES, Mask, Measurement, Reference
from birthsim_env.loop.stage import Stage
from birthsim_env.parts.actuation import Forgetful
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array, parameter_column
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters, load_parameters

NO_ACTION = np.zeros(0, dtype=np.float32)
"""What a single environment's ``step`` takes where a controller drives it."""


def one_lane(measurement: Measurement, reference: Reference) -> tuple[Measurement, Reference]:
    """Signals of one rig, which have no lane axis, as signals over one lane."""

    def column(values: Array) -> Array:
        return np.asarray(values, dtype=np.float64)[..., None]

    m, acceleration = measurement, measurement.acceleration
    seen = Measurement(
        column(m.time), column(m.position), column(m.position_time), column(m.velocity), column(m.pressures),
        column(m.user_force), m.sampled, None if acceleration is None else column(acceleration),
    )  # fmt: skip
    return seen, Reference(column(reference.rows))


COMMAND_OPTIONS = ("feedforward_force", "feedforward_rate", "damping_factor")
"""What ``command`` of a law may take besides the signals."""


def lanes_of(measurement: Measurement, reference: Reference) -> int:
    """The number of lanes of both; ``ValueError`` for signals over different numbers of lanes."""
    rows = {"position": 2, "velocity": 2, "pressures": 4, "user_force": 2, "acceleration": 2}
    lanes = int(measurement.position.shape[1])
    signals = [(f"measurement.{name}", getattr(measurement, name), count) for name, count in rows.items()]
    for name, signal, count in (*signals, ("reference.rows", reference.rows, REFERENCES)):
        if signal is not None and signal.shape != (count, lanes):
            raise ValueError(
                f"{name} has shape {signal.shape}; allowed: {(count, lanes)}, with the lanes of measurement.position"
            )
    return lanes


def feedforward_rows(
    lanes: int, force: Array | None = None, rate: Array | None = None, factor: Array | None = None, *, taken: Sequence[str]
) -> Array:
    """What a law takes besides the signals, (5, lanes), zero where nothing: believed forces along cylinders 1 and 2, N, their
    rates, N/s, and a damping factor. ``ValueError`` for what has not that shape, and for what is not ``taken``."""
    given = np.zeros((5, lanes))
    for name, rows, one in zip(COMMAND_OPTIONS, (given[:2], given[2:4], given[4]), (force, rate, factor), strict=True):
        if one is not None:
            if name not in taken:
                raise ValueError(f"{name} is given; allowed: {' and '.join(taken) or 'nothing'} besides the signals")
            if np.shape(one) != rows.shape:
                raise ValueError(
                    f"{name} has shape {np.shape(one)}; allowed: {rows.shape}, with the lanes of measurement.position"
                )
            rows[:] = one
    return given


@dataclass(frozen=True)
class LawStage:
    """A stage of a law: its function, its constants (C,), the memory (M,) of a lane that starts, and whether it reads an
    acceleration."""

    function: Callable[..., int]
    constants: Array
    fresh: Array
    reads_acceleration: bool = False


class StagedController:
    """A law that is compiled stages. A law derives from it, gives ``law_stages`` and says in ``explain`` what it refuses.

    ``parameters`` is what the controller believes of the rig: a ``Parameters``, a TOML file's path, or None for the defaults.
    """

    COMMAND_OPTIONS: ClassVar[tuple[str, ...]] = COMMAND_OPTIONS
    """What ``command`` takes besides the signals."""

    asks: ClassVar[bool] = False
    """Whether the stages themselves say what the law is asked for, and the forces that it is to believe in."""

    def __init__(self, parameters: Parameters | str | Path | None = None) -> None:
        self.parameters = load_parameters(parameters)
        self._p = parameter_column(self.parameters)
        self._lanes, self._sampled = 0, False
        self._made: list[LawStage] = []
        self._memories: list[Array] = []
        self._loop: Loop | None = None

    def __getstate__(self) -> dict[str, object]:
        """Without the loop, which knows addresses."""
        return {**self.__dict__, "_loop": None}

    def is_compiled(self) -> bool:
        """Whether ``stages`` are all that ``command`` does: not where a derived class has changed it."""
        return getattr(self.command, "__func__", None) is StagedController.command

    def law_stages(self, sampled: bool) -> Sequence[LawStage]:
        """The law for one kind of sensors: ``sampled`` where positions are samples, see ``Measurement``."""
        raise NotImplementedError(f"{type(self).__name__}.law_stages(sampled) is missing; it returns LawStage objects")

    def explain(self, measurement: Measurement, reference: Reference) -> None:
        """Raise the ``ValueError`` for signals, over N lanes, that a stage could not serve."""
        raise ValueError(f"{type(self).__name__} has no gains for one of the setpoints")

    def prepare(self, lanes: int, sampled: bool) -> None:
        """Make room for ``lanes`` lanes and one kind of sensors, where that is new."""
        if (lanes, sampled) != (self._lanes, self._sampled):
            self._lanes, self._sampled, self._made, self._loop = lanes, sampled, list(self.law_stages(sampled)), None
            self._memories = [np.repeat(one.fresh[:, None], lanes, axis=1) for one in self._made]

    def policy_stages(self) -> list[Stage]:
        """What runs before the law, once prepared: a policy where it has one."""
        return []

    def stages(self) -> list[Stage]:
        """Policy and law as stages of a closed loop, with what they remember."""
        pairs = zip(self._made, self._memories, strict=True)
        own = (Stage(one.function, one.constants, memory, sees_world=False) for one, memory in pairs)
        return [*self.policy_stages(), *([] if self.asks else [Stage(ask, sees_world=False)]), *own]

    def require_acceleration(self, measurement: Measurement) -> None:
        """Raise ``ValueError`` without an acceleration where the law, once prepared, needs one."""
        if measurement.acceleration is None and any(one.reads_acceleration for one in self._made):
            raise ValueError(
                f"measurement.acceleration = None; allowed: (2, {self._lanes}) m/s2, since this controller believes in a "
                f"sensor: electronics.acceleration_bandwidth = {self.parameters.electronics.acceleration_bandwidth!r}"
            )

    def reset(self, lanes: Mask | None = None) -> None:
        """Forget the past of all lanes, or of those where ``lanes`` (N,) is True."""
        if lanes is None:
            self._lanes = 0
        elif self._lanes:
            for one, memory in zip(self._made, self._memories, strict=True):
                memory[:, lanes] = one.fresh[:, None]

    def command(
        self,
        measurement: Measurement,
        reference: Reference,
        feedforward_force: Array | None = None,
        feedforward_rate: Array | None = None,
        damping_factor: Array | None = None,
    ) -> Array:
        """Spool openings in [-1, 1] of the valves of chambers P1, N1, P2, N2: (4, N), or (4,) for one rig without lanes.

        Called once per control period. ``feedforward_force`` (2, N), N, along cylinders 1 and 2, is added to what the law
        believes acts on the pistons, and ``feedforward_rate``, N/s, is how fast it changes. ``damping_factor`` (N,) multiplies
        the damping where the law has one to vary. Raises ``ValueError`` for what is not in ``COMMAND_OPTIONS``, for signals
        over different numbers of lanes, for setpoints that the law cannot render, and where an acceleration is missing.
        """
        given = (feedforward_force, feedforward_rate, damping_factor)
        if measurement.position.ndim == 1:
            options = (None if one is None else np.asarray(one, dtype=np.float64)[..., None] for one in given)
            return self.command(*one_lane(measurement, reference), *options)[:, 0]
        if self.run_stages(measurement, reference, given):
            self.explain(measurement, reference)
        return self._openings.copy()

    def run_stages(
        self, measurement: Measurement, reference: Reference, given: Sequence[Array | None] = (), commanded: Array | None = None
    ) -> int:
        """One control period over N lanes, with the arguments of ``command``; returns how many a stage could not serve.

        What is ``commanded`` (4, N) already, the stages find as openings.
        """
        lanes = lanes_of(measurement, reference)
        self.prepare(lanes, measurement.sampled)
        self.require_acceleration(measurement)
        if self._loop is None:
            self._seen, self._asked = np.zeros((ASKED, lanes)), np.zeros((ACTION - ASKED, lanes))
            self._openings: Array = np.zeros((4, lanes))
            unchanged = self._seen.view()
            unchanged.flags.writeable = False
            placed = [(unchanged, 0), (self._asked, ASKED), (self._openings, OPENING), *self.more_rows(lanes)]
            self._loop = Loop(lanes, [], placed, self.stages())
        self._asked[REFERENCES:] = feedforward_rows(lanes, *given, taken=self.COMMAND_OPTIONS)
        fill_measurement(self._seen, measurement)
        self._seen[REFERENCE:] = reference.rows
        if commanded is not None:
            self._openings[:] = commanded
        return self._loop.run()

    def more_rows(self, lanes: int) -> list[tuple[Array, int]]:
        """Arrays of a derived class, once prepared, that its stages read or write besides, with their rows of ``Seen``."""
        return []


@kernel
def ask(world: int, seen: Seen, memory: int, constants: int, tables: int, lane: int, n: int) -> int:
    """A law without a residual is asked for the reference; forces that it is to believe in stay as they were set."""
    for i in range(n):
        for k in range(Reference.size):
            seen.asked.rows[k, i] = seen.reference.rows[k, i]
    return 0


class Driving(Forgetful):
    """A controller as an actuation, called back once per control period. A policy step has no action.

    With a ``name`` it raises ``ValueError`` where the controller returns anything but openings. ``options`` are those of
    ``command``. ``spent`` has the time of each call, us per lane.
    """

    size, every_period = 0, True
    names: tuple[str, ...] = ()

    def __init__(self, controller: Controller, name: str | None, options: dict[str, Array]) -> None:
        self.controller, self._name, self._options, self.spent = controller, name, options, list[float]()

    def begin(self, lanes: Mask) -> None:
        self.controller.reset(None if lanes.all() else lanes)

    def accept(self, actions: Array) -> None:
        pass

    def openings(self, plant: Plant, measurement: Measurement, reference: Reference) -> Array:
        started = time.perf_counter()
        command = self.controller.command(measurement, reference, **self._options)
        self.spent.append((time.perf_counter() - started) * 1e6 / plant.num_envs)
        return command if self._name is None else checked_command(self._name, command, plant.num_envs)


class CompiledDriving(Driving):
    """A ``StagedController`` as an actuation: its stages are part of the loop."""

    controller: StagedController

    def stages(self, lanes: int, sampled: bool) -> list[Stage]:
        """The law, compiled into the closed loop."""
        self.controller.prepare(lanes, sampled)
        return self.controller.stages()

    def more_rows(self, lanes: int) -> list[tuple[Array, int]]:
        """Arrays that the loop places in rows of ``Seen``."""
        own = self.controller.more_rows(lanes)
        if self.controller.asks:
            return own
        force, rate, factor = map(self._options.get, COMMAND_OPTIONS)
        return [(feedforward_rows(lanes, force, rate, factor, taken=self.controller.COMMAND_OPTIONS), FEEDFORWARD), *own]

    def explain(self, measurement: Measurement, reference: Reference) -> None:
        self.controller.explain(measurement, reference)

    def check(self, measurement: Measurement) -> None:
        """Raise ``ValueError`` where episodes begin with less than the law has to measure."""
        self.controller.require_acceleration(measurement)


def driving(controller: Controller, name: str | None, options: dict[str, Array] | None = None) -> Driving:
    """What lets a controller drive a ``Simulation``: compiled where it can be, unless a class of a user's own commands."""
    compiled = isinstance(controller, StagedController) and controller.is_compiled()
    return (CompiledDriving if compiled else Driving)(controller, name, options or {})
