"""N lanes of a scenario: plant, sensors, reference, hand and stiffness setpoints on one clock.

The environments are thin faces of this class. A control period is a fixed order of steps, its ``pipeline``: the actuation opens
the valves, the plant moves, and then reference, hand and sensors are brought to the new instant. What comes with the package is
compiled, and all periods of a policy step are one call; the loop stops only for what a user has written in Python.
"""

from collections.abc import Collection, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from birthsim_env.called import Parts
from birthsim_env.loop import rows as at
from birthsim_env.loop.loop import MixedLoop, Place
from birthsim_env.loop.pipeline import ORDER, Called, Pipeline, Step, group_of
from birthsim_env.loop.signals import Mask, Reference
from birthsim_env.loop.stage import Part, Stage, stage_of
from birthsim_env.loop.world import (
    AT_PLACE,
    GOES_ON,
    ON_TARGET,
    Start,
    guide_stage,
    jump_stage,
    no_force_stage,
    plant_stage,
    start_stages,
)
from birthsim_env.parts.actuation import Actuation
from birthsim_env.parts.courses import check_knots, checked_start
from birthsim_env.parts.drawn.randomization import Ranges, draw_columns
from birthsim_env.parts.drawn.streams import begin, worlds
from birthsim_env.parts.drawn.taking_over import emptied, prepare, take_over
from birthsim_env.parts.hands.user_forces import UserForce
from birthsim_env.parts.references import Trajectory
from birthsim_env.parts.sensors.model import SensorModel, drawn_by
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.physics.compiled.lanes import Array, parameter_column
from birthsim_env.physics.electronics import Electronics
from birthsim_env.physics.linkage.geometry import inverse_geometry
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.strength import require_carried
from birthsim_env.registry import entry
from birthsim_env.restored import Declared

if TYPE_CHECKING:
    from birthsim_env.gradients.recorder import Pullback


class Runs(Protocol):
    """What runs control periods, on some threads; returns how many lanes and periods a stage could not serve."""

    def run(self, periods: int, threads: int) -> int: ...


class Closes(Protocol):
    """What closes a policy step, and looks at where an episode begins."""

    def step(self) -> Step: ...


def split(ranges: Ranges, names: Collection[str]) -> tuple[Ranges, Ranges]:
    """Those of the ``ranges`` that have one of the ``names``, and the others."""
    named = {name: bounds for name, bounds in ranges.items() if name in names}
    return named, {name: bounds for name, bounds in ranges.items() if name not in named}


def sensors_drawing(ranges: Ranges, sensors: str, electronics: Electronics, lanes: int) -> SensorModel:
    """The model of this name, which draws ``ranges``."""
    model: SensorModel = entry("sensors", sensors).made(electronics, lanes)
    if ranges:
        model.vary(ranges)
    return model


