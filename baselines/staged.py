"""What every compiled controller shares: lanes, their memory, and the stages of a closed loop.

``baselines.driving`` puts any controller, compiled or not, into a loop.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from baselines.inputs import COMMAND_OPTIONS, feedforward_rows, lanes_of, one_lane
from birthsim_env.loop import guard
from birthsim_env.loop.loop import MixedLoop
from birthsim_env.loop.rows import (
    ACTION,
    ASKED,
    FAULT,
    OPENING,
    REFERENCE,
    Seen,
    fill_measurement,
    measurement_of,
    signal_of,
)
from birthsim_env.loop.signals import REFERENCES, Mask, Measurement, Reference
from birthsim_env.loop.stage import Part, Stage
from birthsim_env.physics.compiled.compilation import kernel
from birthsim_env.physics.compiled.lanes import Array, parameter_column
from birthsim_env.physics.rig.arrays import shape_of
from birthsim_env.physics.rig.parameters import Parameters, load_parameters
from birthsim_env.physics.rig.values import is_within, near, shown
from birthsim_env.restored import ANY, Declared


@dataclass(frozen=True)
class ControllerStage:
    """A stage of a controller: compiled code that runs over a block of lanes once per control period.

    Parameters
    ----------
    function : callable
        A kernel, ``birthsim_env.physics.compiled.compilation.kernel`` above a function (world, seen, memory, constants,
        tables, lane, n).
    constants : array, (C,)
        What it reads and all lanes share.
    fresh : array, (M,)
        The memory of a lane that starts; every lane has its own, (M, N).
    reads_acceleration : bool
        Whether it needs ``Measurement.acceleration``.
    tables : callable or None
        Makes what it reads besides for N lanes, a tuple of arrays: ``birthsim_env.loop.stage`` says how kernels read them.

    Examples
    --------
    >>> import birthsim
    >>> stages = birthsim.make_controller("pid").controller_stages(sampled=False)
    >>> all(isinstance(one, birthsim.ControllerStage) for one in stages)
    True
    """

    function: Callable[..., int]
    constants: Array
    fresh: Array
    reads_acceleration: bool = False
    tables: Callable[[int], tuple[NDArray[Any], ...]] | None = None


class StagedController:
    """A controller that is compiled stages, and so runs in every target: Gymnasium, browser, C, FMU, GPU.

    Parameters
    ----------
    parameters : Parameters, path, mapping or None
        What the controller assumes of the rig; None stands for the defaults.

    Raises
    ------
    ValueError
        Names the parameter, its value and what is allowed.

    Notes
    -----
    A controller derives from this class, returns its stages from ``controller_stages(sampled)`` and says in ``explain`` what
    it refuses; docs/controllers/own.md shows one. A sample that is not finite is replaced by the last good one; ``missed``
    counts the periods, and ``protect`` chooses what happens then.

    Examples
    --------
    >>> import birthsim
    >>> controller = birthsim.make_controller("pid")
    >>> isinstance(controller, birthsim.StagedController)
    True
    >>> env = birthsim.make("BirthSIM/Circle-v2", policy_period=0.001)
    >>> observation, info = env.reset(seed=0)
    >>> controller.command(env.unwrapped.measurement, env.unwrapped.reference).shape
    (4,)
    """

    COMMAND_OPTIONS: ClassVar[tuple[str, ...]] = COMMAND_OPTIONS
    """What ``command`` takes besides the signals."""

    in_state: ClassVar[Declared] = {"_kept": ANY}
    """NaN stands for what has not been measured yet."""

    asks: ClassVar[bool] = False
    """Whether the stages themselves say what the law is asked for, and the forces that it is to believe in."""

    reads_force: bool = True
    """Whether the law needs ``Measurement.user_force``."""

    def __init__(self, parameters: Parameters | str | Path | None = None) -> None:
        self.parameters = load_parameters(parameters)
        self._p = parameter_column(self.parameters)
        self._lanes, self._sampled = 0, False
        self._made: list[ControllerStage] = []
        self._memories: list[Array] = []
        self._kept: Array = np.zeros((guard.LastGood.size, 0))
        self._loop: MixedLoop | None = None
        self.protect()

    def __getstate__(self) -> dict[str, object]:
        """Without the loop, which knows addresses."""
        return {**self.__dict__, "_loop": None}

    def protect(self, on_fault: str = "hold", fault_time: float = guard.FAULT_TIME) -> Self:
        """Choose what happens where a signal that the law reads is not finite, and forget the past.

        Parameters
        ----------
        on_fault
            "hold" closes all valves, "vent" opens all chambers to the exhaust, once the control has ended.
        fault_time
            s, from 0 to 10, for which such a signal may be missing before the control ends, until ``reset``.

        Returns
        -------
        StagedController
            Itself.

        Raises
        ------
        ValueError
            For another ``on_fault``, and a ``fault_time`` out of its range.
        """
        if not isinstance(on_fault, str) or on_fault not in guard.ON_FAULT:
            like = near(on_fault, guard.ON_FAULT) if isinstance(on_fault, str) else ""
            raise ValueError(f"on_fault = {shown(on_fault)}{like}; allowed: {', '.join(guard.ON_FAULT)}")
        if not is_within(fault_time, least=0.0, most=10.0):
            raise ValueError(f"fault_time = {shown(fault_time)}; allowed: a number >= 0 and <= 10 (s)")
        self._on_fault, self._fault_time, self._lanes, self._loop = on_fault, float(fault_time), 0, None
        return self

    @property
    def missed(self) -> NDArray[np.int64]:
        """Control periods since the start in which a signal that the law reads was replaced, (N,)."""
        return guard.LastGood(self._kept).missed.astype(np.int64)

    @property
    def ended(self) -> NDArray[np.bool_]:
        """Where a signal was missing for longer than ``fault_time``, so that the control has ended, (N,)."""
        return guard.LastGood(self._kept).ended > 0.0

    def is_compiled(self) -> bool:
        """Whether ``stages`` are all that ``command`` does: not where a derived class has changed it."""
        return getattr(self.command, "__func__", None) is StagedController.command

    def controller_stages(self, sampled: bool) -> Sequence[ControllerStage]:
        """The law for one kind of sensors: ``sampled`` where positions are samples, see ``Measurement``."""
        name = f"{type(self).__name__}.controller_stages(sampled)"
        raise NotImplementedError(f"{name} is missing; it returns ControllerStage objects")

    def explain(self, measurement: Measurement, reference: Reference) -> None:
        """Raise the ``ValueError`` for signals, over N lanes, that a stage of the law could not serve."""
        raise ValueError(f"{type(self).__name__} has no gains for one of the setpoints")

    def refuse(self, measurement: Measurement, reference: Reference) -> None:
        """Raise the ``ValueError`` for signals, over N lanes, that one of ``stages`` could not serve."""
        guard.require_good(reference)
        self.explain(measurement, reference)

    def prepare(self, lanes: int, sampled: bool) -> None:
        """Make room for ``lanes`` lanes and one kind of sensors, where that is new."""
        if (lanes, sampled) != (self._lanes, self._sampled):
            self._lanes, self._sampled, self._made, self._loop = lanes, sampled, list(self.controller_stages(sampled)), None
            self._memories = [np.repeat(one.fresh[:, None], lanes, axis=1) for one in self._made]
            self._kept = np.repeat(guard.fresh(self.parameters)[:, None], lanes, axis=1)
            self._seen, self._asked = np.zeros((ASKED, lanes)), np.zeros((ACTION - ASKED, lanes))
            self._openings: Array = np.zeros((4, lanes))
            self.begin(np.ones(lanes, dtype=np.bool_))

    def begin(self, lanes: Mask) -> None:
        """What a derived class does where ``lanes`` (N,) begin anew, once their memories are fresh."""

    def policy_stages(self) -> list[Part]:
        """What runs before the law, once prepared: a policy where it has one."""
        return []

    def inner_stages(self) -> list[Part]:
        """Policy and law as stages of a closed loop, with what they remember."""
        pairs = zip(self._made, self._memories, strict=True)
        own = (
            Stage(one.function, one.constants, memory, one.tables(self._lanes) if one.tables else (), sees_world=False)
            for one, memory in pairs
        )
        return [*self.policy_stages(), *([] if self.asks else [Stage(ask, sees_world=False)]), *own]

    def stages(self) -> list[Part]:
        """What runs where signals come from outside, once prepared: ``inner_stages`` between those of ``guard``."""
        reads = {*guard.SIGNALS} - {"user_force", "acceleration"}
        reads |= {"user_force"} if self.reads_force else set()
        reads |= {"acceleration"} if self._reads_acceleration() else set()
        constants = guard.limits(self.parameters, reads, self._on_fault, self._fault_time)
        first = Stage(guard.let_pass, constants, self._kept, sees_world=False)
        return [first, *self.inner_stages(), Stage(guard.end, constants, sees_world=False)]

    def _reads_acceleration(self) -> bool:
        return any(one.reads_acceleration for one in self._made)

    def require_acceleration(self, measurement: Measurement) -> None:
        """Raise ``ValueError`` without an acceleration where the law, once prepared, needs one."""
        if measurement.acceleration is None and self._reads_acceleration():
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
            self._kept[:, lanes] = guard.fresh(self.parameters)[:, None]
            self._openings[:, lanes] = 0.0
            self.begin(lanes)

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
        over different numbers of lanes, for setpoints that are not finite or that the law cannot render, and where an
        acceleration is missing. What is measured and not finite is no error: see ``protect``, ``missed`` and ``ended``.
        """
        given = (feedforward_force, feedforward_rate, damping_factor)
        if len(shape_of(measurement.position)) == 1:
            named = zip(COMMAND_OPTIONS, given, strict=True)
            options = (None if one is None else signal_of(name, one)[..., None] for name, one in named)
            return self.command(*one_lane(measurement, reference), *options)[:, 0]
        if self.run_stages(measurement, reference, given):
            self.refuse(measurement, reference)
        return self._openings.copy()

    def run_stages(self, measurement: Measurement, reference: Reference, given: Sequence[Array | None] = ()) -> int:
        """One control period over N lanes, with the arguments of ``command``; returns how many a stage could not serve."""
        lanes = lanes_of(measurement, reference)
        self.prepare(lanes, measurement.sampled)
        self.require_acceleration(measurement)
        if self._loop is None:
            self._felt, self._said = measurement.acceleration is not None, np.zeros((2, lanes))
            more, stages, signals = self.more_rows(lanes), self.stages(), self._seen.view()
            # Only what is called back reads the signals that the first stage writes.
            signals.flags.writeable = not all(isinstance(one, Stage) for one in stages)
            placed = [(signals, 0), (self._asked, ASKED), (self._openings, OPENING), (self._said, FAULT)]
            self._loop = MixedLoop(lanes, [], [*placed, *more], stages)
        self._asked[REFERENCES:] = feedforward_rows(lanes, *given, taken=self.COMMAND_OPTIONS)
        fill_measurement(self._seen, measurement)
        self._seen[REFERENCE:] = signal_of("reference.rows", reference.rows)
        return self._loop.run()

    def good_signals(self) -> tuple[Measurement, Reference]:
        """What was measured and asked for in this control period, once the first stage has replaced what is not good."""
        return measurement_of(self._seen, self._sampled, self._felt), Reference(self._seen[REFERENCE:].copy())

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
