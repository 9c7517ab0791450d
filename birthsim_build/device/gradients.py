"""Gradients of lanes on a device, with the bits of ``birthsim_env.gradients``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from birthsim_build.device.lanes import Lanes
from birthsim_env.gradients.recorder import Pullback, Recorder, weigh
from birthsim_env.loop.rows import MOTION
from birthsim_env.physics.compiled.lanes import PARAMETERS

if TYPE_CHECKING:
    from birthsim_build.device.episodes import DeviceEpisodes


class DeviceRecorder(Recorder):
    """Keeps policy steps of ``episodes`` on tapes on their device. Arrays that it takes and returns are there."""

    def __init__(self, episodes: DeviceEpisodes) -> None:
        super().__init__(episodes.simulation)
        self._episodes, self.arrays = episodes, episodes.arrays

    def advance(self, lanes: Lanes) -> int:
        """A policy step of all ``lanes``, on a tape of its own; how often a stage could not serve a lane."""
        periods = self._episodes.simulation.periods
        tape = lanes.new_tape(periods)
        self._taken = lanes, tape, periods, self.at, slice(PARAMETERS, PARAMETERS + len(self.loop.live))
        return lanes.advance(periods, tape)

    def reached(self) -> tuple[Any, Any]:
        simulation, there = self._episodes.simulation, self._episodes.there
        (motion,) = (array for array, row in simulation.places()[0] if row == MOTION)
        return there(motion).copy(), there(simulation.plant.state).copy()

    def taken(self) -> Pullback:
        lanes, tape, periods, rows, bars = self._taken
        at = {name: self.arrays.asarray(own) for name, own in rows.items()}

        def back(**given: Any) -> tuple[Any, Any]:
            tape[bars] = 0.0
            weigh(tape[bars], at, **given)
            lanes.back(periods, tape)
            return tape[bars][at["carried"]], tape[bars][at["action"]]

        return back
