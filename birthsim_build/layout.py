"""Names, units and numbers of the rows that a built loop shares with whoever runs it: the one source of header and JavaScript.

Rows are doubles, one lane. First the world, then what is seen, as in ``birthsim_env.loop.rows``; then the inputs, with which a
person or another program acts on a loop that has its own scenario.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate

from birthsim_env.loop.rows import MOST_ACTIONS, MOST_HANDED, MOST_SHOWN, SEEN, WORLD
from birthsim_env.loop.signals import REFERENCE_NAMES, REFERENCES
from birthsim_env.physics.compiled.lanes import PARAMETER_NAMES, STATE_NAMES

_PARAMETER_UNITS = (
    *("m2", "m2", "1", "1", "m", "m", "m", "m"),
    *("kg", "m/s2", "N/m", "N s/m"),
    *("1", "N", "N", "N", "N", "N s/m", "N s/m", "m/s", "N/m", "N s/m", "m/s"),
    *("1", "1", "1"),
    *("m2", "m2", "m2", "m2", "m", "m", "m3", "W/(m2 K)", "W/K"),
    *("m3/(s Pa)", "1", "m3/(s Pa)", "s", "Pa", "Pa", "K"),
    *("J/(kg K)", "1", "1", "kg/m3", "K"),
    *("1", "1", "1", "1/Pa", "1/Pa", "1/s", "s/m", "1/kg"),
    *("1", "1", "1"),
    *("Pa", "m3/(s Pa)", "Pa/kg", "1/s", "1", "1", "1/s"),
)
_STATE_UNITS = (*("m", "m/s") * 2, "m", "m", *("Pa", "K") * 4, *("1",) * 4)
_REFERENCE_UNITS = (*("m",) * 2, *("m/s",) * 2, *("m/s2",) * 2, *("m/s3",) * 2, *("N/m",) * 4, *("N/(m s)",) * 2, "N/m")
_CHAMBERS = ("P1", "N1", "P2", "N2")


@dataclass(frozen=True)
class Row:
    """A named row, or ``count`` of them side by side: its number, unit and what it is."""

    name: str
    unit: str
    about: str
    count: int = 1
    number: int = 0


def _named(names: tuple[str, ...], units: tuple[str, ...], prefix: str, about: str) -> list[Row]:
    return [Row(prefix + name, unit, f"{about} {name}") for name, unit in zip(names, units, strict=True)]


_WORLD = (
    *_named(PARAMETER_NAMES, _PARAMETER_UNITS, "rig_", "the rig's"),
    *_named(STATE_NAMES, _STATE_UNITS, "", "state of the plant:"),
    *(
        Row(f"impact{k}", "m/s", f"fastest collision of piston {k} with an end stop; set it to zero to begin anew")
        for k in (1, 2)
    ),
    *(Row(name, "m", f"{name} of the end effector, true") for name in ("x", "y")),
    *(Row(name, "m/s", f"{name} of the end effector, true") for name in ("vx", "vy")),
    *(Row(f"force_{axis}", "N", f"force of the hand along {axis}, true") for axis in "xy"),
    Row("since_jump", "s", "since force or stiffness setpoint jumped"),
    Row("tick", "1", "control periods since the episode began"),
)
_SEEN = (
    Row("time", "s", "since the episode began"),
    *(Row(f"measured_{name}", "m", f"{name} of the end effector as measured") for name in ("x", "y")),
    *(Row(f"measured_{name}", "m/s", f"{name} of the end effector as measured") for name in ("vx", "vy")),
    Row("position_time", "s", "when the position was measured"),
    *(Row(f"measured_a{axis}", "m/s2", f"acceleration along {axis} as measured; 0 without a sensor") for axis in "xy"),
    *(Row(f"measured_P{c}{k}", "Pa", f"pressure P{c}{k} as measured, absolute") for k in "12" for c in "pn"),
    *(Row(f"measured_force_{axis}", "N", f"force of the hand along {axis} as measured") for axis in "xy"),
    *_named(REFERENCE_NAMES, _REFERENCE_UNITS, "reference_", "what is asked for:"),
    *_named(REFERENCE_NAMES, _REFERENCE_UNITS, "asked_", "what the law is asked for:"),
    *(Row(f"feedforward_force{k}", "N", f"force along cylinder {k} that the law is told of") for k in (1, 2)),
    *(Row(f"feedforward_rate{k}", "N/s", f"rate of that force along cylinder {k}") for k in (1, 2)),
    Row("damping_factor", "1", "damping in units of the least, where the law has one to vary; 0: the law's own"),
    Row("action", "1", "the policy's action", MOST_ACTIONS),
    *(Row(f"opening_{name}", "1", f"commanded opening of the valve of chamber {name}, -1 to 1") for name in _CHAMBERS),
    Row("shown", "1", "what a residual shows a policy of its memory", MOST_SHOWN),
    Row("handed", "SI", "what stages of a law hand on", MOST_HANDED),
)
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
    *(Row(f"add_{name}", unit, f"added to {name}") for name, unit in zip(REFERENCE_NAMES, _REFERENCE_UNITS, strict=True)),
)


def _numbered() -> tuple[Row, ...]:
    rows = (*_WORLD, *_SEEN, *_INPUTS)
    starts = accumulate((row.count for row in rows), initial=0)
    return tuple(Row(row.name, row.unit, row.about, row.count, start) for row, start in zip(rows, starts, strict=False))


LAYOUT = _numbered()
"""All rows in order."""

INPUTS = sum(row.count for row in _INPUTS)
ROWS = WORLD + SEEN + INPUTS
"""How many inputs, and rows in all."""

(
    BEGINS, EPISODE, CLOCK, HELD, POINTER, STIFFNESS, DAMPING, LIMIT, PULL, KEEP_FORCE, ADD_FORCE, KEEP, ADD
) = accumulate((1, 1, 1, 1, 2, 1, 1, 1, 2, 1, 2, REFERENCES), initial=0)  # fmt: skip
"""Rows of the inputs at which their parts begin."""

FIRST = {KEEP_FORCE: 1.0, STIFFNESS: 500.0, DAMPING: 20.0, LIMIT: 100.0, **{KEEP + k: 1.0 for k in range(REFERENCES)}}
"""Values of inputs with which a loop begins; the others are zero. Those of the pointer are as in ``birthsim-live``."""
