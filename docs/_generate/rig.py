"""The rig's parameters: a table for every section of ``Parameters``, and one of the plant's options."""

import math

from birthsim_env.physics.rig.declaration import LISTED, Parameter, Section
from birthsim_env.physics.rig.parameters import DECLARED, SECTIONS


def rig() -> str:
    """A section with a table for each part of a rig."""
    return "\n\n".join(_section(name, part) for name, part in SECTIONS.items())


def _section(name: str, part: Section) -> str:
    about = (type(part).__doc__ or "").partition(f"\n\n{LISTED}")[0].replace("\n    ", "\n")
    rows = [["parameter", "default", "unit", "allowed", "drawn from", "meaning", "source"]]
    for own, one in part.parameters.items():
        value = getattr(part, own)
        shown = f"`{value!r}`" if isinstance(value, str) else f"{value:.6g}"
        rows.append([f"`{own}`", shown, one.unit.removeprefix("-"), _allowed(one), _drawn(one), one.about, one.source])
    return f"## `{name}`\n\n{about}\n\n{_table(rows)}"


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
