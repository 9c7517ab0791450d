"""A signal of a log whose rows are taken out one cause after the other, with what becomes of them in words."""

from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from baselines.identification.log.faults import Mask
from baselines.identification.log.timing import MOST, NAMED, Grid
from baselines.identification.log.trial import bridged, numbers, runs
from birthsim_env.physics.compiled.lanes import Array


@dataclass(frozen=True)
class Fault:
    """Rows (T,) of a signal, in words: its name and the ``cause``, what is ``allowed`` instead, and ``examples``."""

    cause: str
    allowed: str
    examples: str
    rows: Mask

    def words(self) -> str:
        """Cause, how many rows, and the first of them."""
        count = int(self.rows.sum())
        return f"{self.cause} in {count} row{'s' * (count > 1)} ({self.examples})"


class Signal:
    """Values (C, T) of the signal ``name``, of a ``unit``, on a ``grid``; ``faults`` are what was taken out of it so far.

    What is taken out becomes NaN in ``values``. A signal that loses more than ``MOST`` of its rows is refused by a
    ``ValueError`` that has the cause of most.
    """

    def __init__(self, name: str, values: Array, unit: str, grid: Grid) -> None:
        self.name, self.values, self.faults = name, values, list[Fault]()
        self._unit, self._grid = unit, grid
        self._left = np.zeros(values.shape[1], dtype=np.bool_)
        self._left[grid.place] = True
        self.take(~numbers(values), "is not finite", "finite numbers")

    @property
    def known(self) -> Mask:
        """Rows (T,) with finite numbers."""
        return numbers(self.values)

    @property
    def whole(self) -> Array:
        """Values (C, T) with straight lines across what was taken out."""
        return bridged(self.values)

    def take(self, rows: Mask, cause: str, allowed: str) -> None:
        """Take out those of ``rows`` (T,) that are still there."""
        rows = rows & self._left
        if not rows.any():
            return
        stretches = runs(rows).T
        examples = [f"{self._grid.where(first, last)}: {self._value(first)}" for first, last in stretches[:NAMED].tolist()]
        more = f" and {len(stretches) - NAMED} more" if len(stretches) > NAMED else ""
        self.faults.append(Fault(f"{self.name} {cause}", allowed, f"{', '.join(examples)}{more}", rows))
        self._left &= ~rows
        self.values[:, rows] = np.nan
        lost = int(np.any([fault.rows for fault in self.faults], axis=0).sum())
        if lost > MOST * len(self._grid.rows):
            worst = max(self.faults, key=lambda fault: int(fault.rows.sum()))
            self.refuse(f"{worst.words()}; allowed: {worst.allowed}, but for {100 * MOST:g} % of the rows at most")

    def refuse(self, words: str) -> NoReturn:
        """Refuse the log because of this signal."""
        raise ValueError(f"{self._grid.source}: {words}")

    def notes(self) -> list[str]:
        """What was taken out, in a line a cause."""
        return [f"left out: {fault.words()}; allowed: {fault.allowed}" for fault in self.faults]

    def _value(self, row: int) -> str:
        numbers = [f"{value:.6g}" for value in self.values[:, row]]
        return f"{numbers[0] if len(numbers) == 1 else '(' + ', '.join(numbers) + ')'} {self._unit}".rstrip()
