"""Domain randomisation of the rig: uniform draws from the ranges that the parameter fields document."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np

from birthsim_env.parameters import Parameters, field_of

Ranges = Mapping[str, tuple[float, float]]


def documented_ranges() -> dict[str, tuple[float, float]]:
    """Dotted field name -> (low, high), SI units, of every field that carries a range (design section 4)."""
    ranges = {}
    for section in dataclasses.fields(Parameters):
        for field in dataclasses.fields(section.default):  # type: ignore[arg-type]
            if field.metadata["randomized"]:
                ranges[f"{section.name}.{field.name}"] = field.metadata["randomized"]
    return ranges


def checked_ranges(ranges: Ranges) -> dict[str, tuple[float, float]]:
    """``ranges`` if every name is a numeric field and every (low, high) ordered and finite; else ``ValueError``."""
    checked = {}
    for name, bounds in ranges.items():
        if field_of(name).metadata["choices"]:
            raise ValueError(f"randomize[{name!r}]: allowed: numeric parameters, {name} is a choice")
        try:
            low, high = (float(b) for b in bounds)
        except (TypeError, ValueError):
            low, high = math.nan, math.nan
        if not (math.isfinite(low) and math.isfinite(high) and low <= high):
            raise ValueError(f"randomize[{name!r}] = {bounds!r}; allowed: (low, high), finite and ordered")
        checked[name] = (low, high)
        Parameters().replace({name: low})
        Parameters().replace({name: high})
    return checked


def draw_parameters(nominal: Parameters, ranges: Ranges, rng: np.random.Generator) -> Parameters:
    """``nominal`` with every field in ``ranges`` drawn uniformly, independently, in the order of the names."""
    return nominal.replace({name: float(rng.uniform(*ranges[name])) for name in sorted(ranges)})
