"""The rig's parameters: a table for every section of ``Parameters``."""

import dataclasses
import math

from birthsim_env import Parameters


def rig() -> str:
    """A section with a table for each part of a rig."""
    return "\n\n".join(
        _section(field.name, field.default) for field in dataclasses.fields(Parameters) if field.name != "ranges"
    )


def _section(name: str, part: object) -> str:
    about = (type(part).__doc__ or "").partition("\n\nFields")[0].replace("\n    ", "\n")
    lines = [
        f"## `{name}`",
        "",
        about,
        "",
        "| field | default | unit | allowed | drawn from | basis |",
        "|---|---|---|---|---|---|",
    ]
    for field in dataclasses.fields(part):
        m, value = field.metadata, getattr(part, field.name)
        shown = f"`{value!r}`" if isinstance(value, str) else f"{value:.6g}"
        unit = "" if m["unit"] == "-" else m["unit"]
        lines.append(f"| `{field.name}` | {shown} | {unit} | {_allowed(m)} | {_drawn(m)} | {m['basis']} |")
    return "\n".join(lines)


def _allowed(m: dict) -> str:
    if m["choices"]:
        return ", ".join(f"`{choice!r}`" for choice in m["choices"])
    low = f"> {m['above']:g}" if math.isfinite(m["above"]) else f"≥ {m['least']:g}" if math.isfinite(m["least"]) else ""
    high = f"≤ {m['most']:g}" if math.isfinite(m["most"]) else ""
    return ", ".join(limit for limit in (low, high) if limit)


def _drawn(m: dict) -> str:
    if m["randomized"]:
        return "{:g} to {:g}".format(*m["randomized"])
    return "on request: {:g} to {:g}".format(*m["worth"]) if m["worth"] else ""
