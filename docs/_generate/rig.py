"""The rig's parameters: a table for every section of ``Parameters``, and one of the plant's options."""

import math

from birthsim_env.physics.rig.declaration import LISTED, Parameter, Section
from birthsim_env.physics.rig.parameters import DECLARED, SECTIONS


def rig() -> str:
    """A section with a table for each part of a rig, but for its electronics; parts of one kind share theirs."""
    kinds: dict[type[Section], dict[str, Section]] = {}
    for name, part in SECTIONS.items():
        if name != "electronics":
            kinds.setdefault(type(part), {})[name] = part
    return "\n\n".join(f"## {', '.join(f'`{name}`' for name in parts)}\n\n{_section(parts)}" for parts in kinds.values())


def electronics() -> str:
    """The table of the control board and the sensors."""
    return _section({"electronics": SECTIONS["electronics"]})


def _section(parts: dict[str, Section]) -> str:
    """What parts of one kind are, and their table; where they differ, a cell has the value of each in order."""
    first, *_ = parts.values()
    about = (type(first).__doc__ or "").partition(f"\n\n{LISTED}")[0].replace("\n    ", "\n")
    rows = [["parameter", "default", "unit", "allowed", "drawn from", "meaning", "source"]]
    for own in first.parameters:
        each = [_row(part.parameters[own], getattr(part, own)) for part in parts.values()]
        rows.append([f"`{own}`", *("; ".join(dict.fromkeys(cells)) for cells in zip(*each, strict=True))])
    return f"{about}\n\n{_table(rows)}"


def _row(one: Parameter, value: float | str) -> tuple[str, ...]:
    shown = f"`{value!r}`" if isinstance(value, str) else f"{value:.6g}"
    return shown, one.unit.removeprefix("-"), _allowed(one), _drawn(one), one.about, one.source


def options() -> str:
    """A table of the parameters that are drawn on request only."""
    rows = [["parameter", "default", "unit", "drawn from, on request", "meaning", "source"]]
    for name, one in DECLARED.items():
        if one.range and one.on_request:
            rows.append([f"`{name}`", f"{one.default:g}", one.unit.removeprefix("-"), one.drawn, one.about, one.source])
    return _table(rows)


def _table(rows: list[list[str]]) -> str:
    head, *others = (f"| {' | '.join(cells)} |" for cells in rows)
    return "\n".join([head, f"|{'---|' * len(rows[0])}", *others])


def _allowed(one: Parameter) -> str:
    if one.choices:
        return ", ".join(f"`{choice!r}`" for choice in one.choices)
    low = f"> {one.above:g}" if math.isfinite(one.above) else f"≥ {one.least:g}" if math.isfinite(one.least) else ""
    high = f"≤ {one.most:g}" if math.isfinite(one.most) else ""
    return ", ".join(limit for limit in (low, high) if limit)


def _drawn(one: Parameter) -> str:
    return f"{'on request: ' if one.on_request else ''}{one.drawn}"
