"""The rig's parameters: a table for every section of ``Parameters``."""

import math

from birthsim_env.physics.rig.declaration import LISTED, Parameter, Section
from birthsim_env.physics.rig.parameters import SECTIONS


def rig() -> str:
    """A section with a table for each part of a rig."""
    return "\n\n".join(_section(name, part) for name, part in SECTIONS.items())


def _section(name: str, part: Section) -> str:
    about = (type(part).__doc__ or "").partition(f"\n\n{LISTED}")[0].replace("\n    ", "\n")
    head = ["parameter", "default", "unit", "allowed", "drawn from", "meaning", "source"]
    lines = [f"## `{name}`", "", about, "", f"| {' | '.join(head)} |", f"|{'---|' * len(head)}"]
    for own, one in part.parameters.items():
        value = getattr(part, own)
        shown = f"`{value!r}`" if isinstance(value, str) else f"{value:.6g}"
        cells = [f"`{own}`", shown, one.unit.removeprefix("-"), _allowed(one), _drawn(one), one.about, one.source]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def _allowed(one: Parameter) -> str:
    if one.choices:
        return ", ".join(f"`{choice!r}`" for choice in one.choices)
    low = f"> {one.above:g}" if math.isfinite(one.above) else f"≥ {one.least:g}" if math.isfinite(one.least) else ""
    high = f"≤ {one.most:g}" if math.isfinite(one.most) else ""
    return ", ".join(limit for limit in (low, high) if limit)


def _drawn(one: Parameter) -> str:
    return f"{'on request: ' if one.on_request else ''}{one.range[0]:g} to {one.range[1]:g}" if one.range else ""
