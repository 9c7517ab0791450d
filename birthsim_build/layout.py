"""Names, units and numbers of the rows that a built loop shares with whoever runs it: the one source of header and JavaScript.

Rows are doubles, one lane. First the world, then what is seen, as in ``birthsim_env.loop.rows``; then the inputs, with which a
person or another program acts on a loop that has its own scenario.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate

from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.signals import REFERENCE_NAMES, REFERENCES, Reference


@dataclass(frozen=True)
class Row:
    """A named row, or ``count`` of them side by side: its number, unit and what it is."""

    name: str
    unit: str
    about: str
    count: int = 1
    number: int = 0


_INPUTS = (
    Row("begins", "s", "when the scenario began, on the clock of the loop: its target, setpoints and hand count from there"),
    Row("episode_time", "s", "since then; written by the loop"),
    Row("clock", "s", "time, while the scenario's parts run; written by the loop"),
    Row("pointer_held", "1", "1 where a person's hand holds the end effector by a spring to the pointer, else 0"),
    *(Row(f"pointer_{axis}", "m", f"{axis} of the pointer") for axis in "xy"),
    Row("pointer_stiffness", "N/m", "of that spring"),
    Row("pointer_damping", "N s/m", "of that hand"),
    Row("pointer_limit", "N", "it pulls no harder"),
    *(Row(f"pointer_force_{axis}", "N", f"what it pulls with along {axis}; written by the loop") for axis in "xy"),
    Row("keep_force", "1", "1 where the scenario's hand pushes, else 0"),
    *(Row(f"add_force_{axis}", "N", f"force along {axis} besides") for axis in "xy"),
    *(Row(f"keep_{name}", "1", f"1 where the scenario's {name} counts, else 0") for name in REFERENCE_NAMES),
    *(Row(f"add_{name}", unit, f"added to {name}") for name, unit, *_ in Reference.entries()),
)


def _numbered() -> tuple[Row, ...]:
    rows = (*(Row(*entry) for layout in (World, Seen) for entry in layout.entries()), *_INPUTS)
    starts = accumulate((row.count for row in rows), initial=0)
    return tuple(Row(row.name, row.unit, row.about, row.count, start) for row, start in zip(rows, starts, strict=False))


LAYOUT = _numbered()
"""All rows in order."""

INPUTS = sum(row.count for row in _INPUTS)
ROWS = World.size + Seen.size + INPUTS
"""How many inputs, and rows in all."""

(
    BEGINS, EPISODE, CLOCK, HELD, POINTER, STIFFNESS, DAMPING, LIMIT, PULL, KEEP_FORCE, ADD_FORCE, KEEP, ADD
) = accumulate((1, 1, 1, 1, 2, 1, 1, 1, 2, 1, 2, REFERENCES), initial=0)  # fmt: skip
"""Rows of the inputs at which their parts begin."""

FIRST = {KEEP_FORCE: 1.0, STIFFNESS: 500.0, DAMPING: 20.0, LIMIT: 100.0, **{KEEP + k: 1.0 for k in range(REFERENCES)}}
"""Values of inputs with which a loop begins; the others are zero. Those of the pointer are as in ``birthsim-live``."""
