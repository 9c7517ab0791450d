"""N lanes of a scenario: plant, sensors, reference, hand and stiffness setpoints on one clock.

The environments are thin faces of this class. A control period is a fixed order of stages: the actuation opens the valves, the
plant moves, and then reference, hand and sensors are brought to the new instant. What comes with the package is compiled, and
all periods of a policy step are one call; the loop stops only for what a user has written in Python.
"""

from typing import TYPE_CHECKING, Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop import rows as at
from birthsim_env.loop.instant import Instant
from birthsim_env.loop.loop import MixedLoop, Place
from birthsim_env.loop.rows import fill_measurement
from birthsim_env.loop.signals import Mask, Reference
from birthsim_env.loop.stage import Part, Stage, stage_of
from birthsim_env.loop.world import jump_stage, no_force_stage, plant_stage
from birthsim_env.parts.actuation import Actuation
from birthsim_env.parts.courses import check_knots, checked_start
from birthsim_env.parts.drawn.randomization import Ranges, draw_columns
from birthsim_env.parts.drawn.streams import begin, worlds
from birthsim_env.parts.hands.user_forces import UserForce, forces_of
from birthsim_env.parts.references import Trajectory
from birthsim_env.parts.sensors.model import SensorModel
from birthsim_env.parts.stiffness_schedules import StiffnessSchedule
from birthsim_env.physics.compiled.lanes import Array, Rig, parameter_column
from birthsim_env.physics.equilibrium import balanced_state
from birthsim_env.physics.geometry import inverse_geometry
from birthsim_env.physics.inverse_kinematics import pistons_at
from birthsim_env.physics.plant import checked
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.values import plain
from birthsim_env.physics.strength import require_carried
from birthsim_env.registry import entry
from birthsim_env.restored import Declared, Kept, is_own

if TYPE_CHECKING:
    from birthsim_env.gradients.recorder import Pullback

LOOKS = ("target", "setpoints", "hand", "jumps", "sensors")
"""Parts that run where an episode begins."""


class Runs(Protocol):
    """What runs control periods, on some threads; returns how many lanes and periods a stage could not serve."""

    def run(self, periods: int, threads: int) -> int: ...


