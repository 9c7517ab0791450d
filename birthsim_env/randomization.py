"""Domain randomisation of the rig: uniform draws from the ranges that the parameter fields document."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np

from birthsim_env.parameters import Parameters, field_of

Ranges = Mapping[str, tuple[float, float]]

SHARED = ("geometry", "electronics", "cylinder1.stroke", "cylinder2.stroke", "mechanics.impact_speed")
"""Sections and fields in which lanes cannot differ: workspace, clock, sensors and the limit of an episode are those of the
nominal rig."""


def documented_ranges() -> dict[str, tuple[float, float]]:
    """Dotted field name -> (low, high), SI units, of every field that carries a range (design section 4)."""
    ranges = {}
    for section in dataclasses.fields(Parameters):
        for field in dataclasses.fields(section.default):  # type: ignore[arg-type]
            if field.metadata["randomized"]:
                ranges[f"{section.name}.{field.name}"] = field.metadata["randomized"]
    return ranges


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
    return checked


def draw_parameters(nominal: Parameters, ranges: Ranges, rng: np.random.Generator) -> Parameters:
    """``nominal`` with every field in ``ranges`` drawn uniformly, independently, in the order of the names."""
    return nominal.replace({name: float(rng.uniform(*ranges[name])) for name in sorted(ranges)})
