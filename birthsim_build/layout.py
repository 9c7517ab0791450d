"""Names, units and numbers of the rows that a built loop shares with whoever runs it: the one source of header and JavaScript.

Rows are doubles, one lane. First ``World``, then ``Seen``, as in ``birthsim_env.loop.rows``; then the inputs, with which a
person or another program acts on a loop that has its own scenario.
"""

from dataclasses import dataclass
from itertools import accumulate

from birthsim_env.loop.rows import Seen, World
from birthsim_env.loop.signals import REFERENCE_NAMES, REFERENCES, Reference
from birthsim_env.physics.compiled.records import Rows, part, row, rows

DRAG_LIMIT = 100.0
"""N, assumed: the person's hand pulls no harder, however far the pointer is. At 120 N downwards, more than cylinder 1 can
hold, it slams into its end stop so fast that the pressure there leaves what the model describes; at 100 N it never did."""

DRAG_DAMPING = 20.0
"""N s/m, assumed: a hand is no bare spring; it acts only while the pointer holds."""

_REFERENCE_UNITS = tuple(unit for _, unit, *_ in Reference.entries())


class Passages(Rows):
    """What is left of smooth passages: an offset at the time ``begins`` comes to rest at zero ``lasts`` later; 0: none."""

    target_begins = row("s", "when the target's passage began")
    target_lasts = row("s", "how long it takes")
    target = rows(8, "SI", "offset of position, velocity, acceleration and jerk as it began")
    setpoints_begin = row("s", "when the setpoints' passage began")
    setpoints_last = row("s", "how long it takes")
    setpoints = rows(5, "N/m", "offset of Kclx, Kcly, Kpneu1, Kpneu2, Kclxy as it began")
    force_begins = row("s", "when the passage of the scenario's force began")
    force_lasts = row("s", "how long it takes")
    force = rows(2, "N", "offset as it began")


class Inputs(Rows):
    """How a person or another program acts on a loop, and what the loop makes of it."""

    begins = row("s", "when the scenario began, on the clock of the loop: its target, setpoints and hand count from there")
    episode_time = row("s", "since then; written by the loop")
    clock = row("s", "time, while parts run that have a clock of their own; written by the loop")
    sensors_begin = row("1", "when the sensors' own clock began: a number of control periods, where sensors are exchanged")
    pointer_held = row("1", "1 where a person's hand holds the end effector by a spring to the pointer, else 0")
    pointer = rows("pointer_x pointer_y", "m", "of the pointer")
    pointer_stiffness = row("N/m", "of that spring")
    pointer_damping = row("N s/m", "of that hand")
    pointer_limit = row("N", "it pulls and pushes no harder")
    push = rows("push_x push_y", "N", "what that hand pushes with besides")
    pointer_force = rows("pointer_force_x pointer_force_y", "N", "of that hand; written by the loop")
    scenario_force = rows("scenario_force_x scenario_force_y", "N", "of the scenario's hand; written by the loop")
    scenario_stiffness = rows(
        "scenario_Kclx scenario_Kcly scenario_Kpneu1 scenario_Kpneu2", "N/m", "setpoint of the scenario; written by the loop"
    )
    passes = rows(
        "pass_target pass_setpoints pass_force",
        "1",
        "1 begins a passage from what was asked for till now: in the next period all stays as it was, and this becomes 0",
    )
    passages = part(Passages, "written by the loop")
    given = part(Reference, "what was asked for in the period before; written by the loop")
    given_force = rows("given_force_x given_force_y", "N", "of the hand in the period before; written by the loop")
    keep_force = row("1", "1 where the scenario's hand pushes, else 0")
    add_force = rows("add_force_x add_force_y", "N", "force besides")
    keep = rows(" ".join(f"keep_{name}" for name in REFERENCE_NAMES), "1", "1 where the scenario's value counts, else 0")
    add = rows(" ".join(f"add_{name}" for name in REFERENCE_NAMES), _REFERENCE_UNITS, "added to it")


@dataclass(frozen=True)
class Row:
    """A named row, or ``count`` of them side by side: its number, unit and what it is."""

    name: str
    unit: str
    about: str
    count: int
    number: int


def _numbered() -> tuple[Row, ...]:
    entries = [entry for layout in (World, Seen, Inputs) for entry in layout.entries()]
    starts = accumulate((entry[-1] for entry in entries), initial=0)
    return tuple(Row(*entry, start) for entry, start in zip(entries, starts, strict=False))


LAYOUT = _numbered()
"""All rows in order."""

ROWS = World.size + Seen.size + Inputs.size
"""How many there are."""

FIRST = Inputs.lane(
    keep_force=1.0, pointer_stiffness=500.0, pointer_damping=DRAG_DAMPING, pointer_limit=DRAG_LIMIT, keep=[1.0] * REFERENCES
)
"""Inputs (``Inputs.size``,) with which a loop begins: none acts."""
