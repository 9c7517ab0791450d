"""Limits of a rig, and what its owner wants to happen at each fault: from TOML, else what the rig's description says."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from birthsim_drive.safety.faults import ACTIONS, CLOSE, HOLD, KINDS, VENT, WATCHED
from birthsim_env.loop.guard import FAULT_TIME
from birthsim_env.physics.rig.parameters import Parameters
from birthsim_env.physics.rig.reading import read_toml
from birthsim_env.physics.rig.values import checked_number, near, shown

OVER_SUPPLY, UNDER_ATMOSPHERE = 1e5, 0.3e5
"""Pa, assumed: a chamber may have so much more than its supply, where a piston is pushed in, and so much less than the air
outside."""

SINKS = 0.05
"""Opening beyond the overlap at which chambers vent so slowly that the default rig's head sinks at 0.2 m/s and meets its stop
at 0.05 m/s; with valves fully open it falls at 1.8 and meets it at 0.5. Found by trial."""

CLOSING = 0.2
"""s for which closed valves are written before the driver is stopped; assumed."""


def _limit(unit: str, about: str, default: float = math.nan, least: float = 0.0, most: float = math.inf) -> Any:
    """A limit; one without a default follows from the rig, infinity switches it off where there is no ``most``."""
    return field(default=default, metadata={"unit": unit, "about": about, "bounds": {"least": least, "most": most}})


@dataclass(frozen=True)
class Limits:
    """What a rig must not do. SI units; ``inf`` switches a limit off; defaults are assumed unless they follow from the rig.

    ``on_fault`` is kind of fault -> "close", "vent" or "hold"; kinds that it lacks have ``default``.
    """

    pressure: float = _limit("Pa", "highest pressure of a chamber, absolute; else 1 bar above the supply")
    least_pressure: float = _limit("Pa", "lowest; else 0.3 bar below the atmosphere", least=-math.inf)
    speed: float = _limit("m/s", "fastest speed of the end effector", 1.0)
    force: float = _limit("N", "largest force of the hand", 200.0)
    opening: float = _limit("1", "largest opening: commands are cut to it, which is no fault", 1.0, most=1.0)
    margin: float = _limit("m", "nearest that a piston may come to its end stop", 0.004, -math.inf)
    deviation: float = _limit("m", "farthest that the end effector may be from its target", math.inf)
    fault_time: float = _limit("s", "for which samples may be missing, not finite or frozen", FAULT_TIME, most=10.0)
    leap: float = _limit("s", "by which the rig's clock may go on between two samples besides a period", 0.02)
    position_age: float = _limit("s", "since the newest position was taken", 0.2)
    stuck_time: float = _limit("s", "for which a pressure may stand still while its valve is half open", 0.25)
    late_periods: float = _limit("1", "openings in a row that may be computed later than a control period", 20.0)
    start_time: float = _limit("s", "in which a first good sample must come", 5.0)
    vent_opening: float = _limit(
        "1", "of valves that vent; else 0.05 more than their overlap, so that a head sinks, not falls", most=1.0
    )
    vent_time: float = _limit("s", "for which they vent before they close", 4.0)
    default: str = CLOSE
    on_fault: Mapping[str, str] = field(default_factory=dict)

    def action(self, kind: str) -> str:
        """What happens at a fault of a kind; where the controller cannot go on a default of "hold" closes."""
        chosen = self.on_fault.get(kind, self.default)
        return CLOSE if chosen == HOLD and not KINDS[kind].may_hold else chosen

    def end(self, action: str) -> tuple[float, float]:
        """The opening of all valves at an action, and for how long, s."""
        return (-self.vent_opening, self.vent_time) if action == VENT else (0.0, CLOSING)

    def for_rig(self, rig: Parameters) -> "Limits":
        """With what follows from a rig."""
        most, least = rig.air.supply_pressure + OVER_SUPPLY, rig.air.atmospheric_pressure - UNDER_ATMOSPHERE
        valves = (rig.valve_p1, rig.valve_n1, rig.valve_p2, rig.valve_n2)
        overlap = rig.valves.exhaust_overlap + max(0.0, *(one.exhaust_overlap for one in valves))
        return replace(
            self,
            vent_opening=overlap + SINKS if math.isnan(self.vent_opening) else self.vent_opening,
            pressure=most if math.isnan(self.pressure) else self.pressure,
            least_pressure=least if math.isnan(self.least_pressure) else self.least_pressure,
        )

    def words(self) -> list[str]:
        """What is guarded and what happens: a line a limit, and a line an action."""
        numbers = [one for one in fields(self) if one.metadata]
        units = {"1": ""}
        lines = [
            f"{one.name} {getattr(self, one.name):g} {units.get(one.metadata['unit'], one.metadata['unit'])}".rstrip()
            + f": {one.metadata['about']}"
            for one in numbers
        ]
        by_action: dict[str, list[str]] = {}
        for kind in KINDS:
            if kind not in WATCHED:
                by_action.setdefault(self.action(kind), []).append(kind)
        acts = [f"{action} at {', '.join(kinds)}: {ACTIONS[action]}" for action, kinds in by_action.items()]
        return [*lines, *acts, f"at {' and '.join(WATCHED)}: the driver's stop() is called by another process"]


def read_limits(path: Path | None, rig: Parameters) -> Limits:
    """The limits that a TOML file says, for a rig; ``ValueError`` names what is wrong.

    Tables: ``[limits]`` of the numbers of ``Limits``, and ``[on_fault]`` of kinds of faults, and ``default``.
    """
    if path is None:
        return Limits().for_rig(rig)
    tables = read_toml("--safety", path)
    where = f"--safety {str(path)!r}"
    _check_names(where, tables, ("limits", "on_fault"))
    for name, table in tables.items():
        if not isinstance(table, dict):
            raise ValueError(f"{where}: {name} = {shown(table)}; allowed: a table [{name}]")
    known = {one.name: one for one in fields(Limits) if one.metadata}
    numbers, actions = tables.get("limits", {}), dict(tables.get("on_fault", {}))
    _check_names(where, numbers, known)
    for name, value in numbers.items():
        about = known[name].metadata
        if not (value == math.inf and about["bounds"]["most"] == math.inf):
            checked_number(f"{where}: limits.{name}", value, about["unit"], **about["bounds"])
    _check_names(where, actions, ("default", *(kind for kind in KINDS if kind not in WATCHED)))
    for kind, action in actions.items():
        can = [one for one in ACTIONS if one != HOLD or kind == "default" or KINDS[kind].may_hold]
        if action not in can:
            why = ": its signals are not good" if action == HOLD else ""
            raise ValueError(f"{where}: on_fault.{kind} = {shown(action)}; allowed: {', '.join(can)}{why}")
    default = actions.pop("default", CLOSE)
    return Limits(**{name: float(value) for name, value in numbers.items()}, default=default, on_fault=actions).for_rig(rig)


def _check_names(where: str, found: Mapping[str, Any], known: Any) -> None:
    for name in found:
        if name not in known:
            raise ValueError(f"{where}: {shown(name)}{near(name, known)}; allowed: {', '.join(known)}")
