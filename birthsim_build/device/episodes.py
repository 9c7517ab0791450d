"""Episodes whose lanes live on a device: they begin and advance there."""

import copy
from collections.abc import Callable
from functools import partial
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from birthsim_build.device.beginning import beginning_with
from birthsim_build.device.gradients import DeviceRecorder
from birthsim_build.device.lanes import Lanes
from birthsim_build.device.loops import SEVERAL
from birthsim_build.device.machine import machine_named
from birthsim_build.device.program import key_of
from birthsim_env.assembly import Arguments, Setup, assemble, checked_actions
from birthsim_env.episodes import Episodes, start_of
from birthsim_env.loop.pipeline import Pipeline
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.loop.world import AT_PLACE, Start
from birthsim_env.parts.drawn.seeding import STREAMS, stream_key
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.linkage.geometry import inverse_geometry
from birthsim_env.registry import register


class DeviceEpisodes(Episodes):
    """``lanes`` lanes on a ``device``, where they begin and advance; ``assembled`` gives the setup for a number of lanes.

    A few lanes here, those of ``simulation``, tell what all of them are made of. Arrays that are returned are on the device.
    """

    def __init__(self, device: str, lanes: int, assembled: Callable[[int], Setup]) -> None:
        self._machine = machine_named(device)
        self.arrays = self._machine.arrays
        super().__init__(assembled(SEVERAL[0]))
        other = Episodes(assembled(SEVERAL[1]))
        self._pieces, self._like = (beginning_with(one) for one in (self, other))
        self._places = {key_of(array): k for k, array in enumerate(self._pieces.arrays())}
        self._count, self.elapsed = lanes, self.arrays.zeros(lanes, dtype=np.int64)
        self._numbers = self.arrays.zeros(lanes, dtype=np.int64) - 1
        self._lanes: Lanes | None = None
        self._recorder: DeviceRecorder | None = None

    def seed(self, seed: int | list[int | None] | None, generator: np.random.Generator) -> None:
        super().seed(seed, generator)
        entropy = np.array([stream_key(one, 0, STREAMS[0])[0] for one in self._seeds], dtype=np.uint64)
        self._entropy = self.arrays.asarray(entropy.view(np.int64))

    def begin(self, lanes: Any, options: dict[str, Any] | None = None, again: bool = False) -> None:
        position, xp = start_of(options), self.arrays
        if position is not None:
            inverse_geometry(position[:, None], self.simulation.parameters)  # refuses what is out of reach
        if self._lanes is None:
            self._make()
        assert self._lanes is not None, "made above"
        chosen = xp.flatnonzero(xp.asarray(lanes))
        if not again:
            self._numbers[chosen] += 1
        start = xp.zeros((Start.size, len(chosen)))
        named, words = Start(start), Start(start.view(np.int64))
        words.seed[:], words.episode[:] = self._entropy[chosen], self._numbers[chosen]
        if position is not None:
            named.how[:], named.place[0], named.place[1] = AT_PLACE, float(position[0]), float(position[1])
        self._lanes.begin(chosen, start)
        self.elapsed[chosen] = 0

    def _make(self) -> None:
        """Make the lanes, or make them anew with what they had."""
        taped = None
        if self._recorder is not None:
            self._recorder.prepare()
            taped = self._recorder.loop
        before, self._lanes = self._lanes, Lanes(self._machine, self._pieces, self._like, self._count, taped)
        if before is not None:
            self._lanes.data[...] = before.data

    def record(self) -> DeviceRecorder:
        self._recorder = DeviceRecorder(self)
        if self._lanes is not None:
            self._make()
        return self._recorder

    def there(self, array: NDArray[Any]) -> Any:
        """The array of all lanes, on the device, for one of ``simulation``."""
        assert self._lanes is not None, "lanes have begun"
        return self._lanes.views[self._places[key_of(array)]]

    @property
    def pipeline(self) -> Pipeline:
        return self.simulation.pipeline

    @pipeline.setter
    def pipeline(self, pipeline: Pipeline) -> None:
        raise NotImplementedError("pipeline of lanes on a device; allowed: to read it, or to assign one without device=")

    def local(self, array: Any) -> NDArray[Any]:
        return self._machine.local(array)

    def columns(self, actions: Any) -> Any:
        return checked_actions(actions, self._count, self.action_size, self._setup.clip_actions, self.arrays)

    def step(self, actions: Any) -> tuple[Any, Any]:
        if self._lanes is None:
            raise RuntimeError("step() before reset(): call reset(seed=...) first")
        if self.action_size:
            self.there(self.simulation.action)[...] = actions
        self.there(self.simulation.impacts)[...] = 0.0
        recorder, lanes = self._recorder, self._lanes
        if recorder.advance(lanes) if recorder else lanes.advance(self.simulation.periods):
            self._setup.actuation.explain(self.measurement, self.reference)
        self.elapsed += 1
        return self.there(self._outcome.terms).copy(), self.there(self._outcome.ends)[0] > 0.0

    @property
    def measurement(self) -> Measurement:
        return self.simulation.signals_in(self.local(self.there(self.simulation.seen)))[0]

    @property
    def reference(self) -> Reference:
        return self.simulation.signals_in(self.local(self.there(self.simulation.seen)))[1]

    @property
    def plant_state(self) -> Any:
        return self.there(self.simulation.plant.state)

    @property
    def success(self) -> Any:
        return self.there(self._outcome.ends)[1] > 0.0

    def observation(self) -> Any:
        return self.there(self._outcome.seen).copy()

    def describe(self) -> Array:
        rows: Array = self.there(self._outcome.rows).copy()
        return rows

    def set_ranges(self, randomize: Any) -> NoReturn:
        raise NotImplementedError("set_ranges() of lanes on a device, whose code draws the ranges; allowed: without device=")

    def get_state(self, *_: Any) -> NoReturn:
        raise NotImplementedError("get_state() of lanes on a device; allowed: without device=")

    def set_state(self, *_: Any) -> NoReturn:
        raise NotImplementedError("set_state() of lanes on a device; allowed: without device=")


def _on(device: str, lanes: int, scenario: str, arguments: Arguments) -> DeviceEpisodes:
    # Each setup prepares the parts that it is given for its own lanes.
    return DeviceEpisodes(device, lanes, lambda few: assemble(few, scenario, **copy.deepcopy(arguments)))


register(device="cuda", about="an NVIDIA GPU; arrays are CuPy's", needs={"extra cuda"})(partial(_on, "cuda"))
register(device="host", about="the code of a GPU's threads, on this processor")(partial(_on, "host"))
