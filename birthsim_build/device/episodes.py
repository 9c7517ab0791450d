"""Episodes whose lanes live on a device: they advance there, and are drawn here, a few at a time."""

from collections.abc import Callable
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from birthsim_build.device.gradients import DeviceRecorder
from birthsim_build.device.lanes import Lanes
from birthsim_build.device.loops import pieces_of
from birthsim_build.device.machine import machine_named
from birthsim_build.device.program import Pieces, key_of
from birthsim_env.assembly import Setup, checked_actions
from birthsim_env.episodes import Episodes, start_of
from birthsim_env.loop.signals import Measurement, Reference
from birthsim_env.physics.compiled.lanes import Array

TOGETHER = 1021
"""Lanes that begin together; a prime, so that no other axis of an array has this size."""


class DeviceEpisodes(Episodes):
    """``lanes`` lanes on a ``device``; ``assembled`` gives the setup for a number of lanes.

    The lanes of ``simulation`` are those that begin: their worlds are drawn here and copied to the device, where all else
    happens. Arrays that are returned are on the device.
    """

    def __init__(self, device: str, lanes: int, assembled: Callable[[int], Setup]) -> None:
        self._machine = machine_named(device)
        self.arrays = self._machine.arrays
        self._count, self._together = lanes, min(lanes, TOGETHER)
        super().__init__(assembled(self._together))
        pieces_of(self.simulation)  # refuses what is not compiled
        self._like = Episodes(assembled(1 if self._together > 1 else 2))
        self.elapsed, self._numbers = self.arrays.zeros(lanes, dtype=np.int64), np.full(lanes, -1)
        self._lanes: Lanes | None = None
        self._recorder: DeviceRecorder | None = None
        self._shapes: list[tuple[int, ...]] = []
        self._places: dict[tuple[int, int], int] = {}
        self._sent: tuple[NDArray[np.intp], Any, list[Any]] | None = None
        """The lanes that began last, a group of them, there too, and what they began with."""

    def begin(self, lanes: Any, options: dict[str, Any] | None = None, again: bool = False) -> None:
        position, chosen = start_of(options), np.flatnonzero(self.local(lanes))
        if again and self._sent and np.array_equal(chosen, self._sent[0]):
            self._write(*self._sent[1:])
            return
        if not again:
            self._numbers[chosen] += 1
        for first in range(0, len(chosen), self._together):
            block = chosen[first : first + self._together]
            self.begin_first([self._seeds[lane] for lane in block], self._numbers[block], position)
            self._send(block)

    def _send(self, block: NDArray[np.intp]) -> None:
        """Give lanes of the device what the first lanes here begin with."""
        pieces = pieces_of(self.simulation)
        arrays, there = pieces.arrays(), self.arrays.asarray(block)
        shapes = [array.shape for array in arrays]
        if self._lanes is None or shapes != self._shapes:
            self._make(pieces)
            self._shapes = shapes
        assert self._lanes is not None, "made above"
        self._places = {key_of(array): k for k, array in enumerate(arrays)}
        columns = [
            region and self.arrays.array(array[region.at(slice(len(block)))])
            for region, array in zip(self._lanes.program.regions, arrays, strict=True)
        ]
        self._sent = block, there, columns
        self._write(there, columns)

    def _make(self, pieces: Pieces) -> None:
        """Make the lanes anew, with what they had."""
        self._like.begin_first(self._seeds[:1], self._numbers[:1])
        like, taped = pieces_of(self._like.simulation), None
        if self._recorder is not None:
            self._recorder.prepare()
            taped = self._recorder.loop
        before, self._lanes = self._lanes, Lanes(self._machine, pieces, like, self._count, taped)
        # A table may have got room for more; what it had stands first.
        for view, old in zip(self._lanes.views, before.views if before else (), strict=False):
            if old is not None:
                view[tuple(map(slice, old.shape))] = old

    def record(self) -> DeviceRecorder:
        self._recorder = DeviceRecorder(self)
        if self._lanes is not None:
            self._make(pieces_of(self.simulation))
        return self._recorder

    def _write(self, there: Any, columns: list[Any]) -> None:
        """Put what lanes begin with into their data."""
        assert self._lanes is not None, "lanes have begun"
        for view, region, column in zip(self._lanes.views, self._lanes.program.regions, columns, strict=True):
            if region is not None:
                view[region.at(there)] = column
        self.elapsed[there] = 0

    def there(self, array: NDArray[Any]) -> Any:
        """The array of all lanes, on the device, for one of ``simulation``."""
        assert self._lanes is not None, "lanes have begun"
        return self._lanes.views[self._places[key_of(array)]]

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
            self._setup.actuation.explain(self.measurement, self.reference)  # type: ignore[attr-defined]
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

    def get_state(self, *_: Any) -> NoReturn:
        raise NotImplementedError("get_state() of lanes on a device; allowed: without device=")

    def set_state(self, *_: Any) -> NoReturn:
        raise NotImplementedError("set_state() of lanes on a device; allowed: without device=")
