"""A rig that a person plays with, and one beside it to compare: no web, no clock, only control periods one after the other."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from baselines.controller import Controller
from birthsim_env.parts.scenarios import SCENARIOS
from birthsim_env.physics.compiled.lanes import PRESSURES, STATES, TEMPERATURES, Array, parameter_column
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.reward import PRESSURE_RANGE, TEMPERATURE_RANGE
from birthsim_live.rig.controllers import build_controller, has_damping, openings
from birthsim_live.rig.frames import frame_of, row_of
from birthsim_live.rig.hand import Hands
from birthsim_live.rig.lane import PASSES, Lane, path_of
from birthsim_live.rig.recorder import Recorder
from birthsim_live.rig.settings import NOTHING, STIFFNESSES, Choices, Settings, default_settings, merged, true_rig

LOWEST, HIGHEST = np.full(STATES, -np.inf), np.full(STATES, np.inf)
"""Of every row of the state: what the model holds for, as in the environments' rewards."""
for _rows, _range in ((PRESSURES, PRESSURE_RANGE), (TEMPERATURES, TEMPERATURE_RANGE)):
    LOWEST[list(_rows)], HIGHEST[list(_rows)] = _range


class Session:
    """A rig under a controller, a scenario and hands; settings change while it moves.

    Arguments: ``rig`` as its owner describes it, which is what the controller believes; ``settings`` to start with;
    ``seed`` of the world, episode after episode; ``policies``, folders, are choices beside those that are shipped;
    ``controller`` where that of the settings has been built already.

    ``settings`` is what is set; ``lost`` says why the rig stands still, or is None; ``hands.hold`` is the person's pointer;
    ``paths`` counts the changes of the target's path; ``recorder`` takes every instant, where there is one. ``second`` is the
    rig beside it, under the controller ``settings.compare``: it has the same world, settings and hand, and lives through the
    same control periods. Time runs on through every change but one: what is compared starts anew, so that both rigs have
    one past. ``reset`` starts anew whatever is set.
    """

    def __init__(
        self,
        rig: Parameters,
        settings: Settings | None = None,
        seed: int = 0,
        policies: Sequence[str] = (),
        controller: Controller | None = None,
    ) -> None:
        self.rig, self.choices = rig, Choices(rig, policies)
        self.settings = settings or default_settings(rig)
        self.period = rig.electronics.control_period
        self.lost: str | None = None
        self.paths = 0
        self.recorder: Recorder | None = None
        self.second: Session | None = None
        self.controller = controller or build_controller(self.settings.controller, rig)
        self._episode = 0
        now = self.settings
        self.duration = SCENARIOS[now.scenario].duration
        self.hands = Hands()
        self.lane = Lane(rig, seed, now.scenario, now.sensors, now.valves)
        if now.compare != NOTHING:
            self.second = self._beside(None)
        self.reset()

    @property
    def time(self) -> float:
        """s since the last reset."""
        return self.lane.time

    @property
    def episode_time(self) -> float:
        """s since the scenario's present episode began."""
        return self.lane.episode_time

    @property
    def state(self) -> Array:
        """State of the plant, (18, 1)."""
        return self.lane.world.state

    def shown_settings(self) -> dict[str, Any]:
        """The settings as the page shows them: with the scenario's setpoints where they hold."""
        shown = self.settings.model_dump()
        if self.settings.stiffness_source == "scenario":
            shown.update(self._scenario_setpoints())
        rigs = [self] if self.second is None else [self, self.second]
        return {**shown, "damping_applies": any(has_damping(one.controller) for one in rigs)}

    def reset(self) -> None:
        """Start the scenario anew: pistons on the target, in balance, at time zero. The settings stay."""
        now, inputs = self.settings, self.lane.inputs
        self._describe_rig()
        self._episode, self.lost = 0, None
        self.lane.choose(_chosen(now))
        inputs.keep_force[:], inputs.pointer_stiffness[:] = float(now.scenario_force), now.drag_stiffness
        self.hands.act(inputs)
        self.lane.start(now.scenario, self.duration)
        self.controller.reset()
        self.paths += 1
        if self.second is not None:
            self.second.hands.hold = self.hands.felt
            self.second.reset()

    def change(
        self, changes: Mapping[str, Any], controller: Controller | None = None, compared: Controller | None = None
    ) -> None:
        """Apply settings; the rig keeps its state and its motion, unless another pair of controllers is to be compared.

        ``controller`` and ``compared`` are those that ``changes`` ask for as ``controller`` and ``compare``, where they have
        been built already. Raises ``ValueError`` naming what is not allowed; nothing is changed then.
        """
        changes = self.choices.checked(changes)
        before, after = self.settings, merged(self.settings, changes, self._scenario_setpoints())
        if after.controller != before.controller:
            self.controller = controller or build_controller(after.controller, self.rig)
            self.controller.reset()
        self.settings, lane = after, self.lane
        self._describe_rig()
        passes = []
        if _chosen(after) != _chosen(before):
            lane.choose(_chosen(after))
            passes.append("setpoints")
        if after.scenario_force != before.scenario_force:
            lane.inputs.keep_force[:] = float(after.scenario_force)
            passes.append("force")
        if after.sensors != before.sensors:
            lane.exchange(after.sensors, self._episode)
        if after.valves != before.valves:
            lane.lay_out(after.valves)
        if after.scenario != before.scenario:
            self.duration, self._episode = SCENARIOS[after.scenario].duration, 0
            self._follow()
        elif passes:
            lane.pass_over(*passes)
        lane.inputs.pointer_stiffness[:] = after.drag_stiffness
        self._compare(before, changes, compared)

    def _compare(self, before: Settings, changes: Mapping[str, Any], controller: Controller | None) -> None:
        """Let the second rig follow the settings, come or go."""
        now = self.settings
        if now.compare == NOTHING:
            self.second = None
        elif self.second is None or now.compare != before.compare:
            self.second = self._beside(controller)
        else:
            self.second.change({name: value for name, value in changes.items() if name not in ("controller", "compare")})
        if self.second is not None and (now.controller, now.compare) != (before.controller, before.compare):
            self.reset()

    def _beside(self, controller: Controller | None) -> Session:
        """A rig with the same settings under the controller to compare with."""
        own = self.settings.model_copy(update={"controller": self.settings.compare, "compare": NOTHING})
        return Session(self.rig, own, self.lane.seed, self.choices.policies, controller)

    def advance(self, periods: int, until: float = math.inf) -> int:
        """Run at least one and up to ``periods`` control periods, none begun after ``until`` (``time.perf_counter``, s); how
        many have run. Where a rig is or gets lost none run."""
        done = 0
        while done < periods and not self.halted and (done == 0 or clock.perf_counter() < until):
            self._advance_one()
            if self.second is not None and self.lost is None:
                self.second.hands.hold = self.hands.felt
                self.second._advance_one()
            done += 1
            if self.recorder is not None:
                self.recorder.take(self)
        return done

    def _advance_one(self) -> None:
        lane = self.lane
        try:
            commanded = openings(self.controller, lane.plant, lane.measurement, lane.reference, self.settings.damping)
        except Exception as error:
            # Whatever a controller of the bench trips over, the page says it and waits.
            self.lost = f"{self.settings.controller} gives up: {error}"
            return
        self.hands.act(lane.inputs)
        lane.advance(commanded)
        self.lost = self._left_range()
        if self.lost is None and self.episode_time > self.duration - self.period / 2:
            self._episode += 1
            self._follow()

    def _left_range(self) -> str | None:
        state = self.state[:, 0]
        if ((state > LOWEST) & (state < HIGHEST)).all():
            return None
        if not np.isfinite(state).all():
            return "the state is no longer finite"
        for name, unit, rows, (low, high) in (
            ("pressure", "Pa", PRESSURES, PRESSURE_RANGE),
            ("temperature", "K", TEMPERATURES, TEMPERATURE_RANGE),
        ):
            for chamber, row in zip(("P1", "N1", "P2", "N2"), rows, strict=True):
                if not low < state[row] < high:
                    return f"{name} of chamber {chamber} = {state[row]:g} {unit}; the model holds from {low:g} to {high:g}"
        raise AssertionError("a state out of range has a row out of range")

    @property
    def halted(self) -> bool:
        """True where only ``reset`` makes it go on: both rigs stand still where one is lost."""
        return self.lost is not None or (self.second is not None and self.second.lost is not None)

    def frame(self) -> dict[str, Any]:
        """The present instant as the page shows it; ``second`` is that of the rig beside it, or None."""
        if self.second is None:
            return {**self._shown(), "second": None}
        self.second.hands.hold = self.hands.hold  # in a pause too
        return {**self._shown(), "second": self.second._shown()}

    def _shown(self) -> dict[str, Any]:
        return {**frame_of(self.row(), self.rig), "pointer_id": self.hands.used, "lost": self.lost}

    def row(self) -> Array:
        """The present instant, as ``frames.frame_of`` takes it."""
        return row_of(self.lane, self.hands)

    def path(self) -> list[list[float]]:
        """The target's path of the running episode, m; one point where it rests."""
        return path_of(self.lane.scenario, self.duration)

    def _describe_rig(self) -> None:
        """Write the rig that moves: mass and friction as set."""
        self.lane.world.rig[:] = parameter_column(true_rig(self.rig, self.settings))[:, None]

    def _follow(self) -> None:
        """Go over to the start of an episode of the scenario."""
        self.lane.follow(self.settings.scenario, self._episode)
        self.lane.pass_over(*PASSES)
        self.paths += 1

    def _scenario_setpoints(self) -> dict[str, float]:
        """What the scenario asks for at this time."""
        asked = self.lane.inputs.scenario_stiffness[:, 0]
        return dict(zip(STIFFNESSES, (round(float(value), 3) for value in asked), strict=True))


def _chosen(settings: Settings) -> tuple[float, ...] | None:
    """The setpoints that take the scenario's place, N/m."""
    return tuple(getattr(settings, name) for name in STIFFNESSES) if settings.stiffness_source == "sliders" else None
