"""What is identified: parameters of a rig, how they are scaled, and how far from the owner's value they may lie."""

import math
from typing import NamedTuple

import numpy as np

from birthsim_env.physics.compiled.lanes import Array
from birthsim_env.physics.rig.consistency import least_dead_volume
from birthsim_env.physics.rig.declaration import Prior
from birthsim_env.physics.rig.parameters import DECLARED, Parameters, value_of


class FreeParameter(NamedTuple):
    """A parameter that is identified, and what is known of it beforehand (``declaration.Prior``)."""

    name: str
    prior: Prior


LATENCY = "electronics.position_latency"

ORDER = ("cylinder1", "cylinder2", "friction", "mechanics", "valves", "chambers")
"""Sections in the order in which estimates are shown; others come behind."""


def _place(section: str) -> int:
    return (*ORDER, section).index(section)


FREE_PARAMETERS = tuple(
    FreeParameter(name, one.identified)
    for name, one in sorted(DECLARED.items(), key=lambda item: _place(item[0].partition(".")[0]))
    if one.identified
)
"""What is identified: the parameters that are declared so."""


FURTHEST = 3.5
"""Spreads from the owner's value within which a parameter is looked for."""

INSIDE = 1e-3
"""Coordinates by which the search stays within what the rig's description allows, more than a step of differences."""


def unmeasured(rig: Parameters) -> Parameters:
    """``rig`` as it is known before its log: what is identified has the default rig's values."""
    known = {one.name: value_of(Parameters(), one.name) for one in FREE_PARAMETERS}
    known["chambers.dead_volume"] = max(known["chambers.dead_volume"], least_dead_volume(rig))
    return rig.replace(known)


def limits(rig: Parameters, free: tuple[FreeParameter, ...]) -> tuple[Array, Array]:
    """The least and the largest coordinates (Q,) that are looked at, for the rig as its owner describes it."""
    low, high = [], []
    for one, centre in zip(free, coordinates(rig, free), strict=True):
        declared, prior = DECLARED[one.name], one.prior
        least = max(declared.least, declared.above, least_dead_volume(rig) if one.name == "chambers.dead_volume" else -math.inf)
        low.append(max(prior.coordinate(least) + INSIDE, centre - FURTHEST * prior.spread))
        high.append(min(prior.coordinate(declared.most) - INSIDE, centre + FURTHEST * prior.spread))
    return np.array(low), np.array(high)


def coordinates(rig: Parameters, free: tuple[FreeParameter, ...]) -> Array:
    """The coordinates (Q,) of a rig."""
    return np.array([one.prior.coordinate(value_of(rig, one.name)) for one in free])


def rig_at(rig: Parameters, free: tuple[FreeParameter, ...], theta: Array) -> Parameters:
    """``rig`` with the values at coordinates (Q,)."""
    return rig.replace({one.name: one.prior.value(float(c)) for one, c in zip(free, theta, strict=True)})
