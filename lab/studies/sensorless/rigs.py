"""Rigs as a controller believes them, and how far they may be off."""

from collections.abc import Mapping

from birthsim_env.parts.drawn.randomization import documented_ranges
from birthsim_env.physics.rig.parameters import Parameters, value_of
from lab.studies.comparison.grid import as_described

PLANTS = ("nominal", "randomised")
"""The rig is as believed, or drawn from the documented ranges while the default is believed."""


def believed(rig: Parameters, plant: str) -> Parameters:
    """What a controller believes, with the ranges from which true rigs are drawn. Sensors have the parameters of ``rig``."""
    described = as_described(rig)
    if plant == "randomised":
        return described
    exact = {name: (value_of(described, name),) * 2 for name in documented_ranges(described)}
    return _with(described, {**described.own_ranges, **exact})


def _with(rig: Parameters, ranges: Mapping[str, tuple[float, float]]) -> Parameters:
    return Parameters.from_dict({**rig.to_dict(), "randomize": {name: list(pair) for name, pair in ranges.items()}})
