"""Runs of loops, recorded so that the same library for another processor can run them again."""

from dataclasses import dataclass, field

import numpy as np

from birthsim_env.loop import loop as loops
from birthsim_env.physics.compiled.prebuilt import key_of, symbol_of

KERNELS = ("i",) * 7


def _whole(array):
    """The array whose memory a view shows."""
    while isinstance(array.base, np.ndarray):
        array = array.base
    return array


def _place(array):
    return array.__array_interface__["data"][0]


@dataclass
class Run:
    """One run of a loop: its memory before and after, pointers in it, and the kernels that it calls."""

    loop: object
    periods: int
    regions: list = field(default_factory=list)
    pointers: list = field(default_factory=list)
    kernels: list = field(default_factory=list)
    before: list = field(default_factory=list)
    after: list = field(default_factory=list)
    missed: int = 0

    def __post_init__(self):
        own, (world, seen, stages, closing) = self.loop, self.loop._kept
        self.stages = [*stages, *closing]
        self._kernel(loops._run, 4)
        self.about = self._region(own._about)
        for at, table in ((0, own._moves), (2, own._stages)):
            self._points(own._about, at, table)
        moved = [array for array, _ in (*world, *seen)]
        memories = list({id(one.memory): one.memory for one in self.stages if one.memory is not None}.values())
        for row, array in enumerate([*moved, *memories]):
            assert own._moves[row, 0] == _place(array)
            self._points(own._moves, own._moves.shape[1] * row, array)
        for row, (stage, table) in enumerate(zip(self.stages, own._tables, strict=True)):
            first = own._stages.shape[1] * row
            self.pointers.append([self._region(own._stages), 8 * first, 1, self._kernel(stage.function, 7), 0])
            self._points(own._stages, first + 4, stage.constants)
            self._points(own._stages, first + 5, table)
            for k, array in enumerate(stage.tables):
                self._points(table, table.shape[1] * k, array)
        self.before = [array.tobytes() for array in self.regions]

    def _region(self, array):
        whole = _whole(array)
        found = [k for k, one in enumerate(self.regions) if one is whole]
        if not found:
            assert whole.flags.c_contiguous or whole.flags.f_contiguous
            self.regions.append(whole)
        return found[0] if found else len(self.regions) - 1

    def _kernel(self, kernel, count):
        symbol = symbol_of(key_of(kernel, ["i"] * count))
        if symbol not in self.kernels:
            self.kernels.append(symbol)
        return self.kernels.index(symbol)

    def _points(self, holder, word, array):
        target = self._region(array)
        self.pointers.append([self._region(holder), 8 * word, 0, target, _place(array) - _place(self.regions[target])])

    def ends(self, missed):
        self.after, self.missed = [array.tobytes() for array in self.regions], missed

    def record(self):
        """What ``replay.c`` reads."""
        sizes = [len(content) for content in self.before]
        head = [len(sizes), len(self.pointers), len(self.kernels), self.about, self.periods, self.loop._lanes]
        numbers = np.array([*head, *sizes, *(word for one in self.pointers for word in one)], dtype=np.int64)
        names = b"".join(name.encode().ljust(32, b"\0") for name in self.kernels)
        return numbers.tobytes() + names + b"".join(self.before)

    def differences(self, said):
        """Regions that what ``replay.c`` wrote has other bits in; pointers differ anyway."""
        held, found, at = {one[0] for one in self.pointers}, [], 0
        for k, content in enumerate(self.after):
            if k not in held and said[at : at + len(content)] != content:
                found.append((k, self.regions[k].shape))
            at += len(content)
        assert len(said) == at + 8
        return found + ["missed"] * (int.from_bytes(said[at:], "little", signed=True) != self.missed)


def recorded(monkeypatch, walk, skip=2):
    """The runs of all loops with other stages than those before, on their third time round, while ``walk()`` is walked."""
    runs, times = {}, {}
    run = loops.Loop.run

    def noted(own, periods=1, threads=1):
        stages = own._kept[2], own._kept[3]
        key = (type(own), *(stage.function for group in stages for stage in group))
        times[key] = times.get(key, 0) + 1
        if type(own) is not loops.Loop or times[key] != 1 + skip:
            return run(own, periods, threads)
        one = runs[key] = Run(own, periods)
        one.ends(run(own, periods, 1))
        return one.missed

    with monkeypatch.context() as patch:
        patch.setattr(loops.Loop, "run", noted)
        walk()
    return list(runs.values())
