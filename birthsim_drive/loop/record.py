"""What a drive keeps of every control period: rows of a file that two processes share and that outlives both."""

from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from birthsim_env.loop.rows import Signals
from birthsim_env.loop.signals import Measurement
from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.compiled.records import Rows, part, row, rows


class Period(Rows):
    """A control period."""

    signals = part(Signals, "what was measured and asked for")
    opening = rows("opening_P1 opening_N1 opening_P2 opening_N2", "1", "opening that was written")
    law = rows("law_P1 law_N1 law_P2 law_N2", "1", "opening that the controller and the plan asked for")
    arrived = row("s", "when the sample arrived, on the computer's clock")
    written = row("s", "when its openings had been written")
    has_sample = row("1", "1 where a sample came, else 0")
    phase = row("1", "one of PHASES")
    missed = row("1", "samples so far that no openings answered in time, as the rig counts them")


PHASES = ("wait", "ramp", "course", "hold", "fade", "end")
"""What a control period belongs to: waiting for a first good sample with closed valves, the way to the course, the course,
holding after a fault, fading out, the stated end."""

HEAD = 8
"""Numbers before the rows: rows that are there, the pulse, and whether to end."""

_COUNT, _PULSE, _ENDS = range(3)

_FIELDS: dict[str, int | slice] = {
    "time": Signals.time.first, "position": Signals.position.place, "velocity": Signals.velocity.place,
    "position_time": Signals.position_time.first, "pressures": Signals.pressure.place, "user_force": Signals.user_force.place,
}  # fmt: skip
"""Field of a ``Measurement`` of one rig -> where it stands in ``Signals``."""


def keep_signals(row: Array, seen: Measurement) -> None:
    """Write a measurement of one rig into a row."""
    for name, place in _FIELDS.items():
        row[place] = getattr(seen, name)
    if seen.acceleration is not None:
        row[Signals.acceleration.place] = seen.acceleration


class Record:
    """Room for ``room`` periods in the file ``path``, made anew or opened.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     made = Record.make(pathlib.Path(folder) / "periods", 10)
    ...     made.row(0)[:] = 1.0
    ...     made.count = 1
    ...     bool(Record(pathlib.Path(folder) / "periods").kept.sum() == Period.size)
    True
    """

    def __init__(self, path: Path) -> None:
        self._mapped = np.memmap(path, dtype=np.float64, mode="r+")
        # Without the class of its own, whose views take time.
        self._whole: NDArray[np.float64] = self._mapped.view(np.ndarray)
        self._rows: Array = self._whole[HEAD:].reshape(-1, Period.size)

    @classmethod
    def make(cls, path: Path, room: int) -> Self:
        """A new one; its pages are touched, so that the loop waits for no disk."""
        np.zeros(HEAD + room * Period.size).tofile(path)
        return cls(path)

    @property
    def room(self) -> int:
        """Periods for which there is room."""
        return len(self._rows)

    @property
    def count(self) -> int:
        """Periods that are kept."""
        return int(self._whole[_COUNT])

    @count.setter
    def count(self, value: int) -> None:
        self._whole[_COUNT] = value

    @property
    def pulse(self) -> float:
        """When the loop was alive last, s of the computer's clock; 0 before it began."""
        return float(self._whole[_PULSE])

    @pulse.setter
    def pulse(self, value: float) -> None:
        self._whole[_PULSE] = value

    @property
    def shall_end(self) -> bool:
        """Whether somebody asks the loop to end."""
        return bool(self._whole[_ENDS])

    def ask_to_end(self) -> None:
        """Ask the loop to end as its owner has chosen."""
        self._whole[_ENDS] = 1.0

    def row(self, k: int) -> Array:
        """Row ``k``, to be written."""
        place: Array = self._rows[k]
        return place

    @property
    def kept(self) -> Array:
        """The rows that are kept, (Period.size, T), a copy."""
        kept: Array = np.ascontiguousarray(self._rows[: self.count].T.copy())
        return kept