class Simulation(Instant):
    """``num_envs`` lanes under one actuation, at the ``Instant`` that ``begin`` and every ``step`` lead to.

    ``period`` is the control period, s, and ``periods`` of them make a policy step. ``beginning`` stages run where episodes
    begin, ``closing`` stages at the end of a policy step. ``watch`` adds stages that look on in every control period.
    ``threads`` share the lanes. Without a ``force_sensor`` the measured force of the hand is zero.
    """

    in_state: ClassVar[Declared] = {"_sample": Kept(0, 2**62, whole=True), "_samples": Kept(grows=True), "threads": None}

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
        super().__init__(parameters, num_envs)
        self.nominal = parameter_column(parameters)
        self.trajectory, self.user_force, self.stiffness = trajectory, user_force, stiffness
        self.sensors: SensorModel = entry("sensors", sensors).made(parameters.electronics, num_envs)
        of_sensors = {name: ranges[name] for name in ranges if name in self.sensors.drawn}
        if of_sensors:
            self.sensors.vary(of_sensors)
        self.actuation = actuation
        for part in (trajectory, user_force, stiffness):
            if is_own(type(part)):
                vars(part).update({name: plain(value) for name, value in vars(part).items()})
            part.prepare(num_envs)
        self.period = parameters.electronics.control_period
        self.periods, self.threads, self.force_sensor = periods, threads, force_sensor
        self.beginning: list[Stage] = []
        self.closing: list[Stage] = []
        self._watching: tuple[list[Stage], list[Stage]] = [], []
        self.action: Array = np.zeros((actuation.size, num_envs))
        self._jumps: Array = np.zeros((5, num_envs))
        self._wanted: Array = np.zeros((4, num_envs))
        self._samples: Array = np.zeros((0, 2, num_envs))
        self._sample = 0
        self.ranges: Ranges = {name: ranges[name] for name in ranges if name not in of_sensors}
        """What is drawn of the rig."""
        self._begun = False
        self._sampled, self._opens = self.sensors.sampled, actuation
        self.made: tuple[Any, ...] = ()
        self._loop, self._look = None, None  # type: tuple[MixedLoop | None, MixedLoop | None]
        self.recorder: Runs | None = None
        """Runs policy steps in place of the loop, see ``birthsim_env.gradients``."""

    def __getstate__(self) -> dict[str, Any]:
        """Without the loops, which know addresses."""
        return {**self.__dict__, "_loop": None, "_look": None, "made": (), "recorder": None}

    def forget_loops(self) -> None:
        """Build the loops anew at the next step: arrays may be others."""
        self._loop = None

    def begin(
        self, lanes: Mask, seeds: list[int], episodes: NDArray[np.int64], duration: float, position: Array | None = None
    ) -> None:
        """Start new episodes in the lanes of a mask (N,): draw their world and put the pistons on the reference, in balance.

        ``position`` (2,), m, starts the end effector there, at rest, instead. Raises ``ValueError`` for a reference that
        leaves the workspace within ``duration`` s, a position outside it, and at first for a rig too weak for its weight or a
        hand that begins later.
        """
        chosen = np.flatnonzero(lanes)
        for block, streams in worlds(chosen, seeds, episodes):
            if self.ranges:
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
        motion = rows[:4] if position is None else np.repeat([*position, 0.0, 0.0], len(chosen)).reshape(4, -1)
        start = motion[:2]
        if not self._begun:
            # The rig as described: that one of those drawn cannot carry its mass is part of the experiment. So with the hand.
            require_carried(start, self.parameters)
            check_knots(self.user_force, chosen, duration)
            self._begun = True
        inverse_geometry(start, self.parameters)  # refuses what is out of reach
        joints = np.empty((4, len(chosen)))
        pistons_at(motion, Rig(self.nominal), joints)
        own = self.plant.lane_parameters.take(chosen, axis=1)
        self.plant.state[:, chosen] = balanced_state(own, joints[:2], joints[2:], rows[10:12])
        self.plant.begin(chosen)
        self._motion[:] = self.plant.end_effector()
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
        if hasattr(self.actuation, "check"):
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

    def watch(self, commanded: list[Stage], moved: list[Stage]) -> bool:
        """Add stages to every control period, in place of those that close a policy step: ``commanded`` run when the actuation
        has opened the valves, ``moved`` when target, hand and rig are at the new instant, before the sensors look.

        Returns whether the loop stops in every period for something that a user has written in Python."""
        self._watching, self.closing, self.made = (commanded, moved), [], ()
        self._assemble()
        return self._loop is not None and self._loop.stops

    def run(self, periods: int) -> None:
        """Go on by some control periods under the action that was accepted last."""
        self._run(self.recorder or self._loop, periods)

    def _run(self, loop: Runs | None, periods: int) -> None:
        if loop is not None and loop.run(periods, self.threads):
            self.actuation.explain(self.measurement, self.reference)  # type: ignore[attr-defined]

    def places(self) -> tuple[list[Place], list[Place]]:
        """Where the arrays of this class stand in a block: in the world, and in what is seen."""
        plant, lanes, actuation = self.plant, self.plant.num_envs, self.actuation
        self._opens, self._sampled = actuation, self.sensors.sampled
        if len(self.action) != actuation.size:
            self.action = np.zeros((actuation.size, lanes))
        world = [(plant.lane_parameters, 0), (plant.state, at.STATE), (self.impacts, at.IMPACT), (self._motion, at.MOTION)]
        world += [(self._force, at.FORCE), (self._since, at.SINCE_JUMP), (self._tick, at.TICK)]
        seen = [(self._seen, 0), (self.action, at.ACTION), (self._openings, at.OPENING)]
        if actuation.memory_names:
            # A user's own actuation is asked what it shows; a compiled one writes it.
            own = getattr(actuation, "shown", None)
            self._shown = np.zeros((len(actuation.memory_names), lanes)) if own is None else own
            if own is None:
                self._shown[:] = actuation.memory()
            seen.append((self._shown, at.SHOWN))
        more = actuation.more_rows(lanes) if hasattr(actuation, "more_rows") else []
        return world, [*seen, *more]

    def rows(self) -> tuple[Array, Array]:
        """Copies of the rows of ``World`` and ``Seen`` now, (WORLD, N) and (SEEN, N)."""
        world, seen = (np.zeros((count, self.plant.num_envs)) for count in (at.WORLD, at.SEEN))
        for rows, places in zip((world, seen), self.places(), strict=True):
            for array, row in places:
                rows[row : row + len(array)] = array
        return world, seen

    def parts(self, begins: bool = False) -> dict[str, list[Part]]:
        """What a control period runs, in this order: stages, and methods that call what a user has written in Python.

        Those of ``LOOKS`` also run where an episode ``begins``."""
        stages = getattr(self.actuation, "stages", None)
        board = stage_of(self.sensors, "put_out", "board_stage") or self._put_out
        measure = stage_of(self.sensors, "measure") or self._measure
        target = stage_of(self.trajectory, "sample") or self._follow
        setpoints = stage_of(self.stiffness, "sample") or self._set
        hand = stage_of(self.user_force, "force") or self._push
        foreign = not all(isinstance(one, Stage) for one in (measure, target, setpoints, hand))
        return {
            "actuation": [*stages(self.plant.num_envs, self.sensors.sampled, foreign)] if stages else [self._ask],
            "board": [board] if self.sensors.has_board else [],
            "plant": [plant_stage(self.plant.lane_parameters, self.plant.memory, self.period)],
            "target": [target],
            "setpoints": [setpoints],
            "hand": [hand],
            "jumps": [jump_stage(self.period, self.user_force.jump_rate, self._jumps, begins)],
            "sensors": [measure] if self.force_sensor else [measure, no_force_stage()],
        }

    def _assemble(self) -> None:
        """Bring the loops up to the parts; what is compiled and stands side by side runs in one call."""
        lanes, parts, places = self.plant.num_envs, self.parts(), self.places()
        commanded, moved = self._watching
        order = {**parts, "actuation": [*parts["actuation"], *commanded], "sensors": [*moved, *parts["sensors"]]}
        every = [part for group in order.values() for part in group]
        # A part may have made room anew, or be another one.
        arrays = tuple(array.__array_interface__["data"][0] for place in places for array, _ in place)
        made = (arrays, *(part.key() if isinstance(part, Stage) else part for part in every))
        if self._loop is not None and made == self.made:
            return
        looks = [part for name, group in self.parts(begins=True).items() if name in LOOKS for part in group]
        self._loop = MixedLoop(lanes, *places, every, self.closing)
        self._look = MixedLoop(lanes, *places, looks, self.beginning)
        self.made = made

    def loops_of_parts(self) -> tuple[MixedLoop, MixedLoop]:
        """The plant by itself, and the actuation by itself: to be timed, on a copy."""
        lanes, places, parts = self.plant.num_envs, self.places(), self.parts()
        return MixedLoop(lanes, *places, parts["plant"]), MixedLoop(lanes, *places, [*parts["actuation"], *parts["board"]])

    def _ask(self, period: int) -> None:
        if period == 0 or self.actuation.every_period:
            openings = self.actuation.openings(self.plant, self.measurement, self.reference)
            self._wanted[:] = checked("actuation.openings(...)", openings, (4, self.plant.num_envs), "1")
            if self.actuation.memory_names:
                self._shown[:] = self.actuation.memory()
        # Anew in every period: the board of the sensors may have put out something else.
        self._openings[:] = self._wanted

    def _put_out(self, _: int) -> None:
        self._openings[:] = self.sensors.put_out(self.ticks, self._openings)

    def _follow(self, _: int) -> None:
        rows = self.trajectory.sample(self.time)
        self._seen[at.REFERENCE : at.REFERENCE + 8] = checked("reference.sample(time)", rows, (8, self.plant.num_envs), "SI")

    def _set(self, _: int) -> None:
        rows = self.stiffness.sample(self.time)
        self._seen[at.REFERENCE + 8 : at.ASKED] = checked("stiffness.sample(time)", rows, (7, self.plant.num_envs), "N/m")

    def _push(self, _: int) -> None:
        self._sample += 1
        if self._sample >= len(self._samples):
            # A hand that does not feel the rig is asked for a policy step at once.
            count = 1 if self.user_force.closed_loop else self.periods
            times = (self._tick + np.arange(count)[:, None]) * self.period
            self._samples = forces_of(self.user_force, times, self._motion[:2].copy(), self._motion[2:].copy()).copy()
            self._sample = 0
        self._force[:] = self._samples[self._sample]

    def _measure(self, _: int) -> None:
        now = self.sensors.measure(self.ticks, self.time, self.motion, self.plant.pressures, self.force)
        fill_measurement(self._seen, now)
        self._sampled = now.sampled

    def reference_at(self, time: Array) -> Reference:
        """What is asked for at ``time`` (N,) of the present episodes, s."""
        return Reference(np.concatenate([self.trajectory.sample(time), self.stiffness.sample(time)]))
