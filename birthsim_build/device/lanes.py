"""A program with the data of its lanes on a device."""

from typing import Any

import numpy as np

from birthsim_build.code.threads import MISSED
from birthsim_build.device.machine import Machine
from birthsim_build.device.program import Pieces, Program, program_of


class Lanes:
    """``count`` lanes of the loop ``many``; ``other`` as for ``program_of``.

    They begin with what is written into ``views``.
    """

    def __init__(self, machine: Machine, many: Pieces, other: Pieces, count: int) -> None:
        functions, xp = many.functions, machine.arrays
        self.program: Program = program_of(many, other, functions)
        self.count = count
        self._run = machine.load(tuple(functions), self.program.space)
        self._words, self.data = xp.asarray(self.program.words), xp.zeros((self.program.rows, count), dtype=np.int64)
        self._address = machine.address(self._words)
        self._run("place", 1, self._address, machine.address(self.data), count)
        self.views: list[Any] = [region and region.of(self.data, count) for region in self.program.regions]
        """The arrays of the lanes, on the device, in the order of ``Pieces.arrays``; None for one that all lanes share."""

    def advance(self, periods: int) -> int:
        """Run control periods, the last of which closes a policy step; how often a stage could not serve a lane."""
        self._run("advance", self.count, self._address, periods, 0)
        missed = int(self._words[MISSED])
        if missed:
            self._words[MISSED] = 0
        return missed
