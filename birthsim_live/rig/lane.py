"""One rig and what acts on it, as rows, and the loops of stages that move them: the page without a server runs the same."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from birthsim_build.layout import FIRST, Inputs
from birthsim_build.stages import Period, enter_scenario, enter_sensors, leave_sensors, outside, pair_valves
from birthsim_env.loop.loop import Loop
from birthsim_env.loop.rows import ASKED, Seen, World, measurement_of
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.loop.stage import Stage
from birthsim_env.loop.world import plant_stage
from birthsim_env.parts.courses import checked_start
from birthsim_env.parts.drawn.seeding import stream
from birthsim_env.parts.scenarios import SCENARIOS, Parts
from birthsim_env.parts.sensors.sensors import SENSORS
from birthsim_env.physics.compiled.lanes import Array, parameter_column
from birthsim_env.physics.plant import Plant
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.strength import require_carried
from birthsim_live.rig import stages

SETPOINTS = slice(8, 15)
"""Rows of a reference that are setpoints; those that a person chooses come first."""

PATH_POINTS = 400

PASSES = ("target", "setpoints", "force")
"""What can pass over smoothly, in the order of ``Inputs.passes``."""


def begun(scenario: str, seed: int, episode: int) -> Parts:
    """Target, hand and setpoints of a nominal scenario where an episode begins."""
    parts = SCENARIOS[scenario].nominal()
    for part, name in zip(parts, ("reference", "user_force", "stiffness"), strict=True):
        part.prepare(1)  # type: ignore[attr-defined]
        part.begin(0, stream(seed, episode, name))  # type: ignore[attr-defined]
    return parts


def path_of(scenario: Parts, duration: float) -> list[list[float]]:
    """Where the target goes within ``duration`` s, m; one point where it rests."""
    instants = np.linspace(0.0, duration, PATH_POINTS)
    points = np.round(np.concatenate([scenario[0].sample(np.array([t]))[:2] for t in instants], axis=1).T, 6)
    return (points if np.ptp(points, axis=0).any() else points[:1]).tolist()  # type: ignore[no-any-return]


def valve_stages(layout: str) -> list[Stage]:
    """Between what a law commands and the valves of a layout."""
    return [Stage(pair_valves, sees_world=False)] if layout == "one_valve" else []


def on_their_clock(stage: Stage, period: float, inputs: Array) -> list[Stage]:
    """A stage of sensors with a clock of their own; ``inputs`` are the rows of ``Inputs``."""
    enter, leave = (Stage(one, Period.numbers(period=period), inputs) for one in (enter_sensors, leave_sensors))
    return [enter, stage, leave]


class Lane:
    """A rig that ``rig`` describes, the rows of its ``world``, of what is ``seen``, and of the ``inputs`` that act on it.

    ``plant`` moves it. ``sampled`` says whether the last measurement was. What is exchanged acts from the next period on.
    """

    def __init__(self, rig: Parameters, seed: int, scenario: str, sensors: str, valves: str) -> None:
        self.rig, self.seed, self.period = rig, seed, rig.electronics.control_period
        self.world, self.seen = World(np.zeros((World.size, 1))), Seen(np.zeros((Seen.size, 1)))
        self.inputs = Inputs(FIRST[:, None].copy())
        self._nominal, self.plant = parameter_column(rig), Plant(rig)
        self.sampled = False
        self._shown: Array = np.zeros((stages.SHOWN, 1))
        self._show = self._loop(Stage(stages.show, memory=self._shown))
        self.scenario, self._valves = begun(scenario, seed, 0), valve_stages(valves)
        self.exchange(sensors, 0)

    @property
    def time(self) -> float:
        """s since the last start."""
        return float(self.seen.time[0])

    @property
    def episode_time(self) -> float:
        """s since the scenario's present episode began."""
        return float(self.seen.time[0] - self.inputs.begins[0])

    @property
    def measurement(self) -> Measurement:
        """What the sensors say."""
        feels = self.sampled and self.rig.electronics.acceleration_bandwidth > 0.0
        return measurement_of(self.seen.rows[:ASKED], self.sampled, feels)

    @property
    def reference(self) -> Reference:
        """What is asked for."""
        return Reference(self.seen.reference.rows.copy())

    def shown(self) -> Array:
        """What the stage ``show`` writes of this instant, (SHOWN, 1)."""
        self._show.run()
        return self._shown

    def exchange(self, sensors: str, episode: int) -> None:
        """Put other sensors in place, with the errors of an episode."""
        self._sensors = SENSORS[sensors](self.rig.electronics, 1)
        self._sensors.begin(0, stream(self.seed, episode, "sensors"))
        self.inputs.sensors_begin[:] = self.world.tick + 1.0
        self._assemble()

    def lay_out(self, valves: str) -> None:
        """Put another layout of valves in place."""
        self._valves = valve_stages(valves)
        self._assemble()

    def follow(self, scenario: str, episode: int) -> None:
        """Begin a scenario anew; ``pass_over`` must follow."""
        self.scenario = begun(scenario, self.seed, episode)
        self.inputs.begins[:] = self.seen.time
        self._assemble()

    def choose(self, setpoints: Sequence[float] | None) -> None:
        """Ask for Kclx, Kcly, Kpneu1, Kpneu2, N/m, or again for what the scenario asks for; ``pass_over`` must follow."""
        self.inputs.keep[SETPOINTS], self.inputs.add[SETPOINTS] = float(setpoints is None), 0.0
        self.inputs.add[SETPOINTS][:4, 0] = 0.0 if setpoints is None else setpoints

    def pass_over(self, *what: str) -> None:
        """From this instant on let what has been changed, of ``PASSES``, pass over smoothly."""
        self.inputs.passes[:, 0] = [name in what for name in PASSES]
        self._look.run()

    def start(self, scenario: str, duration: float) -> None:
        """A scenario anew: pistons on the target, in balance, at time zero. Raises ``ValueError`` for a target that leaves the
        workspace within ``duration`` s, and for a rig that cannot carry its weight."""
        self.follow(scenario, 0)
        target, _, setpoints = self.scenario
        at, start = self.inputs, checked_start(target, setpoints, np.array([0]), 1, duration, self.rig, self._nominal)
        require_carried(start[:2], self.rig)
        for rows in (self.world.tick, self.seen.time, self.seen.opening, at.begins, at.sensors_begin, at.passages.rows):
            rows[:] = 0.0
        self._sensors.begin(0, stream(self.seed, 0, "sensors"))
        self._begin.run()
        self.plant.lane_parameters[:], self.plant.state = self.world.rig, self.world.state
        self.world.rig[:], self.world.motion.rows[:] = self.plant.lane_parameters, self.plant.end_effector()
        self._look.run()
        self._sense.run()
        self.sampled = self._sensors.sampled

    def advance(self, openings: Array) -> None:
        """One control period under ``openings`` (4, 1)."""
        self.seen.opening[:] = openings
        self._step.run()
        self.sampled = self._sensors.sampled

    def _assemble(self) -> None:
        inputs, sensors = self.inputs.rows, self._sensors
        enter, leave = Stage(enter_scenario, memory=inputs), Stage(outside, memory=inputs)
        target, force, setpoints = (part.stage() for part in self.scenario)  # type: ignore[union-attr]
        senses = on_their_clock(sensors.stage(), self.period, inputs)  # type: ignore[attr-defined]
        board = on_their_clock(sensors.board_stage(), self.period, inputs) if hasattr(sensors, "board_stage") else []
        asks = [enter, target, setpoints, force, leave]
        self._begin = self._loop(enter, target, setpoints, leave, Stage(stages.begin, self._nominal))
        self._look, self._sense = self._loop(*asks), self._loop(*senses)
        self._step = self._loop(*self._valves, *board, plant_stage(self.plant, self.period), *asks, *senses)

    def _loop(self, *parts: Stage) -> Loop:
        return Loop(1, [(self.world.rows, 0)], [(self.seen.rows, 0)], parts)
