"""Domain randomisation of the rig: uniform draws from the ranges that the parameter fields document."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from birthsim_env.physics.parameters import Parameters, field_of, least_dead_volume

Ranges = Mapping[str, tuple[float, float]]

SHARED = ("geometry", "electronics", "cylinder1.stroke", "cylinder2.stroke", "mechanics.impact_speed")
"""Sections and fields in which lanes cannot differ: workspace, clock, sensors and the limit of an episode are those of the
nominal rig."""


KNOWN = 0.2
"""Share of a figure by which it may be off where a rig's owner has described it; assumed."""


def documented_ranges(nominal: Parameters) -> dict[str, tuple[float, float]]:
    """Dotted field name -> (low, high), SI units: what domain randomisation of a rig draws from.

    A figure of the default rig is assumed, and has the range that its field documents (design section 4); one that the owner
    has given another value is known to ``KNOWN``. Where the rig has ``ranges`` of its own, those count.
    """
    ranges = {}
    for section in dataclasses.fields(Parameters):
        for field in dataclasses.fields(section.default) if section.name != "ranges" else ():  # type: ignore[arg-type]
            if field.metadata["randomized"]:
                value = getattr(getattr(nominal, section.name), field.name)
                low, high = field.metadata["randomized"]
                if value != getattr(section.default, field.name):
                    low, high = (
                        max((1 - KNOWN) * value, field.metadata["least"]),
                        min((1 + KNOWN) * value, field.metadata["most"]),
                    )
                ranges[f"{section.name}.{field.name}"] = (low, high)
    volume = "chambers.dead_volume"
    ranges[volume] = (max(ranges[volume][0], least_dead_volume(nominal)), ranges[volume][1])
    return {**ranges, **{name: (low, high) for name, low, high in nominal.ranges}}


def described(nominal: Parameters, randomize: Any) -> str:
    """What the environments' argument ``randomize`` draws of the rig, in words: ``rigs drawn: mass 2 to 5 kg, ...``."""
    if not isinstance(randomize, Mapping):
        randomize = documented_ranges(nominal) if randomize in (True, "plant") else {}
    named = []
    for name, (low, high) in randomize.items():
        section, _, own = name.partition(".")
        words = f"{own} of {section}" if section.startswith("cylinder") else own
        named.append(f"{words.replace('_', ' ')} {low:.4g} to {high:.4g} {field_of(name).metadata['unit']}")
    return f"rigs drawn: {', '.join(named)}" if named else "the rig as described"


def checked_ranges(ranges: Ranges, nominal: Parameters) -> dict[str, tuple[float, float]]:
    """``ranges`` if each names a numeric field that lanes may differ in, with a finite (low, high) possible for ``nominal``.

    Else ``ValueError`` naming the entry.
    """
    checked = {}
    for name, bounds in ranges.items():
        if not isinstance(name, str):
            raise ValueError(f"randomize[{name!r}]; allowed: dotted names of parameters such as 'mechanics.mass'")
        if field_of(name).metadata["choices"]:
            raise ValueError(f"randomize[{name!r}]: allowed: numeric parameters, {name} is a choice")
        if name.partition(".")[0] in SHARED or name in SHARED:
            raise ValueError(f"randomize[{name!r}]: allowed: all but {', '.join(SHARED)}, which are the same in all lanes")
        try:
            low, high = (float(b) for b in bounds)
        except (TypeError, ValueError):
            low, high = math.nan, math.nan
        if not (math.isfinite(low) and math.isfinite(high) and low <= high):
            raise ValueError(f"randomize[{name!r}] = {bounds!r}; allowed: (low, high), finite and ordered")
        checked[name] = (low, high)
        nominal.replace({name: low})
        nominal.replace({name: high})
    # The lightest mass with the most friction is what the integration bears worst.
    worst = {name: bounds[0] if name == "mechanics.mass" else bounds[1] for name, bounds in checked.items()}
    try:
        nominal.replace(worst)
    except ValueError as error:
        raise ValueError(f"randomize: some of the rigs drawn are impossible: {error}") from None
    return checked


def draw_parameters(nominal: Parameters, ranges: Ranges, rng: np.random.Generator) -> Parameters:
    """``nominal`` with every field in ``ranges`` drawn uniformly, independently, in the order of the names."""
    return nominal.replace({name: float(rng.uniform(*ranges[name])) for name in sorted(ranges)})
