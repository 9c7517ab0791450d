"""A program with the data of its lanes on a device."""

from typing import Any

import numpy as np

from birthsim_build.code.threads import MISSED
from birthsim_build.device.machine import Machine
from birthsim_build.device.program import Pieces, Program, program_of
from birthsim_env.gradients.taped import TapedLoop


class Lanes:
    """``count`` lanes of the loop ``many``; ``other`` as for ``program_of``.

    They begin with what is written into ``views``. Gradients go back as in a ``taped`` loop of ``many``.
    """

    def __init__(self, machine: Machine, many: Pieces, other: Pieces, count: int, taped: TapedLoop | None = None) -> None:
        functions, xp = many.functions, machine.arrays
        self.program: Program = program_of(many, other, functions, taped)
        self.count, self._machine = count, machine
        self._run = machine.load(tuple(functions), self.program.threads)
        self._words, self.data = xp.asarray(self.program.words), xp.zeros((self.program.rows, count), dtype=np.int64)
        self._address = machine.address(self._words)
        self._run("place", 1, self._address, machine.address(self.data), count)
        self.views: list[Any] = [region and region.of(self.data, count) for region in self.program.regions]
        """The arrays of the lanes, on the device, in the order of ``Pieces.arrays``; None for one that all lanes share."""

    def new_tape(self, periods: int) -> Any:
        """Room for ``periods`` control periods: the rig, bars of live rows, and what adjoints read, (words, lanes)."""
        return self._machine.arrays.zeros((self.program.tape(periods), self.count))

    def advance(self, periods: int, tape: Any = None) -> int:
        """Run control periods, the last of which closes a policy step; how often a stage could not serve a lane.

        Where there is a ``tape``, what adjoints read is kept on it."""
        self._run("advance", self.count, self._address, periods, 0 if tape is None else self._machine.address(tape))
        missed = int(self._words[MISSED])
        if missed:
            self._words[MISSED] = 0
        return missed

    def begin(self, chosen: Any, starts: Any) -> None:
        """Begin episodes in lanes whose numbers are ``chosen`` (L,), with a ``Start`` each, ``starts`` (``Start.size``, L)."""
        words = self._machine.arrays.concatenate([chosen[None], starts.view(np.int64)])
        self._run("begin", words.shape[1], self._address, self._machine.address(words), words.shape[1])

    def back(self, periods: int, tape: Any) -> None:
        """Take the bars on a ``tape``, gradients to the live rows at the end, to the beginning."""
        self._run("backward", self.count, self._address, periods, self._machine.address(tape))