class Simulation(Parts):
    """``num_envs`` lanes under one actuation, at the ``Instant`` that ``begin`` and every ``step`` lead to.

    ``period`` is the control period, s, and ``periods`` of them make a policy step. ``threads`` share the lanes. Without a
    ``force_sensor`` the measured force of the hand is zero. ``outcome`` closes a policy step, where there is one.
    """

    in_state: ClassVar[Declared] = dict.fromkeys(("threads", "outcome", "start", "_order", "_known", "_redrawn", "_of_sensors"))

    def __init__(
        self,
        num_envs: int,
        parameters: Parameters,
        ranges: Ranges,
        trajectory: Trajectory,
        user_force: UserForce,
        stiffness: StiffnessSchedule,
        sensors: str,
        actuation: Actuation,
        periods: int,
        threads: int = 1,
        force_sensor: bool = True,
    ) -> None:
        of_sensors, of_rig = split(ranges, drawn_by(sensors))
        model = sensors_drawing(of_sensors, sensors, parameters.electronics, num_envs)
        super().__init__(parameters, num_envs, trajectory, user_force, stiffness, model, actuation, periods)
        self.nominal = parameter_column(parameters)
        self._model, self._of_sensors = sensors, of_sensors
        self.ranges: Ranges = of_rig
        """What is drawn of the rig."""
        self._redrawn = False
        for part in (trajectory, user_force, stiffness):
            prepare(part, num_envs)
        self.threads, self.force_sensor = threads, force_sensor
        self.outcome: Closes | None = None
        self.action: Array = np.zeros((actuation.size, num_envs))
        self._jumps: Array = np.zeros((5, num_envs))
        self.start: Array = np.zeros((Start.size, num_envs))
        """``Start`` of each lane."""
        self._begun = False
        self._sampled, self._opens = self.sensors.sampled, actuation
        self._order: tuple[str, ...] | None = None
        self._known: tuple[str, ...] = ()
        self._added: dict[str, Step] = {}
        self.made: tuple[Any, ...] = ()
        self._loop, self._look = None, None  # type: tuple[MixedLoop | None, MixedLoop | None]
        self.recorder: Runs | None = None
        """Runs policy steps in place of the loop, see ``birthsim_env.gradients``."""

    def draw(self, ranges: Ranges, parts: Mapping[str, Any]) -> bool:
        """From the next episode of each lane on draw ``ranges`` of the rig and its sensors, and let ``parts``, new ones by
        their names here, take the place of those that are there.

        Returns whether episodes that are under way can go on to their ends; else all lanes must begin anew.
        """
        of_sensors, self.ranges = split(ranges, drawn_by(self._model))
        lanes, self._redrawn = self.plant.num_envs, True
        empty = {name: emptied(getattr(self, name), lanes) for name in parts}
        for part in parts.values():
            prepare(part, lanes)
        if of_sensors != self._of_sensors:
            make = partial(sensors_drawing, sensors=self._model, electronics=self.parameters.electronics, lanes=lanes)
            empty["sensors"], parts = make(self._of_sensors), {**parts, "sensors": make(of_sensors)}
            self._of_sensors = of_sensors
        goes_on = [take_over(getattr(self, name), empty[name], part) for name, part in parts.items()]
        vars(self).update(parts)
        return all(goes_on)

    def __getstate__(self) -> dict[str, Any]:
        """Without the loops, which know addresses."""
        return {**self.__dict__, "_loop": None, "_look": None, "made": (), "recorder": None}

    @property
    def pipeline(self) -> Pipeline:
        """The steps of a control period in their order, which can be printed; another pipeline may be assigned.

        Changed by name: ``simulation.pipeline = simulation.pipeline.without("hand")``. It stays so in later episodes.
        """
        own = self._built_in()
        if self._order is None:
            return own
        return own.renewed([self._added.get(name, name) for name in self._order], self._known)

    @pipeline.setter
    def pipeline(self, pipeline: Pipeline) -> None:
        steps = Pipeline(pipeline)
        self._known = tuple(step.name for step in self._built_in())
        self._order = steps.names
        self._added = {step.name: step for step in steps if not step.built_in}
        self.forget_loops()

    def forget_loops(self) -> None:
        """Build the loops anew at the next step: arrays may be others."""
        self._loop = None

    def begin(
        self, lanes: Mask, seeds: list[int], episodes: NDArray[np.int64], duration: float, position: Array | None = None
    ) -> None:
        """Start new episodes in the lanes of a mask (N,): draw their world, and run what begins them.

        ``position`` (2,), m, starts the end effector there, at rest, instead of on the reference. Raises ``ValueError`` for a
        reference that leaves the workspace within ``duration`` s, a position outside it, and at first for a rig too weak for
        its weight or a hand that begins later.
        """
        chosen = np.flatnonzero(lanes)
        for block, streams in worlds(chosen, seeds, episodes):
            if self.ranges or self._redrawn:
                columns = draw_columns(self.parameters, self.ranges, streams["parameters"], len(block))
                self.plant.lane_parameters[:, block] = columns
            begin(self.trajectory, block, streams["reference"])
            begin(self.user_force, block, streams["user_force"])
            begin(self.stiffness, block, streams["stiffness"])
            begin(self.sensors, block, streams["sensors"])
        self.actuation.begin(lanes)
        self._tick[:, lanes], self._seen[at.TIME, lanes], self._since[:, lanes] = 0.0, 0.0, 0.0
        self.impacts[:, lanes], self._openings[:, lanes] = 0.0, 0.0
        rows = checked_start(self.trajectory, self.stiffness, chosen, len(lanes), duration, self.parameters)
        first = rows[:2] if position is None else np.repeat(position, len(chosen)).reshape(2, -1)
        if not self._begun:
            # The rig as described: that one of those drawn cannot carry its mass is part of the experiment. So with the hand.
            require_carried(first, self.parameters)
            check_knots(self.user_force, chosen, duration)
            self._begun = True
        inverse_geometry(first, self.parameters)  # refuses what is out of reach
        start = Start(self.start)
        start.how[:] = np.where(lanes, ON_TARGET if position is None else AT_PLACE, GOES_ON)
        if position is not None:
            start.place[:, lanes] = position[:, None]
        self._assemble()
        self._samples = self._samples[:0]
        acceleration = self._seen[at.ACCELERATION : at.PRESSURE]
        acceleration[:] = np.nan
        self._run(self._look, 1)
        missing = np.isnan(acceleration)
        if self._sampled and self._has_acceleration and missing.any():
            raise ValueError(
                f"sensors {type(self.sensors).__name__} tell no acceleration; allowed: (2, {len(lanes)}) m/s2, "
                f"since electronics.acceleration_bandwidth = {self.parameters.electronics.acceleration_bandwidth!r}"
            )
        acceleration[missing] = 0.0
        self.actuation.check(self.measurement)

    def step(self, actions: Array) -> None:
        """Integrate over one policy step with ``actions`` (size, N), contiguous float64 in [-1, 1]."""
        if self._loop is None or self._opens is not self.actuation:
            self._assemble()
        self.action[:] = actions
        self.actuation.accept(actions)
        self.impacts[:] = 0.0
        self.run(self.periods)

    def vjp(self, actions: Array) -> "Pullback":
        """``step``, with its bits; returns its pullback, see ``gradients.recorder.Recorder.taken``. Later
        steps are taped too."""
        from birthsim_env.gradients.recorder import Recorder  # late: it generates code

        recorder = self.recorder if isinstance(self.recorder, Recorder) else Recorder(self)
        self.step(actions)
        return recorder.taken()

    def run(self, periods: int) -> None:
        """Go on by some control periods under the action that was accepted last."""
        if self._loop is None:
            self._assemble()
        self._run(self.recorder or self._loop, periods)

    def _run(self, loop: Runs | None, periods: int) -> None:
        if loop is not None and loop.run(periods, self.threads):
            self.actuation.explain(self.measurement, self.reference)

    def places(self) -> tuple[list[Place], list[Place]]:
        """Where the arrays of this class stand in a block: in the world, and in what is seen."""
        plant, lanes, actuation = self.plant, self.plant.num_envs, self.actuation
        self._opens, self._sampled = actuation, self.sensors.sampled
        if len(self.action) != actuation.size:
            self.action = np.zeros((actuation.size, lanes))
        world = [(plant.lane_parameters, 0), (plant.state, at.STATE), (self.impacts, at.IMPACT), (self._motion, at.MOTION)]
        world += [(self._force, at.FORCE), (self._since, at.SINCE_JUMP), (self._tick, at.TICK)]
        world += [(self._at_valves, at.AT_VALVE)]
        seen = [(self._seen, 0), (self.action, at.ACTION), (self._openings, at.OPENING)]
        if actuation.memory_names:
            # A user's own actuation is asked what it shows; a compiled one writes it.
            own = actuation.shown
            self._shown = np.zeros((len(actuation.memory_names), lanes)) if own is None else own
            if own is None:
                self._shown[:] = actuation.memory()
            seen.append((self._shown, at.SHOWN))
        return world, [*seen, *actuation.more_rows(lanes)]

    def rows(self) -> tuple[Array, Array]:
        """Copies of the rows of ``World`` and ``Seen`` now, (WORLD, N) and (SEEN, N)."""
        world, seen = (np.zeros((count, self.plant.num_envs)) for count in (at.WORLD, at.SEEN))
        for rows, places in zip((world, seen), self.places(), strict=True):
            for array, row in places:
                rows[row : row + len(array)] = array
        return world, seen

    def _built_in(self) -> Pipeline:
        """The steps of the parts: stages, and calls of what a user has written in Python."""
        measure = stage_of(self.sensors, "measure") or Called(self.sensors, "measure", self._measure)
        target = stage_of(self.trajectory, "sample") or Called(self.trajectory, "sample", self._follow)
        setpoints = stage_of(self.stiffness, "sample") or Called(self.stiffness, "sample", self._set)
        hand = stage_of(self.user_force, "force") or Called(self.user_force, "force", self._push)
        own = (measure, target, setpoints, hand, *(step.part for step in self._added.values() if step.part is not None))
        foreign = not all(isinstance(part, Stage) for part in own)
        opens = self.actuation.stages(self.plant.num_envs, self.sensors.sampled, foreign)
        plant = plant_stage(self.plant.lane_parameters, self.plant.memory, self.period)
        begins, jumps = (jump_stage(self.period, self.user_force.jump_rate, self._jumps, first) for first in (True, False))
        groups = {
            "actuation": group_of("actuation", [Called(self.actuation, "openings", self._ask)] if opens is None else opens),
            "board": group_of("board", self._board()),
            "plant": group_of("plant", [plant]),
            "target": group_of("target", [target], begins=True),
            "setpoints": group_of("setpoints", [setpoints], begins=True),
            "start": group_of("start", start_stages(self.start, self.nominal, plant), begins=True, period=False),
            "hand": group_of("hand", [hand, *([guide_stage()] if self.parameters.linkage.is_rail else [])], begins=True),
            "jumps": [Step("jumps", jumps, begins, built_in=True)],
            "sensors": group_of("sensors", [measure, *([] if self.force_sensor else [no_force_stage()])], begins=True),
            "outcome": [] if self.outcome is None else [self.outcome.step()],
        }
        return Pipeline(step for name in ORDER for step in groups[name])

    def _board(self) -> list[Part]:
        """What the sensors' board puts out, where they have one."""
        if not self.sensors.has_board:
            return []
        return [stage_of(self.sensors, "put_out", "board_stage") or Called(self.sensors, "put_out", self._put_out)]

    def _assemble(self) -> None:
        """Bring the loops up to the pipeline; what is compiled and stands side by side runs in one call."""
        lanes, pipeline, places = self.plant.num_envs, self.pipeline, self.places()
        # A part may have made room anew, or be another one.
        arrays = tuple(array.__array_interface__["data"][0] for place in places for array, _ in place)
        parts = [*(step.part for step in pipeline), *(step.begin for step in pipeline if step.begin is not step.part)]
        made = (arrays, *(part.key() if isinstance(part, Stage) else part for part in parts))
        if self._loop is not None and made == self.made:
            return
        self._loop = MixedLoop(lanes, *places, pipeline.every_period, pipeline.closing)
        self._look = MixedLoop(lanes, *places, pipeline.beginning)
        self.made = made

    def reference_at(self, time: Array) -> Reference:
        """What is asked for at ``time`` (N,) of the present episodes, s."""
        return Reference(np.concatenate([self.trajectory.sample(time), self.stiffness.sample(time)]))
