"""Rigs as a controller believes them, and how far they may be off."""

from collections.abc import Mapping

from birthsim_env.parts.drawn.randomization import documented_ranges
from birthsim_env.physics.rig.parameters import DECLARED, Parameters, value_of
from lab.studies.comparison.grid import as_described

OFF = 0.05
"""Fraction by which parameters of a known rig are off at most; ``birthsim identify`` leaves as much of friction after 5 s."""

PLANTS = ("nominal", "randomised")
"""The rig is as believed, or drawn from the documented ranges while the default is believed."""


def believed(rig: Parameters, plant: str) -> Parameters:
    """What a controller believes, with the ranges from which true rigs are drawn. Sensors have the parameters of ``rig``."""
    described = as_described(rig)
    if plant == "randomised":
        return described
    exact = {name: around(described, name, 0.0) for name in documented_ranges(described)}
    return _with(described, {**described.own_ranges, **exact})


def around(rig: Parameters, name: str, off: float) -> tuple[float, float]:
    """The range of the parameter ``name`` within a fraction ``off`` of the rig's, in what is allowed of it."""
    value, declared = value_of(rig, name), DECLARED[name]
    return max(declared.least, (1 - off) * value), min(declared.most, (1 + off) * value)


def _with(rig: Parameters, ranges: Mapping[str, tuple[float, float]]) -> Parameters:
    return Parameters.from_dict({**rig.to_dict(), "randomize": {name: list(pair) for name, pair in ranges.items()}})
